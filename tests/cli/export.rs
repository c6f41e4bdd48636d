//! `export --pysm`: the files that PySM reads, and what it makes of them.
//!
//! PySM itself is run by `benches/peers/pysm.py`; here its formula is written out.

use crate::shell::Shell;
use dust3d::io::{MapSource, Role};
use dust3d::kernels::planck::spectrum::planck_scalar;
use dust3d::kernels::units::Unit;

fn run() -> Shell {
    let shell = Shell::sky();
    shell.succeed(&["run", "sky.toml", "--out", "run", "--quiet"]);
    shell
}

fn column(shell: &Shell, spec: &str) -> Vec<f64> {
    let path = shell.path(spec);
    let map = MapSource::parse(&path).expect("a name").read();
    map.unwrap_or_else(|error| panic!("{error}")).values
}

#[test]
fn export_holds_the_run() {
    let shell = run();
    let text = shell.succeed(&["export", "run", "--pysm"]);
    assert!(text.contains("pysm3.Sky(nside=8"), "{text}");
    for layer in 1..=6 {
        for (name, wanted) in [
            (
                format!("ampl{layer}.fits[1]"),
                format!("templates/I_{layer}"),
            ),
            (
                format!("ampl{layer}.fits[Q_STOKES]"),
                format!("templates/Q_{layer}"),
            ),
            (
                format!("ampl{layer}.fits[3]"),
                format!("templates/U_{layer}"),
            ),
            (format!("specind{layer}.fits"), format!("laws/beta_{layer}")),
            (format!("temp{layer}.fits"), format!("laws/T_{layer}")),
        ] {
            let got = column(&shell, &format!("run/pysm/thermaldust_{name}"));
            assert!(
                got == shell.read_f64(&format!("run/{wanted}.f64")),
                "{name}"
            );
        }
    }
    // Units are in the headers, too.
    let path = shell.path("run/pysm/thermaldust_ampl1.fits");
    let map = MapSource::parse(&path).and_then(|map| map.read_as(Role::StokesU(353.0)));
    assert_eq!(
        map.expect("a map").values,
        shell.read_f64("run/templates/U_1.f64")
    );
    // The same bytes elsewhere, but for the paths.
    shell.succeed(&["export", "run", "--pysm", "--out", "a b{c}", "--quiet"]);
    for name in ["ampl4", "specind4", "temp4"] {
        let name = format!("thermaldust_{name}.fits");
        assert_eq!(
            shell.read(&format!("run/pysm/{name}")),
            shell.read(&format!("a b{{c}}/{name}"))
        );
    }
    let message = shell.fail(2, &["export", "run", "--pysm"]);
    assert!(message.contains("--force"), "{message}");
    shell.succeed(&["export", "run", "--pysm", "--force"]);
    shell.fail(2, &["export", "run", "--out", "x"]);
    let message = shell.fail(2, &["export", "cube", "--pysm", "--out", "x"]);
    assert!(message.contains("cube"), "{message}");
}

#[test]
fn export_configuration_is_complete() {
    let shell = run();
    shell.succeed(&["export", "run", "--pysm", "--out", "a b{c}", "--quiet"]);
    let text = String::from_utf8(shell.read("a b{c}/pysm3.toml")).expect("UTF-8");
    let config: toml::Table = text.parse().expect("TOML");
    let part = config["dust3d"].as_table().expect("a table");
    assert_eq!(part["class"].as_str(), Some("ModifiedBlackBodyLayers"));
    assert_eq!(part["num_layers"].as_integer(), Some(6));
    assert_eq!(part["max_nside"].as_integer(), Some(8));
    assert_eq!(part["freq_ref"].as_str(), Some("353 GHz"));
    assert_eq!(part["unit_layers"].as_str(), Some("MJy/sr"));
    assert_eq!(part["unit_mbb_temperature"].as_str(), Some("K"));
    assert_eq!(part["color_correction"].as_float(), Some(1.0));
    for key in ["map_layers", "map_mbb_index", "map_mbb_temperature"] {
        // As Python's `format` fills it in.
        let path = part[key].as_str().expect("a path");
        let path = path
            .replace("{layer}", "6")
            .replace("{{", "{")
            .replace("}}", "}");
        let path = std::path::PathBuf::from(path);
        assert!(path.is_absolute() && path.is_file(), "{}", path.display());
    }
}

#[test]
fn export_of_other_models() {
    let shell = run();
    let emit = |model: &str| {
        shell.succeed(&[
            "emit", "run", "--freq", "95", "--unit", "uK_RJ", "--model", model, "--out", model,
        ]);
    };
    for (model, layers) in [("3d", 6), ("3d-uniform", 6), ("2d", 1)] {
        emit(model);
        let out = format!("pysm-{model}");
        shell.succeed(&["export", "run", "--pysm", "--model", model, "--out", &out]);
        assert_eq!(
            shell.json(&format!("{out}/manifest.json"))["layers"],
            layers
        );
        // What PySM does: amplitudes in uK_RJ at 353 GHz, times (ν/ν₀)^(β − 2) B_ν(T)/B_ν₀(T).
        let to_rj = Unit::MicroKRj.from_mjysr(353.0).expect("a frequency");
        let mut sum = vec![0.0; 768];
        for layer in 1..=layers {
            let read = |name: &str| column(&shell, &format!("{out}/thermaldust_{name}"));
            let amplitude = read(&format!("ampl{layer}.fits[Q_STOKES]"));
            let (beta, t) = (
                read(&format!("specind{layer}.fits")),
                read(&format!("temp{layer}.fits")),
            );
            for (p, sum) in sum.iter_mut().enumerate() {
                let ratio = planck_scalar(95.0, t[p]) / planck_scalar(353.0, t[p]);
                *sum += amplitude[p] * to_rj * (95.0_f64 / 353.0).powf(beta[p] - 2.0) * ratio;
            }
        }
        let ours = shell.read_f64(&format!("{model}/{model}_95GHz_Q.f64"));
        let largest = ours.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        for (a, b) in ours.iter().zip(&sum) {
            assert!((a - b).abs() < 1e-12 * largest, "{model}: {a} {b}");
        }
    }
}
