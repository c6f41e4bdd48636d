//! Planck function, modified blackbodies and bands against 50-digit arithmetic.

use dust3d_kernels::Error;
use dust3d_kernels::planck::bandpass::band_weights_into;
use dust3d_kernels::planck::mbb::{
    MbbLayer, MbbNode, mbb_add, mbb_add_iqu, mbb_add_stokes, mbb_add_uniform, mbb_intensity_into,
    mbb_layers_into,
};
use dust3d_kernels::planck::{planck_mjysr, spectrum};
use dust3d_kernels::simd::Level;
use dust3d_kernels::units::{NU0_GHZ, T_CMB, Unit};
use dust3d_tests::reference::{relative, rows};
use dust3d_tests::tolerance as tol;
use proptest::prelude::*;

type Slice = fn(Level, f64, &[f64], &mut [f64]) -> Result<(), Error>;

/// One value through a slice kernel, in the middle of others.
fn through(kernel: Slice, level: Level, nu: f64, t: f64) -> f64 {
    let mut out = [0.0; 11];
    kernel(level, nu, &[t; 11], &mut out).unwrap();
    assert!(out.iter().all(|x| x.to_bits() == out[0].to_bits()));
    out[10]
}

fn x_of(nu: f64, t: f64) -> f64 {
    0.047_992_430_733_662_21 * nu / t
}

#[test]
fn mp_vectors_planck() {
    let table = rows(include_str!("../data/planck/planck.txt"));
    let (mut scalar, mut scalar_derivative) = (0.0_f64, 0.0_f64);
    for level in Level::available() {
        let (mut value, mut derivative, mut portable) = (0.0_f64, 0.0_f64, 0.0_f64);
        for row in &table {
            let (nu, t) = (row[0], row[1]);
            let x = x_of(nu, t);
            let e = relative(through(spectrum::planck_into, level, nu, t), row[2], row[3]);
            value = value.max(e);
            portable = portable.max(e / (x / 3.0).max(1.0));
            derivative = derivative.max(relative(
                through(spectrum::planck_derivative_into, level, nu, t),
                row[4],
                row[5],
            ));
            scalar = scalar.max(relative(spectrum::planck_scalar(nu, t), row[2], row[3]));
            scalar_derivative = scalar_derivative.max(relative(
                spectrum::planck_derivative_scalar(nu, t),
                row[4],
                row[5],
            ));
        }
        println!("{level}: {value:.2e} {derivative:.2e} over max(1, x/3): {portable:.2e}");
        if level.name() == "portable" {
            tol::PLANCK_PORTABLE.hold(portable);
        } else {
            tol::PLANCK.hold(value);
            tol::DERIVATIVE.hold(derivative);
        }
    }
    println!("scalar: {scalar:.2e} {scalar_derivative:.2e}");
    tol::PLANCK_SCALAR.hold(scalar);
    tol::DERIVATIVE_SCALAR.hold(scalar_derivative);
}

