//! `emit` with several bands, beams, coordinates, coefficients, runs.
//!
//! healpy is compared with by `benches/peers/harmonics.py`.

use crate::shell::Shell;
use dust3d::io::{Bandpass, MapSource};
use dust3d::kernels::units::Unit;
use dust3d_tests::random::Random;
use std::path::Path;

fn run() -> Shell {
    let shell = Shell::sky();
    shell.succeed(&["run", "sky.toml", "--out", "run", "--quiet"]);
    shell.write("wide.txt", b"# GHz weight\n140 1\n150 2\n160 1\n");
    shell.write("red.txt", b"80, 1\n95, 1\n");
    shell
}

/// `emit run … --out OUT --quiet`.
fn emit(shell: &Shell, out: &str, options: &str) {
    let mut args = vec!["emit", "run", "--out", out, "--quiet"];
    args.extend(options.split(' '));
    shell.succeed(&args);
}

fn names(shell: &Shell, dir: &str) -> Vec<String> {
    let marker = format!("/{dir}/");
    let mut names: Vec<String> = shell
        .entries()
        .iter()
        .filter_map(|path| Some(path.split_once(&marker)?.1.to_owned()))
        .filter(|name| name != "manifest.json")
        .collect();
    names.sort();
    names
}

fn rms(map: &[f64]) -> f64 {
    (map.iter().map(|x| x * x).sum::<f64>() / map.len() as f64).sqrt()
}

#[test]
fn one_pass_is_as_one_by_one() {
    let shell = run();
    emit(
        &shell,
        "all",
        "--bandpass wide.txt,red.txt --band 353 --band low=23 --band r2=red.txt --unit uK_CMB --stokes QU",
    );
    let wanted = ["low", "red", "r2", "wide", "353GHz"];
    assert_eq!(names(&shell, "all").len(), 2 * wanted.len());
    emit(&shell, "wide", "--bandpass wide.txt --unit uK_CMB");
    emit(&shell, "red", "--freq 90 --bandpass red.txt --unit uK_CMB");
    emit(&shell, "one", "--freq 23,353 --unit uK_CMB");
    for (all, alone) in [
        ("low", "one/3d_23GHz"),
        ("353GHz", "one/3d_353GHz"),
        ("red", "red/3d_90GHz"),
        ("r2", "red/3d_90GHz"),
        ("wide", "wide/3d_wide"),
    ] {
        for letter in ["Q", "U"] {
            assert!(
                shell.read(&format!("all/3d_{all}_{letter}.f64"))
                    == shell.read(&format!("{alone}_{letter}.f64")),
                "{all} {letter}"
            );
        }
    }
    // As many frequencies as files name them.
    emit(
        &shell,
        "named",
        "--freq 90,150 --bandpass red.txt --bandpass wide.txt --stokes I",
    );
    assert_eq!(
        names(&shell, "named"),
        ["3d_150GHz_I.f64", "3d_90GHz_I.f64"]
    );
    for (bad, part) in [
        ("--freq 1,2,3 --bandpass red.txt,wide.txt", "--band"),
        ("--band red.txt --bandpass red.txt", "called red"),
        ("--freq 95 --band 95", "called 95GHz"),
        ("--band a/b=95", "`a/b`"),
        ("--freq 1,2 --beam 1,2,3", "3 beams for 2 bands"),
        ("--freq 1 --beam -1", "--beam"),
        ("--freq 1 --coord B", "G, C, E"),
        ("--freq 1 --lmax 33 --coord C", "4 Nside = 32"),
        ("--freq 1 --stokes V", "V"),
        ("--freq 60000 --unit K_CMB", "60000 GHz in K_CMB"),
    ] {
        let mut args = vec!["emit", "run", "--out", "x"];
        args.extend(bad.split(' '));
        let message = shell.fail(2, &args);
        assert!(message.contains(part), "{bad}: {message}");
    }
    let message = shell.fail(1, &["emit", "run", "--out", "x", "--band", "nowhere.txt"]);
    assert!(message.contains("nowhere.txt"), "{message}");
}

