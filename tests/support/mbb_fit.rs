//! Properties of the modified-blackbody fit that must hold for any input.

use dust3d_kernels::fit::mbb::{
    BETA_BOUNDS, FitCounts, FitStatus, MAX_CHI2, MbbFit, PixelFit, T_BOUNDS, fit_into,
};
use dust3d_kernels::planck::spectrum::planck_scalar;
use dust3d_kernels::simd::Level;
use dust3d_kernels::units::NU0_GHZ;

/// τ (ν/ν₀)^β B_ν(T) in MJy/sr.
pub fn intensity(nu_ghz: f64, tau: f64, t_kelvin: f64, beta: f64) -> f64 {
    tau * (nu_ghz / NU0_GHZ).powf(beta) * planck_scalar(nu_ghz, t_kelvin)
}

/// χ² of a law: Σ ((m/I − 1)/σ)².
pub fn chi2(fit: &MbbFit, data: &[f64], tau: f64, t_kelvin: f64, beta: f64) -> f64 {
    fit.frequencies()
        .iter()
        .zip(fit.sigma())
        .zip(data)
        .map(|((&nu, s), i)| ((intensity(nu, tau, t_kelvin, beta) / i - 1.0) / s).powi(2))
        .sum()
}

/// The least χ² over τ for given T and β, and that τ.
pub fn profile(fit: &MbbFit, data: &[f64], t_kelvin: f64, beta: f64) -> (f64, f64) {
    let (mut uw, mut uu) = (0.0, 0.0);
    for ((&nu, s), i) in fit.frequencies().iter().zip(fit.sigma()).zip(data) {
        let u = intensity(nu, 1.0, t_kelvin, beta) / i / s;
        uw += u / s;
        uu += u * u;
    }
    let tau = uw / uu;
    (chi2(fit, data, tau, t_kelvin, beta), tau)
}

/// Fits all pixels of `maps` at a level: τ, T, β, χ² and the counts.
///
/// # Panics
/// If the lengths are not equal.
pub fn run(fit: &MbbFit, level: Level, maps: &[&[f64]]) -> ([Vec<f64>; 4], FitCounts) {
    let n = maps.first().map_or(0, |m| m.len());
    let mut out: [Vec<f64>; 4] = std::array::from_fn(|_| vec![-1.0; n]);
    let [tau, t, beta, chi2] = &mut out;
    let counts = fit_into(level, fit, maps, tau, t, beta, Some(chi2)).expect("equal lengths");
    (out, counts)
}

/// What must hold for the fit of any data whatever.
///
/// * A pixel with a value that is not positive and finite is missing, and no other is.
/// * A fitted pixel has τ > 0, T and β within their bounds, χ² ≤ 50 and that of its parameters.
/// * It is a minimum: no neighbour within the bounds has a smaller χ² by more than rounding.
/// * Without a fit τ, T, β are NaN; counts, statuses and NaN agree.
/// * The fused levels give the same bits; the pixel does not depend on its neighbours.
///
/// # Panics
/// If one of them does not.
pub fn check(fit: &MbbFit, data: &[f64]) -> PixelFit {
    check_to(fit, data, 0.0)
}

/// [`check`] for data that no law need come near.
///
/// Fuzzing found that there, in a corner of the bounds, Gauss and Newton's Hessian may be far too large and a step small
/// before its time: χ² then lies 3e-6 of itself above its minimum, for which 1e-5 are allowed. And τ and χ² under- or
/// overflow with intensities below 1e-100 or above 1e100, for which the minimum is not looked at.
///
/// # Panics
/// If something does not hold.
pub fn check_far(fit: &MbbFit, data: &[f64]) {
    if data
        .iter()
        .any(|&i| i > 0.0 && !(1e-100..1e100).contains(&i))
    {
        check_levels(
            fit,
            data,
            &fit.fit_pixel(data).expect("as many as frequencies"),
        );
    } else {
        check_to(fit, data, 1e-5);
    }
}