#[test]
fn mp_vectors_ratio_and_mbb() {
    let table = rows(include_str!("../data/planck/ratio.txt"));
    let mut scalar = 0.0_f64;
    for level in Level::available() {
        let (mut ratio, mut law, mut intensity) = (0.0_f64, 0.0_f64, 0.0_f64);
        for row in &table {
            let [nu, nu0, t, beta] = [row[0], row[1], row[2], row[3]];
            let mut out = [0.0];
            spectrum::planck_ratio_into(level, nu, nu0, &[t], &mut out).unwrap();
            ratio = ratio.max(relative(out[0], row[4], row[5]));
            scalar = scalar.max(relative(
                spectrum::planck_ratio_scalar(nu, nu0, t),
                row[4],
                row[5],
            ));
            let node = MbbNode::new(nu, nu0, 1.0).unwrap();
            let mut out = [0.0];
            mbb_add(level, &node, &[1.0], &[t], &[beta], &mut out).unwrap();
            let terms = ((3.0 + beta) * (nu / nu0).ln()).abs() + x_of(nu0 - nu, t).abs();
            let scale = (terms / 4.0).max(1.0);
            law = law.max(relative(out[0], row[6], row[7]) / scale);
            // The same with the law's own normalisation.
            let brightness = spectrum::planck_scalar(nu0, t);
            if brightness > 1e-290 && x_of(nu, t) < 690.0 {
                mbb_intensity_into(level, nu, nu0, &[1.0 / brightness], &[t], &[beta], &mut out)
                    .unwrap();
                let terms = (beta * (nu / nu0).ln()).abs() + x_of(nu, t);
                let scale = (terms / 4.0).max(1.0);
                intensity = intensity.max(relative(out[0], row[6], row[7]) / scale);
            }
        }
        println!("{level}: {ratio:.2e} {law:.2e} {intensity:.2e}");
        if level.name() != "portable" {
            tol::RATIO.hold(ratio);
            tol::MBB.hold(law);
            tol::MBB_INTENSITY.hold(intensity);
        }
    }
    println!("scalar: {scalar:.2e}");
    tol::RATIO_SCALAR.hold(scalar);
}

#[test]
fn edges_planck() {
    let inf = f64::INFINITY;
    for level in Level::available() {
        for t in [0.0, -0.0, -5.0, inf, f64::NAN, -inf, -1.6375e30] {
            for kernel in [spectrum::planck_into, spectrum::planck_derivative_into] {
                assert!(through(kernel, level, 353.0, t).is_nan(), "{level} {t}");
            }
        }
        // e^−x underflows long before x overflows: zero, not NaN.
        for t in [1e-2, 1e-5, 1e-300, 5e-324] {
            assert_eq!(through(spectrum::planck_into, level, 3000.0, t), 0.0);
            assert_eq!(
                through(spectrum::planck_derivative_into, level, 3000.0, t),
                0.0
            );
        }
        // Just before the underflow both are subnormal and not zero.
        let t = x_of(3000.0, 1.0) / 750.0;
        let b = through(spectrum::planck_into, level, 3000.0, t);
        assert!(b > 0.0 && b < 1e-300);
        // The ratio is defined where both functions have vanished: x = 2000 and 2001.
        let (nu, nu0) = (2001.0, 2000.0);
        let t = x_of(nu0, 1.0) / 2000.0;
        let mut out = [0.0];
        spectrum::planck_ratio_into(level, nu, nu0, &[t], &mut out).unwrap();
        let expected = (2001.0_f64 / 2000.0).powi(3) * (-1.0_f64).exp();
        assert!((out[0] / expected - 1.0).abs() < 1e-12);
        assert_eq!(
            spectrum::planck_into(level, -1.0, &[1.0], &mut out),
            Err(Error::Domain {
                what: "frequency in GHz (1e-30 to 1e30)",
                value: -1.0
            })
        );
        assert!(spectrum::planck_into(level, f64::NAN, &[1.0], &mut out).is_err());
        assert!(matches!(
            spectrum::planck_into(level, 353.0, &[1.0; 3], &mut out),
            Err(Error::Length { .. })
        ));
    }
    for t in [0.0, -5.0, inf, f64::NAN] {
        assert!(spectrum::planck_scalar(353.0, t).is_nan());
        assert!(spectrum::planck_derivative_scalar(353.0, t).is_nan());
        assert!(spectrum::planck_ratio_scalar(353.0, 217.0, t).is_nan());
        assert!(planck_mjysr(353.0, t).is_err());
    }
    assert_eq!(spectrum::planck_scalar(3000.0, 1e-3), 0.0);
    assert_eq!(spectrum::planck_derivative_scalar(3000.0, 1e-300), 0.0);
    assert!(planck_mjysr(0.0, 20.0).is_err());
    assert_eq!(
        planck_mjysr(353.0, 19.4),
        Ok(spectrum::planck_scalar(353.0, 19.4))
    );
}

