//! Every bad input is answered by one sentence, an exit status, and no directory.

use crate::shell::Shell;
use dust3d::kernels::healpix::missing::MISSING;

/// Runs the sky after `spoil` had its way with it.
fn refused(status: i32, spoil: impl Fn(&Shell), extra: &[&str], expected: &[&str]) {
    let shell = Shell::sky();
    spoil(&shell);
    let mut args = vec!["run", "sky.toml", "--out", "out"];
    args.extend(extra);
    let message = shell.fail(status, &args);
    for part in expected {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}

fn replaced(name: &'static str, pixel: usize, value: f64) -> impl Fn(&Shell) {
    move |shell| {
        let mut values = shell.read_f64(name);
        values[pixel] = value;
        shell.write_f64(name, &values);
    }
}

#[test]
fn lengths() {
    let cut = |bytes: usize| {
        move |shell: &Shell| {
            let whole = shell.read("tau.f64");
            shell.write("tau.f64", &whole[..bytes]);
        }
    };
    refused(
        1,
        cut(6143),
        &[],
        &["tau.f64", "6143 bytes", "whole number of f64"],
    );
    refused(
        1,
        cut(6136),
        &[],
        &["tau.f64", "767 f64 values", "12 Nside²"],
    );
    refused(1, cut(0), &[], &["tau.f64", "empty"]);
    // 12 · 7² values.
    refused(
        1,
        cut(588 * 8),
        &[],
        &["tau.f64", "Nside 7", "power of two"],
    );
    // 12 · 8² single-precision values under the name of double precision.
    refused(1, cut(768 * 4), &[], &["tau.f64", "as f32 it would fit"]);
}

#[test]
fn missing_pixels() {
    for name in ["I_353.f64", "Q_353.f64", "U_353.f64", "tau.f64"] {
        refused(
            1,
            replaced(name, 17, f64::NAN),
            &[],
            &[name, "pixel 17 is missing"],
        );
        refused(
            1,
            replaced(name, 0, MISSING),
            &[],
            &[name, "pixel 0 is missing"],
        );
    }
}

#[test]
fn values_out_of_range() {
    refused(
        1,
        replaced("I_353.f64", 5, -1e-9),
        &[],
        &["I_353.f64", "pixel 5 is -0.000000001", "0 or more"],
    );
    refused(
        1,
        replaced("tau.f64", 767, -1.0),
        &[],
        &["tau.f64", "pixel 767", "0 or more"],
    );
    refused(
        1,
        replaced("T.f64", 9, 0.0),
        &[],
        &["T.f64", "pixel 9 is 0", "above 0"],
    );
    refused(
        1,
        replaced("beta.f64", 9, f64::INFINITY),
        &[],
        &["beta.f64", "pixel 9 is infinite"],
    );
    refused(
        1,
        replaced("Q_353.f64", 9, f64::NEG_INFINITY),
        &[],
        &["Q_353.f64", "pixel 9 is infinite"],
    );
}

#[test]
fn decreasing_cube() {
    let dip = |shell: &Shell| {
        let bin: Vec<f32> = vec![2.0; 192];
        shell.write_f32("cube/ebv_11.5.f32", &bin);
    };
    refused(1, dip, &[], &["ebv_11.5", "pixel", "decrease", "clip"]);
    let shell = Shell::sky();
    dip(&shell);
    let clip = [
        "run",
        "sky.toml",
        "--out",
        "out",
        "--set",
        "cube.monotone=clip",
        "--quiet",
    ];
    shell.succeed(&clip);
    let (before, clipped) = (
        shell.read_f64("out/cube/ebv_11.0.f64"),
        shell.read_f64("out/cube/ebv_11.5.f64"),
    );
    assert_eq!(before, clipped, "the running maximum");
}

#[test]
fn cube_files() {
    let remove = |names: &'static [&'static str]| {
        move |shell: &Shell| {
            for name in names {
                std::fs::remove_file(shell.path(&format!("cube/ebv_{name}.f32"))).expect("removed");
            }
        }
    };
    refused(1, remove(&["12.5"]), &[], &["modulus 12.5", "ebv_12.5.f32"]);
    refused(1, remove(&["04.0", "19.0"]), &[], &["04.0, 19.0"]);
    let other = |shell: &Shell| shell.write_f32("cube/ebv_07.0.f32", &[1.0; 48]);
    refused(1, other, &[], &["ebv_07.0", "Nside 2", "ebv_04.0", "has 4"]);
    refused(
        2,
        |_| (),
        &["--set", "inputs.cube=cube/all.f32"],
        &["{modulus}"],
    );
}

