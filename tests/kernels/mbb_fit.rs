//! The modified-blackbody fit: noise-free data, a general least-squares program, bounds, missing data.

use dust3d_kernels::Error;
use dust3d_kernels::fit::mbb::{
    DEFAULT_NU_GHZ, DEFAULT_SIGMA, FitCounts, FitStatus, MbbFit, fit_into,
};
use dust3d_kernels::simd::Level;
use dust3d_tests::mbb_fit::{check, intensity, profile, run};
use dust3d_tests::reference::rows;
use dust3d_tests::tolerance as tol;
use proptest::prelude::*;

/// Data of a law at the frequencies of a fit.
fn data(fit: &MbbFit, tau: f64, t: f64, beta: f64) -> Vec<f64> {
    fit.frequencies()
        .iter()
        .map(|&nu| intensity(nu, tau, t, beta))
        .collect()
}

/// Pixels to maps.
fn transpose(pixels: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = pixels.first().map_or(0, Vec::len);
    (0..n)
        .map(|f| pixels.iter().map(|p| p[f]).collect())
        .collect()
}

#[test]
fn closed_grid_noise_free() {
    let fits = [
        MbbFit::default(),
        MbbFit::new(&DEFAULT_NU_GHZ[1..], &DEFAULT_SIGMA[1..]).unwrap(),
        MbbFit::new(
            &[2997.924_58, 100.0, 353.0, 217.0, 857.0, 545.0, 1249.0],
            &[0.05; 7],
        )
        .unwrap(),
    ];
    for fit in &fits {
        let mut pixels = vec![];
        let mut truth = vec![];
        for i in 0..=110 {
            for j in 0..=40 {
                let (t, beta) = (5.0 + 0.5 * f64::from(i), 0.1 * f64::from(j));
                let tau = 10.0_f64.powi(i % 9 - 8);
                pixels.push(data(fit, tau, t, beta));
                truth.push((tau, t, beta));
            }
        }
        let maps = transpose(&pixels);
        let maps: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
        for level in Level::available() {
            let ([tau, t, beta, chi2], counts) = run(fit, level, &maps);
            assert_eq!(counts.fitted, truth.len() as u64, "{level} {counts:?}");
            let mut worst = 0.0_f64;
            for (p, truth) in truth.iter().enumerate() {
                worst = worst
                    .max((tau[p] / truth.0 - 1.0).abs())
                    .max((t[p] / truth.1 - 1.0).abs())
                    .max((beta[p] - truth.2).abs());
                assert!(chi2[p] < 1e-18);
            }
            println!(
                "{level}, {} frequencies: {worst:.2e}",
                fit.frequencies().len()
            );
            tol::MBB_FIT_EXACT.hold(worst);
        }
    }
}

#[test]
fn scipy_vectors_inside_and_on_bounds() {
    let mut worst = 0.0_f64;
    let (mut bounds, mut poor) = (0, 0);
    for row in rows(include_str!("../data/mbb_fit/fits.txt")) {
        let n = row[0] as usize;
        let fit = MbbFit::new(&row[1..=n], &row[n + 1..=2 * n]).unwrap();
        let i = &row[2 * n + 1..=3 * n];
        let [tau, t, beta, chi2] = [
            row[3 * n + 1],
            row[3 * n + 2],
            row[3 * n + 3],
            row[3 * n + 4],
        ];
        let got = check(&fit, i);
        assert!(
            (got.chi2 - chi2).abs() < 1e-6 * (1.0 + chi2),
            "{row:?} {got:?}"
        );
        if chi2 > 50.0 {
            assert_eq!(got.status, FitStatus::PoorFit);
            poor += 1;
            continue;
        }
        assert_eq!(got.status, FitStatus::Fitted, "{row:?} {got:?}");
        let e = (got.tau / tau - 1.0)
            .abs()
            .max((got.t_kelvin / t - 1.0).abs())
            .max((got.beta - beta).abs());
        assert!(e < 1e-6, "{row:?} {got:?}");
        worst = worst.max(e);
        bounds += u32::from(t == 5.0 || t == 60.0 || beta == 0.0 || beta == 4.0);
    }
    println!("scipy: {worst:.2e}, {bounds} on bounds, {poor} poor");
    assert!(bounds > 100);
    tol::MBB_FIT.hold(worst);
}

