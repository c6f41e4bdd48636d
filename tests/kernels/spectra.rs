//! Windows, power-law fits, bins and 2×2 roots.

use dust3d_kernels::sht::alm;
use dust3d_kernels::simd::Level;
use dust3d_kernels::spectra::{
    Cov2, PowerLaw, beam, beam_complement, bin_range, binned_mean, cross_spectrum, fit_amplitude,
    fit_power_law, fit_range, fwhm_to_sigma, log_normal_into, scale_by_l,
};
use num_complex::Complex;
use proptest::prelude::*;

#[test]
fn closed_form_beam() {
    // A beam of 1 degree has half its peak at 0.5 degree, and b_l = exp(−l(l+1)σ²/2).
    let fwhm = 1.0_f64.to_radians();
    let sigma = fwhm_to_sigma(fwhm);
    let half = (-0.5 * (0.5 * fwhm / sigma).powi(2)).exp();
    assert!((half - 0.5).abs() < 1e-15);
    assert_eq!(beam(fwhm, 0), 1.0);
    assert_eq!(beam(0.0, 1000), 1.0);
    let b = beam(fwhm, 100);
    assert!((b / (-0.5 * 100.0 * 101.0 * sigma * sigma).exp() - 1.0).abs() < 1e-14);
    // 1 − b² keeps its digits where b² rounds to 1.
    let arcsec = fwhm / 3600.0;
    let x = 6.0 * fwhm_to_sigma(arcsec).powi(2);
    assert!((beam_complement(arcsec, 2) / (x - x * x / 2.0) - 1.0).abs() < 1e-15);
    assert!(x < 1e-10);
}

#[test]
fn exact_power_law_is_found() {
    let law = PowerLaw {
        amplitude: 3e-7,
        slope: -2.6,
    };
    let mut c: Vec<f64> = (0..=400).map(|l| law.at(l)).collect();
    c[50] = -1.0; // left out
    c[51] = 0.0;
    c[52] = f64::NAN;
    let fit = fit_power_law(&c, 30, 300).expect("enough points");
    assert!((fit.slope - law.slope).abs() < 1e-12);
    assert!((fit.amplitude / law.amplitude - 1.0).abs() < 1e-12);
    let amplitude = fit_amplitude(&c, 30, 100, -2.6);
    assert!((amplitude / law.amplitude - 1.0).abs() < 1e-12);
    assert_eq!(fit_power_law(&[0.0; 100], 30, 90), None);
    assert_eq!(fit_power_law(&c, 60, 60), None);
    assert_eq!(fit_amplitude(&[0.0; 100], 30, 90, -2.0), 0.0);
    assert_eq!(fit_amplitude(&[], 30, 90, -2.0), 0.0);
    assert_eq!(law.at(0), 0.0);
}

#[test]
fn fit_range_keeps_an_octave() {
    assert_eq!(fit_range(30, 300, 1024), (30, 300));
    assert_eq!(fit_range(30, 300, 96), (30, 96));
    assert_eq!(fit_range(30, 300, 48), (24, 48));
    assert_eq!(fit_range(30, 100, 24), (12, 24));
    assert_eq!(fit_range(30, 100, 3), (2, 3));
}

#[test]
fn bins_average_with_mode_weights() {
    assert_eq!(bin_range(2, 100), 2..7);
    assert_eq!(bin_range(50, 100), 41..60);
    assert_eq!(bin_range(99, 100), 86..101);
    let c: Vec<f64> = (0..=40).map(|l| (l * l) as f64).collect();
    let mut out = vec![f64::NAN; 41];
    binned_mean(&c, &mut out).expect("lengths agree");
    assert_eq!(out[..2], [0.0, 0.0]);
    let naive = |l: usize| {
        let (mut s, mut w) = (0.0, 0.0);
        for k in 2..=40_usize {
            if k.abs_diff(l) <= 4 + l / 10 {
                s += (2 * k + 1) as f64 * c[k];
                w += (2 * k + 1) as f64;
            }
        }
        s / w
    };
    for l in 2..=40 {
        assert!((out[l] / naive(l) - 1.0).abs() < 1e-14);
    }
    assert!(binned_mean(&c, &mut out[1..]).is_err());
    assert!(binned_mean(&[], &mut []).is_ok());
}

#[test]
fn degenerate_covariances_give_finite_roots() {
    let zero = Cov2::default();
    let perfect = Cov2 {
        xx: 1.0,
        xy: 2.0,
        yy: 4.0,
    };
    for (from, to) in [(zero, perfect), (perfect, zero), (perfect, perfect)] {
        let m = from.recolour(&to);
        assert!(m.a.is_finite() && m.b.is_finite() && m.c.is_finite());
    }
    assert_eq!(zero.correlation(), 0.0);
    assert_eq!(perfect.correlation(), 1.0);
}

