//! `config`, `run`, `emit`, `fit` as a user types them.

use crate::shell::Shell;
use dust3d::kernels::planck::spectrum::planck_scalar;
use dust3d::kernels::units::Unit;

#[test]
fn config_is_accepted_unchanged() {
    let shell = Shell::new();
    let text = shell.succeed(&["config"]);
    shell.write("default.toml", text.as_bytes());
    let small = ["--nside", "8", "--quiet"];
    let with = [&["run", "default.toml", "--out", "a"][..], &small].concat();
    let without = [&["run", "--out", "b"][..], &small].concat();
    shell.succeed(&with);
    shell.succeed(&without);
    assert_eq!(
        shell.read("a/templates/Q_3.f64"),
        shell.read("b/templates/Q_3.f64")
    );
    assert_eq!(shell.read("a/overview.png"), shell.read("b/overview.png"));
}

#[test]
fn every_command_has_help_with_an_example() {
    let shell = Shell::new();
    let top = shell.succeed(&["--help"]);
    assert!(top.contains("Example"));
    for command in [
        &["run"][..],
        &["config"],
        &["emit"],
        &["export"],
        &["fit"],
        &["completions"],
        &["man"],
        &["map", "info"],
        &["map", "plot"],
        &["map", "convert"],
        &["map", "degrade"],
        &["map", "spectrum"],
        &["map", "diff"],
        &["map", "analyse"],
        &["map", "synthesise"],
    ] {
        let text = shell.succeed(&[command, &["--help"]].concat());
        assert!(
            text.contains("Example") && text.contains("dust3d "),
            "{command:?}: {text}"
        );
    }
    assert!(shell.succeed(&["--version"]).starts_with("dust3d "));
}