/// Templates and laws of `n` pixels that look like a layer.
fn layer(n: usize) -> ([Vec<f64>; 3], Vec<f64>, Vec<f64>) {
    let wave = |k: f64| move |p: usize| (p as f64 * k + k).sin();
    let map = |f: &dyn Fn(usize) -> f64| (0..n).map(f).collect::<Vec<_>>();
    (
        [
            map(&|p| (3.0 * wave(0.7)(p)).exp()),
            map(&|p| 0.1 * wave(0.3)(p)),
            map(&|p| 0.1 * wave(0.9)(p)),
        ],
        map(&|p| 19.4 + 3.0 * wave(1.3)(p)),
        map(&|p| 1.6 + 0.3 * wave(1.7)(p)),
    )
}

fn slices(maps: &[Vec<f64>; 3]) -> [&[f64]; 3] {
    [&maps[0], &maps[1], &maps[2]]
}

/// Any mixture of frequencies and bands in one pass is the sum over frequencies, one at a time.
#[test]
fn naive_lengths_iqu_bands() {
    let frequencies = [95.0, 143.0, 217.0, 353.0, 857.0, 2_997.924_58];
    let node = |k: usize, w: f64| MbbNode::new(frequencies[k], NU0_GHZ, w).unwrap();
    let first = [node(0, 0.25), node(1, 0.5), node(2, -0.125)];
    let (second, third) = ([node(3, 1.0)], [node(4, 2.0), node(5, 1e-3)]);
    let bands: [&[MbbNode]; 4] = [&first, &second, &[], &third];
    for level in Level::available() {
        for n in [0, 1, 7, 8, 9, 16, 31] {
            let (iqu, t, beta) = layer(n);
            let mut out = vec![vec![0.5; n]; 12];
            let mut views: Vec<&mut [f64]> = out.iter_mut().map(Vec::as_mut_slice).collect();
            mbb_add_iqu(level, &bands, slices(&iqu), &t, &beta, &mut views).unwrap();
            for (b, band) in bands.iter().enumerate() {
                for s in 0..3 {
                    for p in 0..n {
                        let law: f64 = band
                            .iter()
                            .map(|node| node.weight() * node.scaling_scalar(t[p], beta[p]))
                            .sum();
                        let expected = 0.5 + iqu[s][p] * law;
                        let got = out[3 * b + s][p];
                        assert!(
                            (got - expected).abs() <= 1e-14 * (1.0 + expected.abs()),
                            "{level} {n} {b} {s} {p}"
                        );
                    }
                }
            }
            // Same bits as one map at a time.
            for (b, band) in bands.iter().enumerate() {
                let mut single = vec![0.5; n];
                mbb_add_stokes(level, &[*band], [&iqu[1]], &t, &beta, &mut [&mut single]).unwrap();
                assert_eq!(single, out[3 * b + 1]);
            }
        }
    }
}

