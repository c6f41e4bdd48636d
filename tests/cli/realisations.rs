//! Many realisations of one preparation, and layers kept on disk: the same bits as single runs in memory.

use crate::shell::Shell;
use dust3d::config::Draft;
use dust3d::io::RunDir;
use dust3d::pipeline::{self, Options};
use dust3d::progress::Silent;
use std::path::{Path, PathBuf};

/// Every file below `dir` but the manifest: its name there and its contents.
fn files(dir: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    let mut left = vec![dir.to_owned()];
    while let Some(next) = left.pop() {
        for entry in std::fs::read_dir(next).expect("a directory") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                left.push(path);
            } else if !path.ends_with("manifest.json") {
                let name = path.strip_prefix(dir).expect("below it").to_owned();
                found.push((name, std::fs::read(path).expect("a file")));
            }
        }
    }
    found.sort();
    found
}

#[test]
fn realisations_equal_single_runs() {
    let shell = Shell::sky();
    shell.succeed(&[
        "run",
        "sky.toml",
        "--out",
        "many",
        "--realisations",
        "7..8,3",
    ]);
    for seed in ["3", "7", "8"] {
        let single = format!("single{seed}");
        shell.succeed(&[
            "run", "sky.toml", "--out", &single, "--seed", seed, "--quiet",
        ]);
        let many = files(&shell.path(&format!("many/seed000{seed}")));
        assert!(many.len() > 100);
        assert_eq!(many, files(&shell.path(&single)), "seed {seed}");
    }
}

#[test]
fn realisations_of_the_built_in_sky_keep_the_sky() {
    let shell = Shell::new();
    let small = ["--nside", "8", "--quiet", "--seed"];
    let many = ["run", "--out", "many", "--realisations", "1..2"];
    shell.succeed(&[&many[..], &small, &["5"]].concat());
    let one = ["run", "--out", "one", "--set", "sky_seed=5"];
    shell.succeed(&[&one[..], &small, &["2"]].concat());
    assert_eq!(
        files(&shell.path("many/seed0002")),
        files(&shell.path("one"))
    );
    assert_eq!(
        shell.read("many/seed0001/observations/I_353.f64"),
        shell.read("many/seed0002/observations/I_353.f64")
    );
    assert_ne!(
        shell.read("many/seed0001/templates/Q_1.f64"),
        shell.read("many/seed0002/templates/Q_1.f64")
    );
}

#[test]
fn refused_realisations_change_nothing() {
    let shell = Shell::new();
    for (bad, says) in [
        ("x", "seeds are needed"),
        ("5..3", "empty"),
        ("0..99999", "more than"),
    ] {
        let line = shell.fail(2, &["run", "--out", "a", "--realisations", bad]);
        assert!(line.contains(says), "{line}");
    }
    let run = ["run", "--out", "a", "--nside", "4", "--quiet"];
    shell.succeed(&[&run[..], &["--realisations", "2"]].concat());
    // Seed 1 could be made, but seed 2 is there: refused before any work.
    let line = shell.fail(2, &[&run[..], &["--realisations", "1..2"]].concat());
    assert!(
        line.contains("seed0002") && line.contains("--force"),
        "{line}"
    );
}

#[test]
fn layers_on_disk_give_the_same_bits() {
    let config = ["nside=8", "lmax=20", "output.dtype=f64"]
        .iter()
        .fold(Draft::new(), |draft, s| draft.set(s).expect("a known key"))
        .finish()
        .expect("a valid configuration");
    let parent = tempfile::tempdir().expect("a temporary directory");
    let make = |name: &str, memory_pixels: usize| {
        let target = parent.path().join(name);
        let out = RunDir::create(&target, false).expect("a new directory");
        let options = Options {
            memory_pixels,
            ..Options::default()
        };
        let mut prepared =
            pipeline::prepare(&config, None, &out, &options, &Silent).expect("layers");
        let manifest = prepared
            .realise(config.seed, &out, &Silent)
            .expect("a realisation");
        out.finish(manifest).expect("a finished directory");
        files(&target)
    };
    let (memory, disk) = (make("memory", usize::MAX), make("disk", 0));
    assert!(memory.len() > 100);
    assert_eq!(memory, disk);
}
