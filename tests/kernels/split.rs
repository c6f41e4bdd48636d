//! Residual sharing and the polarisation-fraction cap.

use dust3d_kernels::Error;
use dust3d_kernels::split::cap::Outcome;
use dust3d_kernels::split::residual::share;
use dust3d_kernels::split::{Counts, renormalise_into, renormalise_scratch_len};
use dust3d_tests::cap::{Pixel, after_passes, check, nearest, run};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

/// Pixels of one to eight layers like those of the sky, a good part of which need the cap.
fn ordinary() -> impl Strategy<Value = Pixel> {
    (1_usize..8).prop_flat_map(|n| {
        let intensity = prop::collection::vec((-6.0..3.0_f64).prop_map(f64::exp), n);
        let fraction = prop::collection::vec((0.0..0.2_f64, 0.0..6.3_f64), n);
        let observed = (0.0..1.2_f64, 0.0..6.3_f64);
        (intensity, fraction, observed).prop_map(|(intensity, fraction, (p, angle))| {
            let predicted = fraction
                .iter()
                .zip(&intensity)
                .map(|((p, a), i)| [p * i * a.cos(), p * i * a.sin()])
                .collect();
            let v = 0.25 * p * intensity.iter().sum::<f64>();
            Pixel {
                p_max: 0.25,
                intensity,
                predicted,
                observed: [v * angle.cos(), v * angle.sin()],
            }
        })
    })
}

/// Zero, or any sign and magnitude from 1e-300 to 1e300.
fn extreme() -> impl Strategy<Value = f64> {
    prop_oneof![
        1 => Just(0.0),
        4 => (-300.0..300.0_f64, any::<bool>()).prop_map(|(e, s)| if s { -(10_f64.powf(e)) } else { 10_f64.powf(e) }),
        4 => -1.0..1.0_f64,
    ]
}