/// Layers at once are layers one after the other, bit for bit, from one to more than are held at a time, wherever the
/// maps begin; what was in the output does not matter.
#[test]
fn naive_layers_lengths_starts() {
    let node = |nu: f64, w: f64| MbbNode::new(nu, NU0_GHZ, w).unwrap();
    let (first, second) = ([node(143.0, 0.25), node(217.0, 0.5)], [node(857.0, 2.0)]);
    let all: [&[MbbNode]; 3] = [&first, &[], &second];
    let sky: Vec<_> = [3, 1, 4, 1, 5, 9, 2, 6, 5]
        .into_iter()
        .map(|k| {
            let (iqu, mut t, beta) = layer(200);
            t.iter_mut().for_each(|t| *t += 0.25 * f64::from(k));
            t[100] = if k == 9 { f64::NAN } else { t[100] };
            (iqu, t, beta)
        })
        .collect();
    for level in Level::available() {
        for bands in [&all[..], &all[..1], &all[1..2], &[]] {
            for count in [0, 1, 2, 8, 9] {
                for (start, end) in [(0, 200), (1, 200), (3, 8), (5, 70), (7, 107), (9, 9)] {
                    let n = end - start;
                    let layers: Vec<_> = sky[..count]
                        .iter()
                        .map(|(iqu, t, beta)| MbbLayer {
                            templates: slices(iqu).map(|map| &map[start..end]),
                            t: &t[start..end],
                            beta: &beta[start..end],
                        })
                        .collect();
                    let mut out = vec![vec![7.0; 200]; 3 * bands.len()];
                    let mut views: Vec<_> = out.iter_mut().map(|m| &mut m[start..end]).collect();
                    mbb_layers_into(level, bands, &layers, &mut views).unwrap();
                    let mut one_by_one = vec![vec![0.0; n]; 3 * bands.len()];
                    for layer in &layers {
                        for (k, band) in bands.iter().enumerate() {
                            for s in 0..3 {
                                mbb_add_stokes(
                                    level,
                                    &[*band],
                                    [layer.templates[s]],
                                    layer.t,
                                    layer.beta,
                                    &mut [&mut one_by_one[3 * k + s]],
                                )
                                .unwrap();
                            }
                        }
                    }
                    for (map, expected) in out.iter().zip(&one_by_one) {
                        let same = |(a, b): (&f64, &f64)| a == b || a.is_nan() && b.is_nan();
                        assert!(
                            map[start..end].iter().zip(expected).all(same),
                            "{level} {count} {start} {end}"
                        );
                        assert!(map[..start].iter().chain(&map[end..]).all(|x| *x == 7.0));
                    }
                }
            }
        }
    }
}

#[test]
fn levels_agree_mbb_layers() {
    let (iqu, t, beta) = layer(75);
    let layers = [MbbLayer {
        templates: slices(&iqu),
        t: &t,
        beta: &beta,
    }; 3];
    let nodes = [30.0, 143.0, 857.0].map(|nu| [MbbNode::new(nu, NU0_GHZ, 1.5).unwrap()]);
    let bands = nodes.each_ref().map(<[_; 1]>::as_slice);
    let fused = Level::available().filter(|level| level.name() != "portable");
    let results: Vec<_> = fused
        .map(|level| {
            let mut out = vec![vec![0.0; 75]; 9];
            let mut views: Vec<_> = out.iter_mut().map(Vec::as_mut_slice).collect();
            mbb_layers_into(level, &bands, &layers, &mut views).unwrap();
            out
        })
        .collect();
    assert!(results.windows(2).all(|pair| pair[0] == pair[1]));
}

#[test]
fn reference_frequency_is_exact() {
    let node = [MbbNode::new(NU0_GHZ, NU0_GHZ, 1.0).unwrap()];
    for level in Level::available() {
        let (iqu, mut t, beta) = layer(29);
        t[3] = 3.0;
        t[4] = 1e-3;
        t[5] = 1e12;
        let mut out = vec![vec![0.0; 29]; 3];
        let mut views: Vec<&mut [f64]> = out.iter_mut().map(Vec::as_mut_slice).collect();
        mbb_add_iqu(level, &[&node], slices(&iqu), &t, &beta, &mut views).unwrap();
        assert_eq!(out, iqu);
        let mut uniform = vec![0.0; 29];
        mbb_add_uniform(level, &[&node], [&iqu[2]], 19.4, 1.6, &mut [&mut uniform]).unwrap();
        assert_eq!(uniform, iqu[2]);
    }
}

