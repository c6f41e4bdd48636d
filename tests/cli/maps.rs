//! The tools on maps.

use crate::properties::assert_raw_map;
use crate::shell::Shell;
use dust3d::config::Dtype;
use dust3d::kernels::healpix::missing::MISSING;
use dust3d_tests::random::Random;
use proptest::prelude::*;
use std::f64::consts::PI;

#[test]
fn info_tells_what_a_map_is() {
    let shell = Shell::new();
    let mut values = vec![2.0; 48];
    values[3] = f64::NAN;
    values[4] = -1.0;
    shell.write_f64("a.f64", &values);
    let text = shell.succeed(&["map", "info", "a.f64"]);
    for part in [
        "nside    2 (48 pixels",
        "missing  1\n",
        "min      -1e0",
        "max      2e0",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn convert_changes_type_and_order() {
    let shell = Shell::new();
    let values: Vec<f64> = (0..192).map(f64::from).collect();
    shell.write_f64("a.f64", &values);
    shell.succeed(&["map", "convert", "a.f64", "--out", "b.f32"]);
    assert_eq!(shell.read("b.f32").len(), 192 * 4);
    shell.succeed(&["map", "convert", "b.f32", "--out", "c.f64"]);
    assert_eq!(shell.read("a.f64"), shell.read("c.f64"));
    shell.succeed(&["map", "convert", "a.f64", "--to-nested", "--out", "n.f64"]);
    let nested = shell.read_f64("n.f64");
    // Nside 4: the first pixels of the first face, healpy.nest2ring(4, [0, 1, 2, 3, 15]).
    assert_eq!(
        [nested[0], nested[1], nested[2], nested[3], nested[15]],
        [74.0, 58.0, 57.0, 42.0, 0.0]
    );
    shell.succeed(&["map", "convert", "n.f64", "--from-nested", "--out", "r.f64"]);
    assert_eq!(shell.read("a.f64"), shell.read("r.f64"));
    shell.fail(2, &["map", "convert", "a.f64", "--out", "a.txt"]);
}

#[test]
fn missing_pixels_are_written_as_unseen() {
    let shell = Shell::new();
    let mut values = vec![1.0; 48];
    values[7] = f64::NAN;
    values[8] = f64::from(MISSING as f32);
    shell.write_f64("a.f64", &values);
    shell.succeed(&["map", "convert", "a.f64", "--out", "b.f64"]);
    let converted = shell.read_f64("b.f64");
    assert_eq!(
        [converted[6], converted[7], converted[8]],
        [1.0, MISSING, MISSING]
    );
}

#[test]
fn degrade_averages_what_is_there() {
    let shell = Shell::new();
    let mut values = vec![3.0; 48];
    // The four pixels at the north pole of Nside 2 lie in the first four faces, one each.
    values[0] = 11.0;
    values[1] = f64::NAN;
    shell.write_f64("a.f64", &values);
    shell.succeed(&["map", "degrade", "a.f64", "--nside", "1", "--out", "b.f64"]);
    let coarse = shell.read_f64("b.f64");
    assert_eq!(coarse.len(), 12);
    assert_eq!((coarse[0], coarse[1], coarse[2]), (5.0, 3.0, 3.0));
    let message = shell.fail(
        2,
        &["map", "degrade", "a.f64", "--nside", "4", "--out", "c.f64"],
    );
    assert!(
        message.contains("--nside 4") && message.contains("analyse"),
        "{message}"
    );
    shell.fail(
        2,
        &["map", "degrade", "a.f64", "--nside", "0", "--out", "c.f64"],
    );
}

#[test]
fn diff_measures_and_judges() {
    let shell = Shell::new();
    let a: Vec<f64> = (0..48).map(|p| f64::from(p) / 10.0).collect();
    let mut b = a.clone();
    b[20] += 0.5;
    shell.write_f64("a.f64", &a);
    shell.write_f64("b.f64", &b);
    let text = shell.succeed(&["map", "diff", "a.f64", "b.f64", "--out", "d.f64"]);
    assert!(
        text.contains("largest |A - B|     5e-1 (pixel 20)"),
        "{text}"
    );
    let difference = shell.read_f64("d.f64");
    assert_eq!((difference[19], difference[20]), (0.0, a[20] - b[20]));
    shell.succeed(&["map", "diff", "a.f64", "a.f64", "--tolerance", "0"]);
    shell.fail(1, &["map", "diff", "a.f64", "b.f64", "--tolerance", "1e-3"]);
    shell.write_f64("c.f64", &[0.0; 12]);
    let message = shell.fail(1, &["map", "diff", "a.f64", "c.f64"]);
    assert!(
        message.contains("Nside 2") && message.contains("has 1"),
        "{message}"
    );
}

/// a_lm of a few degrees, in healpy's order.
fn coefficients(lmax: usize, seed: u64) -> Vec<[f64; 2]> {
    let mut random = Random(seed);
    let mut alm = Vec::new();
    for m in 0..=lmax {
        for l in m..=lmax {
            let (re, im) = (0.5 * random.next(), 0.5 * random.next());
            alm.push(if l < 2 {
                [0.0; 2]
            } else {
                [re, if m == 0 { 0.0 } else { im }]
            });
        }
    }
    alm
}

fn write_alm(shell: &Shell, name: &str, alm: &[[f64; 2]]) {
    shell.write_f64(name, &alm.concat());
}

#[test]
fn synthesise_then_analyse_returns_the_coefficients() {
    let shell = Shell::new();
    let lmax = 31;
    for (seed, name) in [(1, "T"), (2, "E"), (3, "B")] {
        write_alm(
            &shell,
            &format!("alm/{name}.c128"),
            &coefficients(lmax, seed),
        );
    }
    shell.succeed(&["map", "synthesise", "alm", "--nside", "16", "--out", "maps"]);
    let args = [
        "map",
        "analyse",
        "maps/I.f64",
        "maps/Q.f64",
        "maps/U.f64",
        "--lmax",
        "31",
        "--iter",
        "3",
        "--out",
        "back",
    ];
    shell.succeed(&args);
    for name in ["T", "E", "B"] {
        let (before, after) = (
            shell.read_f64(&format!("alm/{name}.c128")),
            shell.read_f64(&format!("back/{name}.c128")),
        );
        assert_eq!(before.len(), after.len());
        let error: f64 = before
            .iter()
            .zip(&after)
            .map(|(a, b)| (a - b).powi(2))
            .sum();
        let power: f64 = before.iter().map(|a| a * a).sum();
        assert!(
            (error / power).sqrt() < 3e-5,
            "{name}: {}",
            (error / power).sqrt()
        );
    }
    let manifest = shell.json("back/manifest.json");
    assert_eq!(
        (&manifest["command"], &manifest["lmax"]),
        (&"map analyse".into(), &31.into())
    );
}

#[test]
fn spectrum_is_that_of_the_coefficients() {
    let shell = Shell::new();
    let lmax = 20;
    let alm = coefficients(lmax, 5);
    write_alm(&shell, "alm/T.c128", &alm);
    shell.succeed(&["map", "synthesise", "alm", "--nside", "16", "--out", "maps"]);
    let text = shell.succeed(&["map", "spectrum", "maps/I.f64", "--lmax", "20"]);
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("l,TT"));
    for (l, line) in lines.enumerate() {
        let (number, value) = line.split_once(',').expect("two columns");
        assert_eq!(number, l.to_string());
        let power: f64 = (0..=l)
            .map(|m| {
                let [re, im] = alm[m * (2 * lmax + 1 - m) / 2 + l];
                (re * re + im * im) * if m == 0 { 1.0 } else { 2.0 }
            })
            .sum();
        let expected = power / (2 * l + 1) as f64;
        let value: f64 = value.parse().expect("a number");
        assert!(
            (value - expected).abs() <= 1e-5 * expected + 1e-12,
            "l = {l}: {value} {expected}"
        );
    }
    // A constant is all monopole: C_0 = 4π.
    shell.write_f64("one.f64", &[1.0; 768]);
    let text = shell.succeed(&[
        "map", "spectrum", "one.f64", "one.f64", "one.f64", "--lmax", "4",
    ]);
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("l,TT,EE,BB,TE,EB,TB"));
    let first: Vec<f64> = lines
        .next()
        .expect("l = 0")
        .split(',')
        .map(|x| x.parse().expect("a number"))
        .collect();
    assert!((first[1] - 4.0 * PI).abs() < 1e-6, "{first:?}");
}