#[test]
fn lengths_missing_and_statuses() {
    let fit = MbbFit::default();
    for level in Level::available() {
        for n in [0, 1, 7, 8, 9, 17] {
            let mut pixels: Vec<Vec<f64>> = (0..n)
                .map(|p| data(&fit, 1e-5, 15.0 + p as f64, 1.6))
                .collect();
            let bad = [f64::NAN, 0.0, -1.0, -1.6375e30, f64::INFINITY];
            let mut missing = 0;
            for (k, &bad) in bad.iter().enumerate() {
                if let Some(pixel) = pixels.get_mut(3 * k) {
                    pixel[k % 4] = bad;
                    missing += 1;
                }
            }
            let mut poor = 0;
            if let Some(pixel) = pixels.get_mut(5) {
                pixel[1] *= 3.0;
                pixel[2] *= 0.3;
                poor = 1;
            }
            let maps = transpose(&pixels);
            let maps: Vec<&[f64]> = if n == 0 {
                vec![&[]; 4]
            } else {
                maps.iter().map(Vec::as_slice).collect()
            };
            let ([tau, t, beta, chi2], counts) = run(&fit, level, &maps);
            let expected = FitCounts {
                fitted: n as u64 - missing - poor,
                missing,
                unconverged: 0,
                poor,
            };
            assert_eq!(counts, expected, "{level} {n}");
            for p in 0..n {
                let gone = p % 3 == 0 && p < 15;
                let none = gone || p == 5;
                assert_eq!(tau[p].is_nan(), none);
                assert_eq!(t[p].is_nan(), none);
                assert_eq!(beta[p].is_nan(), none);
                assert_eq!(chi2[p].is_nan(), gone);
                if !none {
                    assert!((t[p] / (15.0 + p as f64) - 1.0).abs() < 1e-8);
                }
            }
            let mut same = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
            let [a, b, c] = &mut same;
            assert_eq!(fit_into(level, &fit, &maps, a, b, c, None), Ok(expected));
            assert!(
                a.iter()
                    .zip(&tau)
                    .all(|(x, y)| x.to_bits() == y.to_bits() || x.is_nan() && y.is_nan())
            );
        }
    }
}

#[test]
fn bad_arguments_are_errors() {
    let length = |r: Result<MbbFit, Error>| matches!(r, Err(Error::Length { .. }));
    let domain = |r: Result<MbbFit, Error>| matches!(r, Err(Error::Domain { .. }));
    assert!(length(MbbFit::new(&[353.0, 545.0], &[0.1; 2])));
    assert!(length(MbbFit::new(&[], &[])));
    assert!(length(MbbFit::new(&[353.0, 545.0, 857.0], &[0.1; 2])));
    assert!(length(MbbFit::new(&[353.0; 17], &[0.1; 17])));
    assert!(domain(MbbFit::new(&[353.0, 545.0, 353.0], &[0.1; 3])));
    assert!(domain(MbbFit::new(&[353.0, 545.0, 0.0], &[0.1; 3])));
    assert!(domain(MbbFit::new(&[353.0, 545.0, f64::NAN], &[0.1; 3])));
    for s in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        assert!(domain(MbbFit::new(&[353.0, 545.0, 857.0], &[0.1, s, 0.1])));
    }
    let fit = MbbFit::default();
    assert_eq!(fit.frequencies(), DEFAULT_NU_GHZ);
    assert_eq!(fit.sigma(), DEFAULT_SIGMA);
    assert!(fit.fit_pixel(&[1.0; 3]).is_err());
    let (x, mut a, mut b, mut c) = ([1.0; 4], [0.0; 4], [0.0; 4], [0.0; 4]);
    let maps: [&[f64]; 4] = [&x, &x, &x, &x[..3]];
    let level = Level::portable();
    assert!(fit_into(level, &fit, &maps, &mut a, &mut b, &mut c, None).is_err());
    let maps: [&[f64]; 4] = [&x; 4];
    assert!(fit_into(level, &fit, &maps[..3], &mut a, &mut b, &mut c, None).is_err());
    assert!(fit_into(level, &fit, &maps, &mut a, &mut b[..2], &mut c, None).is_err());
    assert!(fit_into(level, &fit, &maps, &mut a, &mut b, &mut c[..2], None).is_err());
    assert!(
        fit_into(
            level,
            &fit,
            &maps,
            &mut a,
            &mut b,
            &mut c,
            Some(&mut [0.0; 3])
        )
        .is_err()
    );
}

