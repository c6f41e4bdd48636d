//! `run --preset`, `config --preset`.

use crate::shell::Shell;
use dust3d::config::{Config, Draft, Preset};
use std::path::Path;

#[test]
fn presets_are_valid_and_printed() {
    let shell = Shell::new();
    for preset in Preset::ALL {
        let config = Config::from_toml(preset.toml()).expect("valid");
        assert_eq!(config.inputs.is_built_in(), preset != Preset::PlanckGnilc);
        assert_eq!(
            shell.succeed(&["config", "--preset", preset.name()]),
            preset.toml()
        );
    }
    let message = shell.fail(2, &["run", "--preset", "planck", "--out", "x"]);
    assert!(message.contains("demo, paper, planck-gnilc"), "{message}");
    // Those of the paper that are defaults too are the same.
    let paper = Config::from_toml(Preset::Paper.toml()).expect("valid");
    let default = Config::default().resolve().expect("valid");
    assert_eq!(
        (paper.layers, paper.polarisation),
        (default.layers, default.polarisation)
    );
    assert_eq!(paper.field.pitch_deg, Some(-33.0));
}

#[test]
fn a_preset_is_overridden() {
    let draft = Draft::new()
        .toml(Preset::Paper.toml(), Path::new(""))
        .and_then(|draft| draft.toml("nside = 8\n[laws]\ns_t = 1.5", Path::new("")));
    let config = draft.and_then(Draft::finish).expect("valid");
    assert_eq!(
        (config.nside, config.laws.s_t, config.laws.s_beta),
        (8, 1.5, 1.94)
    );
    let shell = Shell::sky();
    shell.succeed(&[
        "run", "sky.toml", "--preset", "paper", "--out", "a", "--quiet", "--seed", "5",
    ]);
    let manifest = shell.json("a/manifest.json");
    assert_eq!(manifest["pitch_deg"], -33.0);
    assert_eq!(manifest["laws"]["calibration_status"], "given");
    assert_eq!(
        (&manifest["seed"], &manifest["nside"]),
        (&5.into(), &8.into())
    );
    shell.succeed(&[
        "run", "--preset", "demo", "--nside", "8", "--out", "b", "--quiet",
    ]);
    assert_eq!(shell.json("b/manifest.json")["synthetic_inputs"], true);
}

/// One attempt names every file that is not there, and where they come from.
#[test]
fn missing_files_of_a_preset() {
    let shell = Shell::new();
    let message = shell.fail(1, &["run", "--preset", "planck-gnilc", "--out", "x"]);
    for part in [
        "I_353, Q_353, U_353 (`planck/COM_CompMap_IQU-thermaldust-gnilc-varres_2048_R3.00.fits`)",
        "tau (`planck/COM_CompMap_Dust-GNILC-Model-Opacity_2048_R2.01.fits`)",
        "T (`",
        "beta (`",
        "cube at every distance modulus",
        "dust3d config --preset planck-gnilc",
    ] {
        assert!(message.contains(part), "{part}: {message}");
    }
}
