//! Residual sharing and the polarisation-fraction cap.

use dust3d_kernels::Error;
use dust3d_kernels::split::cap::Outcome;
use dust3d_kernels::split::residual::share;
use dust3d_kernels::split::{Counts, renormalise_into, renormalise_scratch_len};
use dust3d_tests::cap::{Pixel, after_passes, check, nearest, run};
use proptest::prelude::*;

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

#[test]
fn scout() {
    let mut seed = 7u64;
    let mut rnd = || { seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407); (seed >> 11) as f64 / 9007199254740992.0 };
    for case in 0..7 {
        let mut worst = (0.0, None);
        let (mut capped, mut proportional) = (0, 0);
        for _ in 0..400 {
            let n = 2 + (rnd() * 7.0) as usize;
            let intensity: Vec<f64> = (0..n).map(|_| if case == 4 && rnd() < 0.4 { 0.0 } else { (8.0 * rnd() - 5.0).exp() }).collect();
            let a0 = 6.3 * rnd();
            let predicted: Vec<[f64; 2]> = intensity.iter().map(|i| {
                let p = 0.2 * rnd() * i * if case == 5 { 1000.0 } else { 1.0 };
                let a = if case == 3 { a0 } else { 6.3 * rnd() };
                [p * a.cos(), p * a.sin()]
            }).collect();
            let sum: f64 = intensity.iter().sum();
            let tight = match case { 0 => rnd(), 1 => 1.0 - 10f64.powf(-2.0 - 6.0 * rnd()), 2 => 1.0 - 10f64.powf(-8.0 - 8.0 * rnd()), 3 => rnd(), 6 => 1e-3 * rnd(), _ => rnd() };
            let a = if case == 3 { a0 } else { 6.3 * rnd() };
            let v = 0.25 * sum * tight;
            let pixel = Pixel { p_max: 0.25, intensity, predicted, observed: [v * a.cos(), v * a.sin()] };
            check(&pixel);
            let (outcome, v) = run(&pixel);
            if outcome != Outcome::Capped { continue; }
            capped += 1;
            let prop = v.iter().zip(&pixel.intensity).all(|(v, i)| *v == [pixel.observed[0] * (i / sum), pixel.observed[1] * (i / sum)]);
            if prop { proportional += 1; }
            let (u, w) = after_passes(&pixel);
            let e = nearest(&pixel, &u, &w);
            let err = v.iter().zip(&e).map(|(v, e)| (v[0] - e[0]).hypot(v[1] - e[1])).fold(0.0, f64::max) / (0.25 * sum);
            if err > worst.0 { worst = (err, Some((pixel, v, e))); }
        }
        println!("case {case}: capped {capped} proportional {proportional} worst {:e}", worst.0);
        if worst.0 > 1e-10 { println!("{:?}", worst.1); }
    }
}