#[test]
fn transforms_refuse_what_they_cannot_do() {
    let shell = Shell::new();
    shell.write_f64("a.f64", &[1.0; 48]);
    shell.write_f64("b.f64", &[1.0; 12]);
    for (status, args, part) in [
        (
            2,
            &["map", "analyse", "a.f64", "--lmax", "9", "--out", "x"][..],
            "4 Nside = 8",
        ),
        (
            2,
            &["map", "analyse", "a.f64", "a.f64", "--out", "x"],
            "one (I) or three",
        ),
        (
            1,
            &["map", "analyse", "a.f64", "b.f64", "a.f64", "--out", "x"],
            "Nside 2",
        ),
        (
            1,
            &["map", "synthesise", "nowhere", "--nside", "2", "--out", "x"],
            "neither T.c128",
        ),
        (
            2,
            &["map", "synthesise", "nowhere", "--nside", "3", "--out", "x"],
            "power of two",
        ),
    ] {
        let message = shell.fail(status, args);
        assert!(message.contains(part), "{part}: {message}");
    }
    shell.write("alm/T.c128", &[0; 16 * 5]);
    let message = shell.fail(
        1,
        &["map", "synthesise", "alm", "--nside", "2", "--out", "x"],
    );
    assert!(
        message.contains("T.c128") && message.contains("80 bytes"),
        "{message}"
    );
    write_alm(&shell, "alm/T.c128", &coefficients(20, 1));
    let message = shell.fail(
        2,
        &["map", "synthesise", "alm", "--nside", "2", "--out", "x"],
    );
    assert!(message.contains("--nside 8"), "{message}");
    write_alm(&shell, "alm/E.c128", &coefficients(4, 1));
    let message = shell.fail(
        1,
        &["map", "synthesise", "alm", "--nside", "8", "--out", "x"],
    );
    assert!(message.contains("one of E.c128 and B.c128"), "{message}");
}

proptest! {
    #[test]
    fn prop_random_raw_map(bytes in proptest::collection::vec(any::<u8>(), 0..800), nside in 0_usize..=2) {
        for dtype in [Dtype::F32, Dtype::F64] {
            assert_raw_map(&bytes, dtype);
            let whole: Vec<u8> = bytes.iter().copied().cycle().take(12 * nside * nside * dtype.size()).collect();
            assert_raw_map(&whole, dtype);
        }
    }
}

#[test]
fn prop_edges_raw_map() {
    for value in [
        f64::NAN,
        MISSING,
        1.000_009 * MISSING,
        1.000_02 * MISSING,
        f64::MAX,
        -0.0,
        5e-324,
        f64::INFINITY,
    ] {
        assert_raw_map(&[value.to_le_bytes(); 12].concat(), Dtype::F64);
        assert_raw_map(&[(value as f32).to_le_bytes(); 12].concat(), Dtype::F32);
    }
}
