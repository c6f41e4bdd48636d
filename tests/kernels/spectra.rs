//! Windows, power-law fits, bins, 2×2 roots and mode coupling.

use dust3d_kernels::sht::alm;
use dust3d_kernels::simd::Level;
use dust3d_kernels::spectra::{
    CouplingRow, Cov2, PowerLaw, beam, beam_complement, bin_range, binned_mean, coupling_row_into,
    coupling_scratch_len, cross_spectrum, fit_amplitude, fit_power_law, fit_range, fwhm_to_sigma,
    log_normal_into, scale_by_l, wigner3j_into, wigner3j_len,
};
use dust3d_tests::reference::rows;
use dust3d_tests::tolerance;
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

/// All symbols for l₂, l₃.
fn symbols(l2: usize, l3: usize, m: usize) -> Vec<f64> {
    let mut out = vec![f64::NAN; wigner3j_len(l2, l3)];
    wigner3j_into(l2, l3, m, &mut out).expect("the right length");
    out
}

#[test]
fn racah_table_wigner3j() {
    let mut worst = 0.0_f64;
    for row in rows(include_str!("../data/mode_coupling/wigner3j.txt")) {
        let [l2, l3, m, j] = [0, 1, 2, 3].map(|column| row[column] as usize);
        let got = symbols(l2, l3, m)[j - l2.abs_diff(l3)];
        worst = worst.max((got - row[4]).abs());
    }
    tolerance::WIGNER_3J.hold(worst);
}

#[test]
fn prop_large_wigner3j() {
    // Closed forms at the ends of the range, orthogonality of m = 0 and 2, and nothing beyond m.
    let mut worst = 0.0_f64;
    for (l2, l3) in [(4096, 4096), (2, 4096), (4095, 1024), (3000, 2999)] {
        let (zero, two) = (symbols(l2, l3, 0), symbols(l2, l3, 2));
        let first = l2.abs_diff(l3);
        let dot = |a: &[f64], b: &[f64]| -> f64 {
            let terms = a.iter().zip(b).enumerate();
            terms
                .map(|(i, (a, b))| (2 * (first + i) + 1) as f64 * a * b)
                .sum()
        };
        for (a, b, exact) in [(&zero, &zero, 1.0), (&two, &two, 1.0), (&zero, &two, 0.0)] {
            worst = worst.max((dot(a, b) - exact).abs());
        }
    }
    let l = 4096;
    let exact = 1.0 / (2.0 * l as f64 + 1.0).sqrt();
    for m in [0, 2] {
        worst = worst.max((symbols(l, l, m)[0] / exact - 1.0).abs());
    }
    tolerance::WIGNER_3J_LARGE.hold(worst);
    assert_eq!(symbols(1, 5, 2), [0.0; 3]);
    assert!(wigner3j_into(3, 4, 0, &mut [0.0; 6]).is_err());
}

/// Rows of the four matrices for one l.
fn coupling(l: usize, lmax: usize, mask: &[f64]) -> [Vec<f64>; 4] {
    let mut rows: [Vec<f64>; 4] = std::array::from_fn(|_| vec![f64::NAN; lmax + 1]);
    let mut scratch = vec![f64::NAN; coupling_scratch_len(lmax)];
    let [tt, te, same, other] = &mut rows;
    let row = CouplingRow {
        tt,
        te,
        same,
        other,
    };
    coupling_row_into(l, mask, row, &mut scratch).expect("the right lengths");
    rows
}

#[test]
fn closed_form_coupling() {
    let lmax = 40;
    // The whole sky couples nothing: W_l = 4π at l = 0.
    for l in 0..=lmax {
        let [tt, te, same, other] = coupling(l, lmax, &[4.0 * std::f64::consts::PI]);
        for l2 in 0..=lmax {
            let one = f64::from(u8::from(l == l2));
            let spin = if l < 2 { 0.0 } else { one };
            assert!((tt[l2] - one).abs() < 1e-13);
            assert!((te[l2] - spin).abs() < 1e-13);
            assert!((same[l2] - spin).abs() < 1e-13);
            assert_eq!(other[l2], 0.0);
        }
    }
    // All that a mode gives away: the rows of TT and of EE with BB add up to the mean squared weight, Σ (2j+1)/4π W_j,
    // where l′ reaches as far as the mask takes it.
    let mask = [3.0, 0.7, 1.1, 0.2, 0.4, 0.05];
    let power: f64 = mask
        .iter()
        .enumerate()
        .map(|(j, w)| (2 * j + 1) as f64 * w / (4.0 * std::f64::consts::PI))
        .sum();
    for l in [8, 20, 34] {
        let [tt, _, same, other] = coupling(l, lmax, &mask);
        assert!((tt.iter().sum::<f64>() / power - 1.0).abs() < 1e-12);
        let both: f64 = same.iter().chain(&other).sum();
        assert!((both / power - 1.0).abs() < 1e-12);
        assert!(other.iter().sum::<f64>() > 0.0);
        // (2l+1) M_ll′ is symmetric.
        let [back, ..] = coupling(l + 1, lmax, &mask);
        let (there, here) = (
            tt[l + 1] / (2 * (l + 1) + 1) as f64,
            back[l] / (2 * l + 1) as f64,
        );
        assert!((there / here - 1.0).abs() < 1e-13);
    }
    let mut row = vec![0.0; 5];
    let mut others: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; 5]);
    let [te, same, other] = &mut others;
    let bad = CouplingRow {
        tt: &mut row,
        te,
        same,
        other,
    };
    assert!(coupling_row_into(5, &mask, bad, &mut [0.0; 100]).is_err());
}