#[test]
fn files_that_are_not_there() {
    let remove = |shell: &Shell| {
        for name in ["tau.f64", "T.f64"] {
            std::fs::remove_file(shell.path(name)).expect("removed");
        }
    };
    refused(1, remove, &[], &["tau (`", "T (`", "do not exist"]);
    refused(
        2,
        |_| (),
        &["--set", "inputs.tau=tau.dat"],
        &["inputs.tau", "tau.dat", ".f32 or .f64"],
    );
    refused(
        1,
        |shell| shell.write("dir.f64/x", b""),
        &["--set", "inputs.tau=dir.f64"],
        &["tau", "dir.f64"],
    );
    let shell = Shell::new();
    let message = shell.fail(2, &["run", "none.toml", "--out", "out"]);
    assert!(
        message.contains("none.toml") && message.contains("no such file"),
        "{message}"
    );
}

#[test]
fn incomplete_inputs() {
    let drop = |keys: &'static [&'static str]| {
        move |shell: &Shell| {
            let text = String::from_utf8(shell.read("sky.toml")).expect("UTF-8");
            let kept: Vec<&str> = text
                .lines()
                .filter(|line| !keys.iter().any(|key| line.starts_with(&format!("{key} ="))))
                .collect();
            shell.write("sky.toml", kept.join("\n").as_bytes());
        }
    };
    refused(2, drop(&["Q_353", "cube"]), &[], &["lacks Q_353, cube"]);
    refused(2, drop(&["T", "beta"]), &[], &["lacks T, beta"]);
    refused(
        2,
        drop(&["tau", "T", "beta"]),
        &[],
        &["lacks tau, T, beta", "I_545, I_857, I_2998"],
    );
    let two = [
        "--set",
        "inputs.I_545=I_353.f64",
        "--set",
        "inputs.I_857=I_353.f64",
    ];
    refused(2, drop(&["tau", "T", "beta"]), &two, &["lacks I_2998"]);
}

#[test]
fn configuration() {
    refused(
        2,
        |_| (),
        &["--set", "small_scales.enable=false"],
        &["small_scales.enable", "small_scales.enabled"],
    );
    refused(
        2,
        |_| (),
        &["--set", "layers.edges=[7,4]"],
        &["layers.edges"],
    );
    refused(2, |_| (), &["--set", "nonsense"], &["no `=`"]);
    refused(2, |_| (), &["--nside", "12"], &["`nside` is 12"]);
    refused(2, |_| (), &["--lmax", "33"], &["`lmax` is 33"]);
    refused(2, |_| (), &["--freq", "143,fast"], &["fast"]);
    refused(2, |_| (), &["--keep", "some"], &["some"]);
    refused(2, |_| (), &["--seed", "18446744073709551616"], &["seed"]);
    let unknown = |shell: &Shell| shell.write("sky.toml", b"nside = 8\n[layer]\nedges = [4]\n");
    refused(2, unknown, &[], &["sky.toml", "`layer`", "`layers`"]);
}