proptest! {
    #[test]
    fn prop_root_squares_to_covariance(sx in 1e-6..1e3_f64, sy in 1e-6..1e3_f64, rho in -0.999..0.999_f64) {
        let cov = Cov2 { xx: sx * sx, xy: rho * sx * sy, yy: sy * sy };
        let l = cov.root();
        prop_assert!((l.a * l.a / cov.xx - 1.0).abs() < 1e-14);
        prop_assert!((l.a * l.b - cov.xy).abs() < 1e-14 * sx * sy);
        prop_assert!(((l.b * l.b + l.c * l.c) / cov.yy - 1.0).abs() < 1e-14);
    }

    #[test]
    fn prop_recolour_reaches_the_target(
        s in prop::array::uniform4(1e-3..1e3_f64),
        rho in -0.99..0.99_f64,
        target_rho in -0.99..0.99_f64,
    ) {
        let from = Cov2 { xx: s[0] * s[0], xy: rho * s[0] * s[1], yy: s[1] * s[1] };
        let to = Cov2 { xx: s[2] * s[2], xy: target_rho * s[2] * s[3], yy: s[3] * s[3] };
        let m = from.recolour(&to);
        let xx = m.a * m.a * from.xx;
        let xy = m.a * (m.b * from.xx + m.c * from.xy);
        let yy = m.b * m.b * from.xx + 2.0 * m.b * m.c * from.xy + m.c * m.c * from.yy;
        prop_assert!((xx / to.xx - 1.0).abs() < 1e-12);
        prop_assert!((xy - to.xy).abs() < 1e-10 * s[2] * s[3]);
        prop_assert!((yy / to.yy - 1.0).abs() < 1e-10);
        // With equal first variances the first field is untouched.
        let same = Cov2 { xx: from.xx, xy: target_rho * s[0] * s[3], yy: to.yy };
        prop_assert_eq!(from.recolour(&same).a, 1.0);
    }
}

#[test]
fn naive_cross_spectrum_and_scaling() {
    let lmax = 5;
    let index = |l: usize, m: usize| m * (2 * lmax + 1 - m) / 2 + l;
    let mut a = vec![Complex::new(0.0, 0.0); alm::len(lmax)];
    let mut b = a.clone();
    for m in 0..=lmax {
        for l in m..=lmax {
            let x = (l * 7 + m * 3) as f64;
            let im = if m == 0 { 0.0 } else { 1.0 };
            a[index(l, m)] = Complex::new(x.sin(), im * x.cos());
            b[index(l, m)] = Complex::new((2.0 * x).cos(), im * (3.0 * x).sin());
        }
    }
    let mut c = vec![f64::NAN; lmax + 1];
    cross_spectrum(&a, &b, &mut c).expect("lengths agree");
    for l in 0..=lmax {
        let mut sum = 0.0;
        for m in 0..=l {
            let term = (a[index(l, m)] * b[index(l, m)].conj()).re;
            sum += if m == 0 { term } else { 2.0 * term };
        }
        assert!((c[l] - sum / (2 * l + 1) as f64).abs() < 1e-15);
    }
    let factor: Vec<f64> = (0..=lmax).map(|l| l as f64).collect();
    let before = a.clone();
    scale_by_l(&mut a, &factor).expect("lengths agree");
    for m in 0..=lmax {
        for l in m..=lmax {
            assert_eq!(a[index(l, m)], before[index(l, m)] * l as f64);
        }
    }
    assert!(cross_spectrum(&a[1..], &b, &mut c).is_err());
    assert!(cross_spectrum(&a, &b, &mut []).is_err());
    assert!(scale_by_l(&mut a[1..], &factor).is_err());
    assert!(scale_by_l(&mut a, &[]).is_err());
}

#[test]
fn closed_form_log_normal() {
    let field: Vec<f64> = (0..37).map(|k| 0.5 + k as f64).collect();
    let g: Vec<f64> = (0..37).map(|k| 0.3 * k as f64 - 5.0).collect();
    let mut bits = Vec::new();
    for level in Level::available() {
        let mut out = vec![f64::NAN; 37];
        log_normal_into(level, &field, &g, 0.7, 0.245, &mut out).unwrap();
        for ((x, g), got) in field.iter().zip(&g).zip(&out) {
            let expected = x * (0.7 * g - 0.245).exp();
            assert!((got / expected - 1.0).abs() < 2e-15, "{level} {got}");
        }
        if level.name() != "portable" {
            bits.push(out.iter().map(|x| x.to_bits()).collect::<Vec<_>>());
        }
    }
    assert!(bits.windows(2).all(|pair| pair[0] == pair[1]));
    let mut short = vec![0.0; 36];
    assert!(log_normal_into(Level::detect(), &field, &g, 1.0, 0.5, &mut short).is_err());
}