#[test]
fn run_prints_its_findings_and_quiet_nothing() {
    let shell = Shell::sky();
    let output = shell.run(&["run", "sky.toml", "--out", "a"]);
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    for part in [
        "pitch angle",
        "T averaged (K)",
        "observed",
        "simulated",
        "s_avg",
        "polarisation capped",
        "seconds",
        "overview.png",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let progress = String::from_utf8(output.stderr).expect("UTF-8");
    assert!(
        progress.contains("small scales") && !progress.contains('\r'),
        "plain lines: {progress}"
    );
    let output = shell.run(&["run", "sky.toml", "--out", "b", "--quiet"]);
    assert!(output.status.success() && output.stdout.is_empty() && output.stderr.is_empty());
}

#[test]
fn manifest_records_every_file() {
    let shell = Shell::sky();
    shell.succeed(&[
        "run",
        "sky.toml",
        "--out",
        "a",
        "--quiet",
        "--seed",
        "18446744073709551615",
        "--freq",
        "95.5,100um",
    ]);
    let manifest = shell.json("a/manifest.json");
    assert_eq!(manifest["seed"], u64::MAX);
    assert_eq!(
        manifest["config"]["frequencies"],
        serde_json::json!([95.5, 2997.92458])
    );
    let files = manifest["files"].as_array().expect("a list");
    for file in files {
        let path = file["path"].as_str().expect("a path");
        let hash = blake3::hash(&shell.read(&format!("a/{path}")))
            .to_hex()
            .to_string();
        assert_eq!(file["blake3"], hash, "{path}");
    }
    let on_disk = shell
        .entries()
        .iter()
        .filter(|path| path.contains("/a/") && std::path::Path::new(path).is_file())
        .count();
    assert_eq!(on_disk, files.len() + 1);
    assert!(shell.path("a/emission/3d_95.5GHz_I.f64").exists());
    assert!(shell.path("a/emission/2d_2997.92458GHz_U.f64").exists());
    let inputs = manifest["inputs"].as_array().expect("a list");
    assert_eq!(inputs.len(), 6 + 31);
    for key in [
        "created",
        "pitch_deg",
        "layer_averages",
        "small_scales",
        "laws",
        "mbb_fit_total",
        "peak_memory_bytes",
    ] {
        assert!(!manifest[key].is_null(), "{key}");
    }
}

#[test]
fn emit_repeats_the_run() {
    let shell = Shell::sky();
    shell.succeed(&[
        "run", "sky.toml", "--out", "run", "--quiet", "--freq", "95,353",
    ]);
    for model in ["3d", "3d-uniform", "2d"] {
        shell.succeed(&[
            "emit", "run", "--freq", "95,353", "--model", model, "--out", model, "--quiet",
        ]);
        for nu in [95, 353] {
            for letter in ["I", "Q", "U"] {
                let name = format!("{model}_{nu}GHz_{letter}.f64");
                let (run, emitted) = (
                    shell.read_f64(&format!("run/emission/{name}")),
                    shell.read_f64(&format!("{model}/{name}")),
                );
                let largest = run.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
                for (a, b) in run.iter().zip(&emitted) {
                    assert!((a - b).abs() <= 1e-13 * largest, "{name}: {a} {b}");
                }
            }
        }
    }
}

#[test]
fn emit_units_and_bandpasses() {
    let shell = Shell::sky();
    shell.succeed(&["run", "sky.toml", "--out", "run", "--quiet"]);
    shell.succeed(&["emit", "run", "--freq", "150", "--out", "mjy"]);
    shell.succeed(&[
        "emit", "run", "--freq", "150", "--unit", "uK_CMB", "--out", "cmb",
    ]);
    shell.write("one.txt", b"# a band of one frequency\n150.0, 2.5\n");
    shell.succeed(&[
        "emit",
        "run",
        "--freq",
        "150",
        "--bandpass",
        "one.txt",
        "--unit",
        "uK_CMB",
        "--out",
        "band",
    ]);
    shell.write("wide.txt", b"140 1\n150 1\n160 1\n");
    shell.succeed(&["emit", "run", "--bandpass", "wide.txt", "--out", "wide"]);
    let (mjy, cmb) = (
        shell.read_f64("mjy/3d_150GHz_I.f64"),
        shell.read_f64("cmb/3d_150GHz_I.f64"),
    );
    let band = shell.read_f64("band/3d_150GHz_I.f64");
    let wide = shell.read_f64("wide/3d_wide_I.f64");
    let factor = Unit::MicroKCmb.from_mjysr(150.0).expect("a factor");
    for p in 0..mjy.len() {
        assert!((cmb[p] / (mjy[p] * factor) - 1.0).abs() < 1e-13);
        assert!((band[p] / cmb[p] - 1.0).abs() < 1e-13);
        // Curved upwards over the band, by a little.
        assert!(wide[p] > mjy[p] && wide[p] < 1.05 * mjy[p]);
    }
    for (text, part) in [
        ("143\n", "line 1"),
        ("150 1\n140 1\n", "line 2"),
        ("", "no line"),
        ("150 x\n", "line 1"),
        ("150 0\n", "bad.txt"),
    ] {
        shell.write("bad.txt", text.as_bytes());
        let message = shell.fail(1, &["emit", "run", "--bandpass", "bad.txt", "--out", "x"]);
        assert!(message.contains(part), "{part}: {message}");
    }
    shell.fail(
        2,
        &[
            "emit",
            "run",
            "--freq",
            "1,2",
            "--bandpass",
            "one.txt",
            "--out",
            "x",
        ],
    );
    shell.fail(2, &["emit", "run", "--out", "x"]);
    shell.fail(2, &["emit", "cube", "--freq", "1", "--out", "x"]);
    shell.fail(2, &["emit", "mjy", "--freq", "1", "--out", "x"]);
    let mut spoilt = shell.read("run/templates/Q_2.f64");
    spoilt[5] ^= 1;
    shell.write("run/templates/Q_2.f64", &spoilt);
    let message = shell.fail(1, &["emit", "run", "--freq", "1", "--out", "x"]);
    assert!(
        message.contains("Q_2.f64") && message.contains("changed"),
        "{message}"
    );
}

#[test]
fn emit_resamples_and_smooths() {
    let shell = Shell::sky();
    shell.succeed(&["run", "sky.toml", "--out", "run", "--quiet"]);
    shell.succeed(&["emit", "run", "--freq", "353", "--out", "plain"]);
    shell.succeed(&[
        "emit", "run", "--freq", "353", "--nside", "32", "--out", "fine",
    ]);
    shell.succeed(&[
        "emit", "run", "--freq", "353", "--beam", "3600", "--dtype", "f32", "--out", "smooth",
    ]);
    let (plain, fine) = (
        shell.read_f64("plain/3d_353GHz_I.f64"),
        shell.read_f64("fine/3d_353GHz_I.f64"),
    );
    assert_eq!(fine.len(), 12 * 32 * 32);
    let mean = |map: &[f64]| map.iter().sum::<f64>() / map.len() as f64;
    let ratio = mean(&fine) / mean(&plain);
    assert!((ratio - 1.0).abs() < 1e-4, "{ratio}");
    let bytes = shell.read("smooth/3d_353GHz_I.f32");
    let smooth: Vec<f64> = bytes
        .as_chunks::<4>()
        .0
        .iter()
        .map(|x| f64::from(f32::from_le_bytes(*x)))
        .collect();
    let spread = |map: &[f64]| map.iter().map(|x| (x - mean(map)).powi(2)).sum::<f64>();
    let ratio = mean(&smooth) / mean(&plain);
    assert!((ratio - 1.0).abs() < 1e-4, "{ratio}");
    assert!(spread(&smooth) < 0.5 * spread(&plain));
}

#[test]
fn fit_recovers_parameters() {
    let shell = Shell::new();
    let (t, beta) = (
        |p: usize| 15.0 + p as f64 / 8.0,
        |p: usize| 1.2 + p as f64 / 60.0,
    );
    let nu = [
        ("353", 353.0),
        ("545", 545.0),
        ("857", 857.0),
        ("100um", 2997.92458),
    ];
    for (name, nu) in nu {
        let mut map: Vec<f64> = (0..48)
            .map(|p| 1e-5 * (nu / 353.0_f64).powf(beta(p)) * planck_scalar(nu, t(p)))
            .collect();
        if name == "857" {
            map[7] = f64::NAN;
            map[8] = 0.0;
        }
        shell.write_f64(&format!("{name}.f64"), &map);
    }
    let maps: Vec<String> = nu
        .iter()
        .rev()
        .map(|(name, _)| format!("{name}:{name}.f64"))
        .collect();
    let mut args = vec!["fit", "--out", "fitted"];
    for map in &maps {
        args.extend(["--map", map]);
    }
    let text = shell.succeed(&args);
    assert!(text.contains("fitted 46 of 48 pixels (2 without"), "{text}");
    let [tau, fitted_t, fitted_beta] =
        ["tau", "T", "beta"].map(|name| shell.read_f64(&format!("fitted/{name}.f64")));
    for p in 0..48 {
        if p == 7 || p == 8 {
            assert_eq!([tau[p], fitted_t[p], fitted_beta[p]], [-1.6375e30; 3]);
        } else {
            assert!(
                (fitted_t[p] - t(p)).abs() < 1e-7
                    && (fitted_beta[p] - beta(p)).abs() < 1e-7
                    && (tau[p] / 1e-5 - 1.0).abs() < 1e-7
            );
        }
    }
    assert_eq!(
        shell.json("fitted/manifest.json")["counts"]["unconverged_fits"],
        2
    );
    let odd = [
        "fit",
        "--out",
        "x",
        "--map",
        "353:353.f64",
        "--map",
        "545:545.f64",
        "--map",
        "600:857.f64",
    ];
    let message = shell.fail(2, &odd);
    assert!(message.contains("--sigma 600:"), "{message}");
    shell.succeed(&[&odd[..], &["--sigma", "600:0.1"]].concat());
    shell.fail(
        2,
        &[&odd[..], &["--sigma", "600:0.1", "--map", "353:353.f64"]].concat(),
    );
}