/// Sixteen frequencies, as many as a fit takes, with noise.
#[test]
fn sixteen_frequencies() {
    let nu: Vec<f64> = (0..16).map(|i| 100.0 * 1.25_f64.powi(i)).collect();
    let fit = MbbFit::new(&nu, &[0.05; 16]).unwrap();
    let mut i = data(&fit, 3e-6, 23.0, 1.4);
    for (k, i) in i.iter_mut().enumerate() {
        *i *= 1.0 + 0.05 * (7.0 * k as f64).sin();
    }
    let got = check(&fit, &i);
    assert_eq!(got.status, FitStatus::Fitted);
    assert!((got.t_kelvin - 23.0).abs() < 2.0 && (got.beta - 1.4).abs() < 0.2);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    /// Planck-like errors: the minimum is not above that of a coarse grid.
    #[test]
    fn prop_noisy_global_minimum(
        t in 6.0..50.0_f64, beta in 0.2..3.8_f64, noise in prop::array::uniform4(-3.0..3.0_f64),
    ) {
        let fit = MbbFit::default();
        let mut i = data(&fit, 1e-5, t, beta);
        for ((i, n), s) in i.iter_mut().zip(noise).zip(DEFAULT_SIGMA) {
            *i *= 1.0 + n * s;
        }
        let got = check(&fit, &i);
        if got.status == FitStatus::Fitted {
            for a in 0..40 {
                for b in 0..=20 {
                    let (chi2, _) = profile(&fit, &i, 5.0 * 12.0_f64.powf(f64::from(a) / 39.0), 0.2 * f64::from(b));
                    prop_assert!(chi2 >= got.chi2 * (1.0 - 1e-9) - 1e-18, "{:?} {:?} {}", i, got, chi2);
                }
            }
        } else {
            prop_assert_eq!(got.status, FitStatus::PoorFit);
        }
    }

    /// Any numbers at all.
    #[test]
    fn prop_any_bits(bits in prop::array::uniform4(any::<u64>())) {
        check(&MbbFit::default(), &bits.map(f64::from_bits));
    }

    /// Positive data of any shape, any frequencies and errors.
    #[test]
    fn prop_any_fit(
        table in prop::collection::vec((10.0..5000.0_f64, -3.0..0.5_f64, -6.0..6.0_f64), 3..12),
    ) {
        let nu: Vec<f64> = table.iter().map(|r| r.0).collect();
        let sigma: Vec<f64> = table.iter().map(|r| 10.0_f64.powf(r.1)).collect();
        let i: Vec<f64> = table.iter().map(|r| 10.0_f64.powf(r.2)).collect();
        check(&MbbFit::new(&nu, &sigma).unwrap(), &i);
    }

    /// Intensities ten times larger: τ ten times larger, all else the same.
    #[test]
    fn prop_scaling(t in 6.0..50.0_f64, beta in 0.2..3.8_f64, noise in prop::array::uniform4(-1.0..1.0_f64), scale in -20..20_i32) {
        let fit = MbbFit::default();
        let mut i = data(&fit, 1e-5, t, beta);
        for ((i, n), s) in i.iter_mut().zip(noise).zip(DEFAULT_SIGMA) {
            *i *= 1.0 + n * s;
        }
        let factor = 2.0_f64.powi(scale);
        let a = fit.fit_pixel(&i).unwrap();
        let b = fit.fit_pixel(&i.iter().map(|x| x * factor).collect::<Vec<_>>()).unwrap();
        prop_assert_eq!((a.t_kelvin, a.beta, a.chi2, a.tau * factor), (b.t_kelvin, b.beta, b.chi2, b.tau));
    }
}