#[test]
fn every_unit_is_the_factor() {
    let shell = run();
    emit(&shell, "MJy", "--freq 150");
    let base = shell.read_f64("MJy/3d_150GHz_U.f64");
    for (number, unit) in Unit::ALL.into_iter().enumerate() {
        let out = format!("u{number}");
        emit(&shell, &out, &format!("--freq 150 --unit {unit}"));
        let factor = unit.from_mjysr(150.0).expect("a frequency");
        let map = shell.read_f64(&format!("{out}/3d_150GHz_U.f64"));
        for (map, base) in map.iter().zip(&base) {
            assert!((map / (base * factor) - 1.0).abs() < 1e-13, "{unit}");
        }
        assert_eq!(
            shell.json(&format!("{out}/manifest.json"))["files"][0]["unit"],
            unit.name()
        );
    }
}

#[test]
fn planck_instrument_model() {
    let shell = run();
    let rimo = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/fits/rimo.fits");
    std::fs::copy(rimo, shell.path("rimo.fits")).expect("a copy");
    let (hfi, name) = Bandpass::read(&shell.path("rimo.fits[BANDPASS_F143]")).expect("a band");
    assert_eq!((name.as_str(), hfi.nu_ghz.len()), ("F143", 27));
    // 0.25/cm is c · 25/m.
    assert!((hfi.nu_ghz[0] - 7.494_811_45).abs() < 1e-12);
    assert_eq!(hfi.weight[18], 1.0);
    let (lfi, name) = Bandpass::read(&shell.path("rimo.fits[HDU=3]")).expect("a band");
    assert_eq!(
        (name.as_str(), lfi.nu_ghz[0], lfi.nu_ghz.len()),
        ("030", 21.5, 14)
    );
    emit(
        &shell,
        "fits",
        "--bandpass rimo.fits[BANDPASS_F143],rimo.fits[bandpass_030] --unit uK_CMB",
    );
    let text: String = hfi
        .nu_ghz
        .iter()
        .zip(&hfi.weight)
        .map(|(nu, weight)| format!("{nu} {weight}\n"))
        .collect();
    shell.write("F143.txt", text.as_bytes());
    emit(&shell, "text", "--bandpass F143.txt --unit uK_CMB");
    assert_eq!(
        shell.read("fits/3d_F143_Q.f64"),
        shell.read("text/3d_F143_Q.f64")
    );
    assert!(shell.path("fits/3d_030_I.f64").exists());
    for (spec, part) in [
        ("rimo.fits", "BANDPASS_F143, BANDPASS_030"),
        ("rimo.fits[CHANNEL_PARAMETERS]", "holds no bandpass"),
        ("rimo.fits[BANDPASS_F217]", "no HDU BANDPASS_F217"),
    ] {
        let message = shell.fail(1, &["emit", "run", "--out", "x", "--bandpass", spec]);
        assert!(message.contains(part), "{spec}: {message}");
    }
    // Damage of every kind gives a sentence.
    let sound = shell.read("rimo.fits");
    let card = |from: &str, to: &str| {
        let at = sound.windows(from.len()).position(|w| w == from.as_bytes());
        let at = at.unwrap_or_else(|| panic!("{from}"));
        let mut bytes = sound.clone();
        bytes[at..at + to.len()].copy_from_slice(to.as_bytes());
        bytes
    };
    for (bytes, part) in [
        (card("'cm^-1   '", "'inch    '"), "inch"),
        (
            card(
                "NAXIS2  =                   28",
                "NAXIS2  =           9999999999",
            ),
            "NAXIS2",
        ),
        (sound[..4 * 2880 + 100].to_vec(), "cut short"),
        (card("'WAVENUMBER'", "'WAVELENGTH'"), "holds no bandpass"),
    ] {
        shell.write("bad.fits", &bytes);
        let spec = "bad.fits[BANDPASS_F143]";
        let message = shell.fail(1, &["emit", "run", "--out", "x", "--bandpass", spec]);
        assert!(
            message.contains(part) && message.contains("bad.fits"),
            "{message}"
        );
    }
}