fn extreme_pixel() -> impl Strategy<Value = Pixel> {
    (1_usize..7).prop_flat_map(|n| {
        let intensity = prop::collection::vec(extreme().prop_map(f64::abs), n);
        let predicted = prop::collection::vec([extreme(), extreme()], n);
        (
            intensity,
            predicted,
            [extreme(), extreme()],
            prop_oneof![Just(0.25), Just(0.0), 0.0..1.0_f64],
        )
            .prop_map(|(intensity, predicted, observed, p_max)| Pixel {
                p_max,
                intensity,
                predicted,
                observed,
            })
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn prop_cap_ordinary_invariants(pixel in ordinary()) {
        check(&pixel);
    }

    #[test]
    fn prop_cap_extreme_invariants(pixel in extreme_pixel()) {
        check(&pixel);
    }

    #[test]
    fn prop_cap_any_bits_no_nan(
        bits in prop::collection::vec(any::<f64>(), 3..18),
        p_max in any::<f64>(),
    ) {
        let (intensity, rest): (Vec<f64>, Vec<f64>) = (bits.chunks_exact(3).map(|c| c[0].abs()).collect(), bits);
        let predicted: Vec<[f64; 2]> = rest.chunks_exact(3).map(|c| [c[1], c[2]]).collect();
        let observed = [rest[1] * 0.5, rest[2] * 0.5];
        check(&Pixel { p_max, intensity, predicted, observed });
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn naive_random_cap_is_nearest(pixel in ordinary()) {
        let (outcome, v) = run(&pixel);
        if outcome == Outcome::Capped {
            let (u, w) = after_passes(&pixel);
            let expected = nearest(&pixel, &u, &w);
            let scale: f64 = pixel.intensity.iter().sum::<f64>() * pixel.p_max;
            for (v, e) in v.iter().zip(&expected) {
                for k in 0..2 {
                    prop_assert!((v[k] - e[k]).abs() <= 1e-10 * scale, "{v:?} for {e:?} in {pixel:?}");
                }
            }
        }
    }
}

/// Observations just below the limit, layers of one orientation, empty layers, predictions far above every cap.
#[test]
fn naive_hard_cap_is_nearest() {
    let mut runner = TestRunner::deterministic();
    for (tight, bound) in [(0.0, 1e-12), (1e-4, 1e-12), (1e-8, 1e-9)] {
        let mut capped = 0;
        for case in 0..150 {
            let mut pixel = ordinary().new_tree(&mut runner).unwrap().current();
            if pixel.intensity.len() < 2 {
                continue;
            }
            if case % 5 == 1 {
                pixel.intensity[0] = 0.0;
                pixel.predicted[0] = [0.0, 0.0];
            }
            if case % 5 == 2 {
                for v in &mut pixel.predicted {
                    *v = v.map(|x| 1000.0 * x);
                }
            }
            if case % 5 == 3 {
                for v in &mut pixel.predicted {
                    *v = [v[0].hypot(v[1]), 0.0];
                }
                pixel.observed[1] = 0.0;
            }
            let limit = 0.25 * pixel.intensity.iter().sum::<f64>();
            if tight > 0.0 {
                let now = pixel.observed[0].hypot(pixel.observed[1]);
                pixel.observed = pixel.observed.map(|x| x * limit * (1.0 - tight) / now);
            }
            check(&pixel);
            let (outcome, v) = run(&pixel);
            if outcome != Outcome::Capped {
                continue;
            }
            capped += 1;
            let (u, w) = after_passes(&pixel);
            let expected = nearest(&pixel, &u, &w);
            for (v, e) in v.iter().zip(&expected) {
                let error = (v[0] - e[0]).hypot(v[1] - e[1]);
                assert!(
                    error <= bound * limit,
                    "{error:e}: {v:?} for {e:?} in {pixel:?}"
                );
            }
        }
        assert!(capped > 50);
    }
}

/// By hand: sharing, the neighbour pass, the two rules for what cannot be shared.
#[test]
fn closed_form_pixels() {
    let pixel = |intensity: &[f64], predicted: &[f64], observed: f64| Pixel {
        p_max: 0.25,
        intensity: intensity.to_vec(),
        predicted: predicted.iter().map(|&q| [q, 0.0]).collect(),
        observed: [observed, 0.0],
    };
    let q = |p: &Pixel| {
        let (outcome, v) = run(p);
        assert!(v.iter().all(|v| v[1] == 0.0));
        (outcome, v.iter().map(|v| v[0]).collect::<Vec<_>>())
    };
    // F = (¾, ¼): −0.1 is shared as −0.075, −0.025.
    let (outcome, v) = q(&pixel(&[4.0, 4.0], &[0.6, 0.2], 0.7));
    assert_eq!(outcome, Outcome::Kept);
    assert!((v[0] - 0.525).abs() < 1e-15 && (v[1] - 0.175).abs() < 1e-15);
    // Nothing predicted: in proportion to the intensity, nothing to the empty layer.
    assert_eq!(
        q(&pixel(&[4.0, 0.0, 12.0], &[0.0; 3], 1.0)),
        (Outcome::Kept, vec![0.25, 0.0, 0.75])
    );
    // The middle layer is 0.5 above its cap: a quarter to each neighbour.
    assert_eq!(
        q(&pixel(&[4.0, 4.0, 4.0], &[0.5, 1.5, 0.5], 2.5)),
        (Outcome::Capped, vec![0.75, 1.0, 0.75])
    );
    // At an end all goes to the only neighbour.
    assert_eq!(
        q(&pixel(&[4.0, 8.0, 4.0], &[1.5, 0.5, 0.5], 2.5)),
        (Outcome::Capped, vec![1.0, 1.0, 0.5])
    );
    // Too much for all: in proportion to the intensity, above the caps.
    assert_eq!(
        q(&pixel(&[4.0, 12.0], &[0.1, 0.1], 8.0)),
        (Outcome::Infeasible, vec![2.0, 6.0])
    );
    // No intensity at all: equal parts.
    assert_eq!(
        q(&pixel(&[0.0, 0.0], &[0.0, 0.0], 1.0)),
        (Outcome::Infeasible, vec![0.5, 0.5])
    );
    assert_eq!(
        q(&pixel(&[0.0, 0.0], &[0.0, 0.0], 0.0)),
        (Outcome::Kept, vec![0.0, 0.0])
    );
    // One layer.
    assert_eq!(
        q(&pixel(&[4.0], &[0.25], 0.75)),
        (Outcome::Kept, vec![0.75])
    );
    assert_eq!(
        q(&pixel(&[4.0], &[0.3], 1.1)),
        (Outcome::Infeasible, vec![1.1])
    );
}

/// A dark layer with a strong prediction between bright ones: passes converge slowly and the dual decides.
#[test]
fn prop_passes_alone_are_not_enough() {
    let pixel = Pixel {
        p_max: 0.25,
        intensity: vec![10.0, 0.1, 0.1, 0.1, 0.1, 0.1],
        predicted: vec![
            [0.0, 0.0],
            [0.0, 0.0],
            [0.0, 0.0],
            [0.0, 0.0],
            [0.0, 0.0],
            [0.5, 0.3],
        ],
        observed: [1.5, 1.0],
    };
    let (u, _) = after_passes(&pixel);
    let above = |v: &[[f64; 2]]| {
        v.iter()
            .zip(&pixel.intensity)
            .any(|(v, i)| v[0].hypot(v[1]) > 0.25 * i * (1.0 + 1e-9))
    };
    assert!(above(&u));
    let (outcome, v) = run(&pixel);
    assert_eq!(outcome, Outcome::Capped);
    assert!(!above(&v));
    check(&pixel);
}

#[test]
fn naive_share() {
    let (mut q, mut u, mut f) = ([1.0, 2.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]);
    share(&[1.0, 1.0, 1.0], &mut q, &mut u, [7.0, 5.0], &mut f);
    assert_eq!(f, [0.25, 0.5, 0.25]);
    assert_eq!((q, u), ([2.0, 4.0, 1.0], [1.0, 2.0, 2.0]));
    // A layer without intensity gets no share, whatever its prediction.
    let (mut q, mut u, mut f) = ([1.0, 1.0], [0.0, 0.0], [0.0; 2]);
    share(&[0.0, 1.0], &mut q, &mut u, [5.0, 0.0], &mut f);
    assert_eq!((q, f), ([1.0, 4.0], [0.0, 1.0]));
    // Sums of extreme numbers neither overflow nor vanish.
    for size in [1e300, 1e-300] {
        let (mut q, mut u, mut f) = ([size, size, size], [0.0; 3], [0.0; 3]);
        share(&[size; 3], &mut q, &mut u, [0.0, 0.0], &mut f);
        assert_eq!((f, q), ([1.0 / 3.0; 3], [0.0; 3]));
    }
}

type Sky = (Vec<Vec<f64>>, Vec<Vec<f64>>, [Vec<f64>; 2]);

/// Maps of three layers: intensity, prediction (Q of all, then U of all), observation.
fn sky(n: usize) -> Sky {
    let mut runner = TestRunner::deterministic();
    let mut maps = (
        vec![vec![0.0; n]; 3],
        vec![vec![0.0; n]; 6],
        [vec![0.0; n], vec![0.0; n]],
    );
    let three = ordinary().prop_filter("three layers", |p| p.intensity.len() == 3);
    for p in 0..n {
        let pixel = three.new_tree(&mut runner).unwrap().current();
        for l in 0..3 {
            maps.0[l][p] = pixel.intensity[l];
            maps.1[l][p] = pixel.predicted[l][0];
            maps.1[3 + l][p] = pixel.predicted[l][1];
        }
        for k in 0..2 {
            maps.2[k][p] = pixel.observed[k];
        }
    }
    maps
}

fn renormalise(
    (intensity, predicted, observed): &Sky,
    range: std::ops::Range<usize>,
) -> (Counts, Vec<Vec<f64>>) {
    let intensity: Vec<&[f64]> = intensity.iter().map(|m| &m[range.clone()]).collect();
    let mut maps: Vec<Vec<f64>> = predicted
        .iter()
        .map(|m| m[range.clone()].to_vec())
        .collect();
    let mut slices: Vec<&mut [f64]> = maps.iter_mut().map(|m| &mut m[..]).collect();
    let (q, u) = slices.split_at_mut(3);
    let mut scratch = vec![f64::NAN; renormalise_scratch_len(3)];
    let [q_obs, u_obs] = observed;
    let counts = renormalise_into(
        0.25,
        &intensity,
        &q_obs[range.clone()],
        &u_obs[range],
        q,
        u,
        &mut scratch,
    )
    .unwrap();
    (counts, maps)
}

#[test]
fn prop_maps_are_their_pixels() {
    let mut maps = sky(200);
    maps.2[0][17] = f64::NAN;
    maps.0[1][18] = f64::INFINITY;
    let (counts, all) = renormalise(&maps, 0..200);
    let mut expected = Counts::default();
    for p in 0..200 {
        let pixel = Pixel {
            p_max: 0.25,
            intensity: (0..3).map(|l| maps.0[l][p]).collect(),
            predicted: (0..3).map(|l| [maps.1[l][p], maps.1[3 + l][p]]).collect(),
            observed: [maps.2[0][p], maps.2[1][p]],
        };
        check(&pixel);
        let (outcome, v) = run(&pixel);
        match outcome {
            Outcome::Kept => {}
            Outcome::Capped => expected.capped += 1,
            Outcome::Infeasible => expected.infeasible += 1,
            Outcome::Missing => expected.missing += 1,
        }
        for (l, v) in v.iter().enumerate() {
            for (k, v) in v.iter().enumerate() {
                assert_eq!(all[3 * k + l][p].to_bits(), v.to_bits());
            }
        }
    }
    assert_eq!(counts, expected);
    assert!(counts.capped > 10 && counts.infeasible > 5 && counts.missing == 2);
    // Ranges of pixels give the same bits and add up to the same counts.
    let mut sum = Counts::default();
    for range in [0..1, 1..64, 64..200, 200..200] {
        let (part, some) = renormalise(&maps, range.clone());
        sum += part;
        for (some, all) in some.iter().zip(&all) {
            assert!(
                some.iter()
                    .zip(&all[range.clone()])
                    .all(|(a, b)| a.to_bits() == b.to_bits())
            );
        }
    }
    assert_eq!(sum, counts);
}

#[test]
fn errors_lengths_and_domain() {
    let run = |p_max: f64, layers: usize, q_layers: usize, pixels: usize, scratch: usize| {
        let one = vec![1.0; 2];
        let intensity: Vec<&[f64]> = vec![&one; layers];
        let mut maps = vec![vec![0.5; pixels]; 2 * q_layers];
        let mut slices: Vec<&mut [f64]> = maps.iter_mut().map(|m| &mut m[..]).collect();
        let (q, u) = slices.split_at_mut(q_layers);
        renormalise_into(p_max, &intensity, &one, &one, q, u, &mut vec![0.0; scratch])
    };
    let need = renormalise_scratch_len(2);
    let length = |what, expected, got| {
        Err(Error::Length {
            what,
            expected,
            got,
        })
    };
    assert!(run(0.25, 2, 2, 2, need).is_ok());
    assert_eq!(run(0.25, 0, 0, 2, need), length("intensity (layers)", 1, 0));
    assert_eq!(run(0.25, 2, 1, 2, need), length("q (layers)", 2, 1));
    assert_eq!(run(0.25, 2, 2, 3, need), length("a layer of q or u", 2, 3));
    assert_eq!(
        run(0.25, 2, 2, 2, need - 1),
        length("scratch", need, need - 1)
    );
    for p_max in [-0.1, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            run(p_max, 2, 2, 2, need),
            Err(Error::Domain { .. })
        ));
    }
}