#[test]
fn usage() {
    let shell = Shell::new();
    for args in [
        &["run"][..],
        &["fly"],
        &["run", "--out"],
        &["map"],
        &["map", "plot", "a.f64", "--out", "a.jpg"],
        &[
            "fit",
            "--map",
            "353:a.f64",
            "--map",
            "545:b.f64",
            "--out",
            "x",
        ],
        &["fit", "--map", "353", "--out", "x"],
        &["emit", "run", "--freq", "95", "--unit", "Jy", "--out", "x"],
    ] {
        shell.fail(2, args);
    }
}

#[test]
fn existing_directory() {
    let shell = Shell::sky();
    shell.write("out/precious", b"data");
    let message = shell.fail(2, &["run", "sky.toml", "--out", "out"]);
    assert!(
        message.contains("exists") && message.contains("--force"),
        "{message}"
    );
    // Not even --force removes what the program has not made.
    let message = shell.fail(2, &["run", "sky.toml", "--out", "out", "--force"]);
    assert!(message.contains("not made by dust3d"), "{message}");
    assert_eq!(shell.read("out/precious"), b"data");

    shell.succeed(&["run", "sky.toml", "--out", "new/deep", "--quiet"]);
    let before = shell.read("new/deep/manifest.json");
    shell.fail(2, &["run", "sky.toml", "--out", "new/deep"]);
    assert_eq!(shell.read("new/deep/manifest.json"), before);
    shell.succeed(&[
        "run", "sky.toml", "--out", "new/deep", "--quiet", "--force", "--seed", "9",
    ]);
    assert_eq!(shell.json("new/deep/manifest.json")["seed"], 9);
    // A failure leaves the earlier run as it was.
    shell.write("tau.f64", b"");
    shell.fail(1, &["run", "sky.toml", "--out", "new/deep", "--force"]);
    assert_eq!(shell.json("new/deep/manifest.json")["seed"], 9);
}

#[test]
fn simd_level() {
    let shell = Shell::sky();
    let mut command = shell.command(&["map", "info", "tau.f64"]);
    let output = command.env("DUST3D_SIMD", "sse9").output().expect("starts");
    assert_eq!(output.status.code(), Some(2));
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(
        message.contains("DUST3D_SIMD=sse9") && message.contains("portable"),
        "{message}"
    );
    let mut command = shell.command(&["run", "sky.toml", "--out", "portable", "--quiet"]);
    assert!(
        command
            .env("DUST3D_SIMD", "portable")
            .status()
            .expect("starts")
            .success()
    );
    assert_eq!(shell.json("portable/manifest.json")["simd"], "portable");
}

/// A file system that is full: a directory whose files may not grow beyond a few kilobytes.
#[cfg(target_os = "linux")]
#[test]
fn full_disk() {
    use std::process::Command;
    let shell = Shell::sky();
    // With SIGXFSZ ignored, writing beyond the limit fails with EFBIG, as on a full disk with ENOSPC.
    let script = format!(
        "trap '' XFSZ; ulimit -f 4; exec {} run sky.toml --out out",
        env!("CARGO_BIN_EXE_dust3d")
    );
    let before = shell.entries();
    let output = Command::new("bash")
        .args(["-c", &script])
        .current_dir(shell.path(""))
        .output()
        .expect("bash starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("cannot write `out/"), "{stderr}");
    assert_eq!(shell.entries(), before);
}

#[cfg(target_os = "linux")]
#[test]
fn interrupt_leaves_nothing() {
    use std::process::{Command, Stdio};
    let shell = Shell::new();
    let mut child = shell
        .command(&["run", "--out", "out", "--nside", "128"])
        .stderr(Stdio::piped())
        .spawn()
        .expect("starts");
    let started = std::time::Instant::now();
    while shell.entries().is_empty() && started.elapsed().as_secs() < 60 {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert!(!shell.entries().is_empty(), "nothing was begun");
    Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .expect("kill starts");
    let status = child.wait().expect("ends");
    assert_eq!(status.code(), Some(1));
    assert_eq!(shell.entries(), Vec::<String>::new());
}