#[test]
fn damaged_instrument_models_give_a_sentence() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/fits/rimo.fits");
    let sound = std::fs::read(path).expect("the file");
    let dir = tempfile::tempdir().expect("a directory");
    let spec = dir.path().join("x.fits[BANDPASS_030]");
    let mut random = Random(20_181_103);
    let mut below = |bound: usize| random.below(bound);
    let mut refused = 0;
    for _ in 0..1000 {
        let mut bytes = sound.clone();
        match below(3) {
            0 => bytes.truncate(below(sound.len())),
            1 => {
                let at = below(sound.len());
                bytes[at] ^= 1 << below(8);
            }
            _ => {
                for _ in 0..=below(3) {
                    let at = below(sound.len());
                    bytes[at] = b"0123456789 '-+.=/ENDTFXZ"[below(24)];
                }
            }
        }
        std::fs::write(dir.path().join("x.fits"), &bytes).expect("written");
        match Bandpass::read(&spec) {
            Ok((band, _)) => {
                assert!(band.nu_ghz.len() == band.weight.len() && !band.nu_ghz.is_empty());
                assert!(
                    band.nu_ghz
                        .iter()
                        .chain(&band.weight)
                        .all(|x| x.is_finite())
                );
            }
            Err(error) => {
                refused += 1;
                assert!(error.to_string().contains("x.fits"), "{error}");
            }
        }
    }
    assert!(refused > 300, "{refused}");
}

/// A row twice, as in the table of Planck at 857 GHz, is a step; the trapezoid rule over the rows as they stand is kept.
#[test]
fn steps_of_a_bandpass() {
    let rows = [[1.0, 0.5], [2.0, 1.0], [2.0, 3.0], [5.0, 2.0], [5.0, 0.0]];
    let text: String = rows.iter().map(|[nu, w]| format!("{nu} {w}\n")).collect();
    let band = Bandpass::parse(&text).expect("a bandpass");
    assert_eq!(band.nu_ghz, [1.0, 2.0, 5.0]);
    let trapezoid = |rows: &[[f64; 2]], f: fn(f64) -> f64| -> f64 {
        rows.windows(2)
            .map(|w| 0.5 * (w[1][0] - w[0][0]) * (w[0][1] * f(w[0][0]) + w[1][1] * f(w[1][0])))
            .sum()
    };
    let merged: Vec<[f64; 2]> = band
        .nu_ghz
        .iter()
        .zip(&band.weight)
        .map(|(&a, &b)| [a, b])
        .collect();
    for f in [|_| 1.0, |nu: f64| nu * nu, |nu: f64| 1.0 / nu] {
        assert!((trapezoid(&rows, f) - trapezoid(&merged, f)).abs() < 1e-15);
    }
}

/// E and B of a rotated sky: power per degree is what it was; a second rotation by healpy's angles leads back.
#[test]
fn coordinates_keep_the_power() {
    let shell = run();
    emit(&shell, "g", "--freq 353 --alm");
    for frame in ["C", "E"] {
        emit(&shell, frame, &format!("--freq 353 --alm --coord {frame}"));
        let manifest = shell.json(&format!("{frame}/manifest.json"));
        let name = if frame == "C" {
            "EQUATORIAL"
        } else {
            "ECLIPTIC"
        };
        assert_eq!(manifest["coordinates"], name);
        assert_eq!(manifest["lmax"], 16);
        for letter in ["T", "E", "B"] {
            let file = format!("3d_353GHz_{letter}.c128");
            let (a, b) = (
                shell.read_f64(&format!("g/{file}")),
                shell.read_f64(&format!("{frame}/{file}")),
            );
            assert_eq!(a.len(), 2 * 17 * 18 / 2);
            let power = |alm: &[f64], l: usize| -> f64 {
                (0..=l)
                    .map(|m| {
                        let i = 2 * (m * (33 - m) / 2 + l);
                        let weight = if m == 0 { 1.0 } else { 2.0 };
                        weight * (alm[i].powi(2) + alm[i + 1].powi(2))
                    })
                    .sum()
            };
            for l in 0..=16 {
                let (a, b) = (power(&a, l), power(&b, l));
                assert!((a - b).abs() <= 1e-12 * a, "{frame} {letter} {l}: {a} {b}");
            }
            assert!(a != b);
        }
        // Maps in the other frame say so, and are turned back on input.
        emit(
            &shell,
            &format!("{frame}-maps"),
            &format!("--freq 353 --coord {frame} --format fits"),
        );
        emit(
            &shell,
            &format!("{frame}-g"),
            "--freq 353 --lmax 16 --beam 0.0001 --format fits",
        );
        for letter in ["I_STOKES", "Q_STOKES", "U_STOKES"] {
            let read = |dir: &str| {
                let spec = format!("{dir}/3d_353GHz.fits[{letter}]");
                let map = MapSource::parse(shell.path(&spec)).expect("a name").read();
                map.expect("a map")
            };
            let (back, wanted) = (read(&format!("{frame}-maps")), read(&format!("{frame}-g")));
            assert!(back.notes.iter().any(|note| note.contains("rotated")));
            let bound = 1e-6 * rms(&wanted.values);
            for (a, b) in back.values.iter().zip(&wanted.values) {
                assert!((a - b).abs() < bound, "{frame} {letter}: {a} {b}");
            }
        }
    }
}

