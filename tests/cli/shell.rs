//! Running the `dust3d` command, and small files for it.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// A directory of its own in which the command runs.
pub(crate) struct Shell {
    dir: TempDir,
}

impl Shell {
    pub(crate) fn new() -> Self {
        Self {
            dir: tempfile::tempdir().expect("a temporary directory"),
        }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    pub(crate) fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_dust3d"));
        command.args(args).current_dir(self.dir.path());
        command
    }

    pub(crate) fn run(&self, args: &[&str]) -> Output {
        self.command(args).output().expect("the command starts")
    }

    /// Runs a command that must succeed; its stdout.
    pub(crate) fn succeed(&self, args: &[&str]) -> String {
        let output = self.run(args);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{args:?}: {stderr}");
        String::from_utf8(output.stdout).expect("UTF-8")
    }

    /// Runs a command that must fail with `status`, say so in one line, and leave nothing new behind; the line.
    pub(crate) fn fail(&self, status: i32, args: &[&str]) -> String {
        let before = self.entries();
        let output = self.run(args);
        let stderr = String::from_utf8(output.stderr).expect("UTF-8");
        assert_eq!(output.status.code(), Some(status), "{args:?}: {stderr}");
        assert_eq!(self.entries(), before, "{args:?} left something behind");
        // Progress comes before it.
        let last = stderr.lines().last().unwrap_or_default().to_owned();
        assert!(
            last.starts_with("dust3d: ") && last.len() > 30,
            "{args:?}: {stderr}"
        );
        last
    }

    /// Everything in the directory, hidden files too, sorted.
    pub(crate) fn entries(&self) -> Vec<String> {
        let mut entries = Vec::new();
        list(self.dir.path(), &mut entries);
        entries.sort();
        entries
    }

    pub(crate) fn write(&self, name: &str, bytes: &[u8]) {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().expect("a parent")).expect("a directory");
        std::fs::write(path, bytes).expect("a file");
    }

    pub(crate) fn write_f64(&self, name: &str, values: &[f64]) {
        let bytes: Vec<u8> = values
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        self.write(name, &bytes);
    }

    pub(crate) fn write_f32(&self, name: &str, values: &[f32]) {
        let bytes: Vec<u8> = values
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        self.write(name, &bytes);
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|cause| panic!("{name}: {cause}"))
    }

    pub(crate) fn read_f64(&self, name: &str) -> Vec<f64> {
        let bytes = self.read(name);
        let (values, rest) = bytes.as_chunks::<8>();
        assert!(rest.is_empty());
        values
            .iter()
            .map(|value| f64::from_le_bytes(*value))
            .collect()
    }

    pub(crate) fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_slice(&self.read(name)).unwrap_or_else(|cause| panic!("{name}: {cause}"))
    }

    /// Observations at Nside 8 over a cube at Nside 4, smooth and sound, with their configuration `sky.toml`.
    pub(crate) fn sky() -> Self {
        let shell = Self::new();
        let wave = |mean: f64, depth: f64, phase: f64| -> Vec<f64> {
            (0..768)
                .map(|p| mean * (1.0 + depth * (f64::from(p) / 768.0 * PI * 6.0 + phase).sin()))
                .collect()
        };
        shell.write_f64("I_353.f64", &wave(1.0, 0.5, 0.0));
        shell.write_f64("Q_353.f64", &wave(0.05, 0.3, 1.0));
        shell.write_f64("U_353.f64", &wave(-0.02, 0.8, 2.0));
        shell.write_f64("tau.f64", &wave(1e-5, 0.5, 0.0));
        shell.write_f64("T.f64", &wave(19.4, 0.05, 3.0));
        shell.write_f64("beta.f64", &wave(1.6, 0.05, 4.0));
        for half in 8_u8..=38 {
            let modulus = f64::from(half) / 2.0;
            let bin: Vec<f32> = (0..192_u8)
                .map(|p| (modulus as f32 - 3.0) * (1.0 + f32::from(p) / 400.0))
                .collect();
            shell.write_f32(&format!("cube/ebv_{modulus:04.1}.f32"), &bin);
        }
        shell.write("sky.toml", SKY.as_bytes());
        shell
    }
}

/// The configuration of [`Shell::sky`].
const SKY: &str = r#"nside = 8
frequencies = [353.0]
[inputs]
I_353 = "I_353.f64"
Q_353 = "Q_353.f64"
U_353 = "U_353.f64"
tau = "tau.f64"
T = "T.f64"
beta = "beta.f64"
cube = "cube/ebv_{modulus}.f32"
"#;

fn list(dir: &Path, entries: &mut Vec<String>) {
    for entry in std::fs::read_dir(dir).expect("a directory") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            list(&path, entries);
        }
        entries.push(path.display().to_string());
    }
}