#[test]
fn missing_inputs_give_nan() {
    for nu in [217.0, NU0_GHZ] {
        let node = MbbNode::new(nu, NU0_GHZ, 1.0).unwrap();
        for level in Level::available() {
            for p in [0, 6, 8] {
                for bad in [f64::NAN, 0.0, -1.6375e30, f64::INFINITY] {
                    let (iqu, mut t, beta) = layer(9);
                    t[p] = bad;
                    let mut out = vec![0.0; 9];
                    mbb_add(level, &node, &iqu[0], &t, &beta, &mut out).unwrap();
                    for (q, x) in out.iter().enumerate() {
                        assert_eq!(x.is_nan(), p == q, "{level} {nu} {p} {q}");
                    }
                }
                let (mut iqu, t, mut beta) = layer(9);
                iqu[1][p] = f64::NAN;
                let mut out = vec![vec![0.0; 9]; 3];
                let mut views: Vec<&mut [f64]> = out.iter_mut().map(Vec::as_mut_slice).collect();
                mbb_add_iqu(level, &[&[node]], slices(&iqu), &t, &beta, &mut views).unwrap();
                for (s, map) in out.iter().enumerate() {
                    for (q, x) in map.iter().enumerate() {
                        assert_eq!(x.is_nan(), s == 1 && p == q);
                    }
                }
                beta[p] = f64::NAN;
                let mut out = vec![0.0; 9];
                mbb_add(level, &node, &iqu[0], &t, &beta, &mut out).unwrap();
                assert!(out[p].is_nan());
            }
        }
    }
    assert!(
        MbbNode::new(217.0, NU0_GHZ, 1.0)
            .unwrap()
            .scaling_scalar(-1.0, 1.5)
            .is_nan()
    );
}

/// f32 storage is f64 arithmetic on the rounded values.
#[test]
fn single_precision_storage() {
    let node = [MbbNode::new(143.0, NU0_GHZ, 1.0).unwrap()];
    for level in Level::available() {
        for n in [0, 1, 7, 8, 9, 23] {
            let (iqu, t, beta) = layer(n);
            let single = |v: &Vec<f64>| v.iter().map(|&x| x as f32).collect::<Vec<_>>();
            let double = |v: &Vec<f32>| v.iter().map(|&x| f64::from(x)).collect::<Vec<_>>();
            let (i, t, beta) = (single(&iqu[0]), single(&t), single(&beta));
            let (mut a, mut b) = (vec![1.0; n], vec![1.0; n]);
            mbb_add_stokes(level, &[&node], [&i], &t, &beta, &mut [&mut a]).unwrap();
            mbb_add_stokes(
                level,
                &[&node],
                [&double(&i)],
                &double(&t),
                &double(&beta),
                &mut [&mut b],
            )
            .unwrap();
            assert_eq!(a, b);
        }
    }
}

#[test]
fn bad_arguments_are_errors() {
    let level = Level::portable();
    let node = MbbNode::new(143.0, NU0_GHZ, 1.0).unwrap();
    let other = MbbNode::new(143.0, 217.0, 1.0).unwrap();
    let (x, mut out) = ([1.0; 4], [0.0; 4]);
    for (lengths, outputs) in [
        ([3, 4, 4, 4], 1),
        ([4, 3, 4, 4], 1),
        ([4, 4, 3, 4], 1),
        ([4, 4, 4, 3], 1),
    ] {
        let [a, b, c, d] = lengths;
        assert!(
            matches!(
                mbb_add(level, &node, &x[..a], &x[..b], &x[..c], &mut out[..d]),
                Err(Error::Length { .. })
            ),
            "{lengths:?} {outputs}"
        );
    }
    assert!(mbb_add_stokes(level, &[&[node]], [&x], &x, &x, &mut []).is_err());
    assert!(mbb_add_stokes(level, &[&[node, other]], [&x], &x, &x, &mut [&mut out]).is_err());
    let layer = |n: usize| MbbLayer {
        templates: [&x[..n]],
        t: &x,
        beta: &x,
    };
    for (layers, outputs) in [([layer(4), layer(3)], 1), ([layer(4); 2], 0)] {
        let mut maps = [&mut out[..]];
        let views = &mut maps[..outputs];
        assert!(mbb_layers_into(level, &[&[node]], &layers, views).is_err());
    }
    assert!(mbb_layers_into(level, &[&[node, other]], &[layer(4)], &mut [&mut out]).is_err());
    assert!(mbb_add_uniform(level, &[&[node]], [&x[..3]], 20.0, 1.5, &mut [&mut out]).is_err());
    assert!(MbbNode::new(0.0, NU0_GHZ, 1.0).is_err());
    assert!(MbbNode::new(353.0, f64::INFINITY, 1.0).is_err());
    assert_eq!(out, [0.0; 4]);
}