#[test]
fn beams_are_of_their_bands() {
    let shell = run();
    emit(&shell, "both", "--freq 95,353 --beam 0,1200");
    emit(&shell, "none", "--freq 95");
    emit(&shell, "wide", "--freq 353 --beam 1200");
    assert_eq!(
        shell.read("both/3d_95GHz_U.f64"),
        shell.read("none/3d_95GHz_U.f64")
    );
    assert_eq!(
        shell.read("both/3d_353GHz_U.f64"),
        shell.read("wide/3d_353GHz_U.f64")
    );
    let quantity = &shell.json("both/manifest.json")["files"][0]["quantity"];
    assert_eq!(quantity, "I of 353GHz, model 3d, beam of 1200 arcmin");
    // Coefficients of a smoothed map are those of the map times exp(−l(l + 1)σ²/2).
    emit(&shell, "a", "--freq 353 --alm");
    emit(&shell, "b", "--freq 353 --alm --beam 1200");
    let (a, b) = (
        shell.read_f64("a/3d_353GHz_E.c128"),
        shell.read_f64("b/3d_353GHz_E.c128"),
    );
    let sigma = 20.0_f64.to_radians() / (8.0 * 2.0_f64.ln()).sqrt();
    for l in 2..=16_u8 {
        let i = 2 * (16 + usize::from(l));
        let wanted = (-0.5 * f64::from(l) * f64::from(l + 1) * sigma * sigma).exp();
        assert!((b[i] / a[i] / wanted - 1.0).abs() < 1e-12, "{l}");
    }
}

#[test]
fn several_runs_have_their_seeds_in_names() {
    let shell = run();
    shell.succeed(&[
        "run",
        "sky.toml",
        "--out",
        "other",
        "--seed",
        "18446744073709551615",
        "--quiet",
    ]);
    shell.succeed(&[
        "emit", "run", "other", "--freq", "95", "--out", "maps", "--stokes", "I",
    ]);
    assert_eq!(
        names(&shell, "maps"),
        [
            "3d_95GHz_seed0001_I.f64",
            "3d_95GHz_seed18446744073709551615_I.f64"
        ]
    );
    emit(
        &shell,
        "one",
        "--freq 95 --seed-names --format fits --dtype f32",
    );
    assert_eq!(names(&shell, "one"), ["3d_95GHz_seed0001.fits"]);
    emit(&shell, "plain", "--freq 95");
    assert_eq!(
        shell.read("maps/3d_95GHz_seed0001_I.f64"),
        shell.read("plain/3d_95GHz_I.f64")
    );
    // A directory of runs stands for them.
    for seed in ["7", "8"] {
        let out = format!("many/seed000{seed}");
        shell.succeed(&["run", "sky.toml", "--out", &out, "--seed", seed, "--quiet"]);
    }
    shell.write("many/notes.txt", b"by hand");
    shell.succeed(&[
        "emit", "many", "--freq", "95", "--out", "all", "--stokes", "I",
    ]);
    assert_eq!(
        names(&shell, "all"),
        ["3d_95GHz_seed0007_I.f64", "3d_95GHz_seed0008_I.f64"]
    );
    let message = shell.fail(2, &["emit", "run", "run", "--freq", "95", "--out", "x"]);
    assert!(message.contains("seed 1"), "{message}");
}