/// [`check`], but a minimum to a fraction of χ².
fn check_to(fit: &MbbFit, data: &[f64], slack: f64) -> PixelFit {
    let got = fit.fit_pixel(data).expect("as many as frequencies");
    let usable = data.iter().all(|&i| i > 0.0 && i < f64::INFINITY);
    assert_eq!(
        got.status == FitStatus::Missing,
        !usable,
        "{data:?} {got:?}"
    );
    if got.status == FitStatus::Fitted {
        check_minimum(fit, data, &got, slack);
    } else {
        assert!(got.tau.is_nan() && got.t_kelvin.is_nan() && got.beta.is_nan());
        match got.status {
            FitStatus::PoorFit => assert!(got.chi2 > MAX_CHI2),
            _ => assert!(got.chi2.is_nan()),
        }
    }
    check_levels(fit, data, &got);
    got
}

fn check_minimum(fit: &MbbFit, data: &[f64], got: &PixelFit, slack: f64) {
    let (t, beta) = (got.t_kelvin, got.beta);
    assert!(got.tau > 0.0 && got.tau < f64::INFINITY, "{data:?} {got:?}");
    assert!((T_BOUNDS[0]..=T_BOUNDS[1]).contains(&t), "{data:?} {got:?}");
    assert!(
        (BETA_BOUNDS[0]..=BETA_BOUNDS[1]).contains(&beta),
        "{data:?} {got:?}"
    );
    assert!(got.chi2 <= MAX_CHI2);
    // Residuals are differences of numbers of size 1/σ.
    let weights: f64 = fit.sigma().iter().map(|s| (s * s).recip()).sum();
    let rounding = 1e-12 * (got.chi2 + (weights * got.chi2).sqrt()) + 1e-26 * weights;
    let here = chi2(fit, data, got.tau, t, beta);
    assert!(
        (here - got.chi2).abs() <= 1e-6 * got.chi2 + 100.0 * rounding,
        "{data:?} {got:?} {here}"
    );
    for (dt, db) in [
        (1.0, 0.0),
        (-1.0, 0.0),
        (0.0, 1.0),
        (0.0, -1.0),
        (1.0, -1.0),
        (-1.0, 1.0),
    ] {
        for size in [1e-3, 1e-5] {
            let t2 = (t * (1.0 + size * dt)).clamp(T_BOUNDS[0], T_BOUNDS[1]);
            let beta2 = (beta + size * db).clamp(BETA_BOUNDS[0], BETA_BOUNDS[1]);
            let (there, _) = profile(fit, data, t2, beta2);
            assert!(
                there >= here * (1.0 - slack) - rounding,
                "{data:?} {got:?}: {there} at {t2}, {beta2} below {here}"
            );
        }
    }
}

fn check_levels(fit: &MbbFit, data: &[f64], got: &PixelFit) {
    // Three neighbours of another kind, the pixel in lane 1 of the first vector and lane 2 of the second.
    let other = |k: usize| -> Vec<f64> {
        fit.frequencies()
            .iter()
            .map(|&nu| {
                if k == 2 {
                    f64::NAN
                } else {
                    intensity(nu, 1e-5, 15.0 + k as f64, 1.5)
                }
            })
            .collect()
    };
    let pixels: Vec<Vec<f64>> = (0..11)
        .map(|p| {
            if p % 9 == 1 {
                data.to_vec()
            } else {
                other(p % 9)
            }
        })
        .collect();
    let maps: Vec<Vec<f64>> = (0..data.len())
        .map(|f| pixels.iter().map(|p| p[f]).collect())
        .collect();
    let maps: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
    let mut fused: Option<[Vec<f64>; 4]> = None;
    for level in Level::available() {
        let (out, counts) = run(fit, level, &maps);
        assert_eq!(counts.total(), 11);
        for map in &out {
            assert!(map[1].to_bits() == map[10].to_bits() || map[1].is_nan() && map[10].is_nan());
        }
        let at = |k: usize| out[k][1];
        if level == Level::portable() {
            for (a, b) in [
                (at(0), got.tau),
                (at(1), got.t_kelvin),
                (at(2), got.beta),
                (at(3), got.chi2),
            ] {
                assert!(a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan());
            }
        } else {
            if let Some(first) = &fused {
                for (a, b) in first.iter().flatten().zip(out.iter().flatten()) {
                    assert!(
                        a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan(),
                        "{level}: {a} {b}"
                    );
                }
            }
            fused = Some(out);
        }
    }
}