#[test]
fn mp_vectors_bands() {
    let mut worst = 0.0_f64;
    for row in rows(include_str!("../data/planck/bands.txt")) {
        let n = row[0] as usize;
        let (nu, w) = (&row[1..=n], &row[n + 1..=2 * n]);
        let [t, beta] = [row[2 * n + 1], row[2 * n + 2]];
        for (unit, expected) in [Unit::MJySr, Unit::MicroKRj, Unit::MicroKCmb]
            .into_iter()
            .zip(&row[2 * n + 3..])
        {
            let mut a = vec![0.0; n];
            band_weights_into(unit, nu, w, &mut a).unwrap();
            let band: Vec<MbbNode> = nu
                .iter()
                .zip(&a)
                .map(|(&nu, &a)| MbbNode::new(nu, NU0_GHZ, a).unwrap())
                .collect();
            for level in Level::available() {
                let mut out = [0.0];
                mbb_add_stokes(level, &[&band], [&[1.0]], &[t], &[beta], &mut [&mut out]).unwrap();
                worst = worst.max(relative(out[0], *expected, 0.0));
            }
        }
    }
    println!("bands: {worst:.2e}");
    tol::BAND.hold(worst);
}

/// Bands computed by PySM3 itself (tests/data/planck/pysm3_bands.py).
#[test]
fn pysm3_bands_every_unit() {
    let table = rows(include_str!("../data/planck/pysm3.txt"));
    assert!(table.len() > 20);
    for row in table {
        let n = row[0] as usize;
        let (nu, w) = (&row[1..=n], &row[n + 1..=2 * n]);
        let [i, t, beta] = [row[2 * n + 1], row[2 * n + 2], row[2 * n + 3]];
        for (unit, expected) in [Unit::MicroKRj, Unit::MicroKCmb, Unit::MJySr]
            .into_iter()
            .zip(&row[2 * n + 4..])
        {
            let mut a = vec![0.0; n];
            band_weights_into(unit, nu, w, &mut a).unwrap();
            let band: Vec<MbbNode> = nu
                .iter()
                .zip(&a)
                .map(|(&nu, &a)| MbbNode::new(nu, NU0_GHZ, a).unwrap())
                .collect();
            let mut out = [0.0];
            mbb_add_stokes(
                Level::detect(),
                &[&band],
                [&[i]],
                &[t],
                &[beta],
                &mut [&mut out],
            )
            .unwrap();
            assert!(
                relative(out[0], *expected, 0.0) < 1e-10,
                "{unit} {out:?} {expected}"
            );
        }
    }
}

#[test]
fn bad_bands_are_errors() {
    let mut out = [0.0; 3];
    let mut band =
        |nu: &[f64], w: &[f64]| band_weights_into(Unit::MicroKCmb, nu, w, &mut out[..nu.len()]);
    assert!(band(&[], &[]).is_err());
    assert!(band(&[100.0, 101.0], &[1.0]).is_err());
    assert!(band(&[100.0, 100.0], &[1.0, 1.0]).is_err());
    assert!(band(&[101.0, 100.0], &[1.0, 1.0]).is_err());
    assert!(band(&[-1.0, 100.0], &[1.0, 1.0]).is_err());
    assert!(band(&[100.0, 101.0], &[1.0, f64::NAN]).is_err());
    assert!(band(&[100.0, 101.0], &[0.0, 0.0]).is_err());
    assert!(band(&[100.0, 101.0], &[1.0, -2.0]).is_err());
    assert!(band(&[100.0, 101.0, 103.0], &[0.0, 1.0, 0.0]).is_ok());
    assert!(band_weights_into(Unit::MJySr, &[1.0, 2.0], &[1.0; 2], &mut [0.0; 3]).is_err());
}

fn closure_level() -> impl Strategy<Value = Level> {
    prop::sample::select(Level::available().collect::<Vec<_>>())
}

proptest! {
    /// Fused levels give the same bits, the portable one the same to rounding; a unit is a factor; a band of one weight
    /// is a frequency; the sum of two layers is their sum.
    #[test]
    fn prop_emission(
        level in closure_level(),
        nu in 10.0..4000.0_f64,
        weight in 1e-3..1e3_f64,
        pixels in prop::collection::vec((-1e3..1e3_f64, 4.0..70.0_f64, 0.0..4.0_f64), 0..40),
    ) {
        let n = pixels.len();
        let column = |f: fn(&(f64, f64, f64)) -> f64| pixels.iter().map(f).collect::<Vec<_>>();
        let (amplitude, t, beta) = (column(|p| p.0), column(|p| p.1), column(|p| p.2));
        let node = |w: f64| MbbNode::new(nu, NU0_GHZ, w).unwrap();
        let run = |level: Level, band: &[MbbNode]| {
            let mut out = vec![0.0; n];
            mbb_add_stokes(level, &[band], [&amplitude], &t, &beta, &mut [&mut out]).unwrap();
            out
        };
        let one = run(level, &[node(1.0)]);
        for (p, x) in one.iter().enumerate() {
            let expected = amplitude[p] * node(1.0).scaling_scalar(t[p], beta[p]);
            prop_assert!((x - expected).abs() <= 1e-13 * expected.abs());
        }
        if let (Some(a), Some(b)) = (Level::by_name("avx2"), Level::by_name("avx512")) {
            prop_assert_eq!(run(a, &[node(weight)]), run(b, &[node(weight)]));
        }
        let split = run(level, &[node(weight), node(1.0 - weight)]);
        for (x, y) in split.iter().zip(&one) {
            prop_assert!((x - y).abs() <= 1e-15 * (2.0 * weight + 2.0) * 2.0 * y.abs());
        }
        let mut uniform = vec![0.0; n];
        if n > 0 {
            mbb_add_uniform(level, &[&[node(1.0)]], [&amplitude], t[0], beta[0], &mut [&mut uniform]).unwrap();
            prop_assert!((uniform[0] - one[0]).abs() <= 1e-13 * one[0].abs());
        }
    }

    /// B(ν, T) = (ν/ν₀)³ B(ν₀, T ν₀/ν): Wien's scaling, and growth with T.
    #[test]
    fn prop_planck_scaling(level in closure_level(), nu in 1.0..5000.0_f64, t in 2.0..100.0_f64) {
        let a = through(spectrum::planck_into, level, nu, t);
        let b = through(spectrum::planck_into, level, 353.0, t * 353.0 / nu);
        let x = x_of(nu, t);
        prop_assert!((a / (b * (nu / 353.0).powi(3)) - 1.0).abs() < 4e-16 * (8.0 + x));
        prop_assert!(a < through(spectrum::planck_into, level, nu, t * (1.0 + 1e-12)) || a == 0.0);
        // The derivative is the slope.
        let h = 1e-4 * t;
        let slope = (spectrum::planck_scalar(nu, t + h) - spectrum::planck_scalar(nu, t - h)) / (2.0 * h);
        let d = through(spectrum::planck_derivative_into, level, nu, t);
        prop_assert!((slope / d - 1.0).abs() < 1e-7 * (1.0 + x * x) || d < 1e-290);
        prop_assert!((through(spectrum::planck_derivative_into, level, nu, T_CMB) * 1e-6 * Unit::MicroKCmb.from_mjysr(nu).unwrap_or(0.0) - 1.0).abs() < 1e-13 || nu > 1500.0);
    }
}
