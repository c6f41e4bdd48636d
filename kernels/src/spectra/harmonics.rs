//! Spectra of a_lm and their scaling by functions of l.
//!
//! a_lm are m-major, index m(2 lmax + 1 − m)/2 + l, m ≥ 0: for each m the run l = m … lmax.

use crate::Error;
use crate::sht::alm;
use num_complex::Complex;

/// `out[l]` = Σ_m a_lm b*_lm / (2l+1) over all m, −l … l: auto-spectrum for `a` = `b`.
///
/// `a`, `b`: [`alm::len`]`(lmax)` coefficients of real fields; `out`: lmax + 1.
///
/// # Errors
/// [`Error::Length`] where a slice has another length.
pub fn cross_spectrum(
    a: &[Complex<f64>],
    b: &[Complex<f64>],
    out: &mut [f64],
) -> Result<(), Error> {
    let Some(lmax) = out.len().checked_sub(1) else {
        return Error::check_len("spectrum", 1, 0);
    };
    Error::check_len("a_lm", alm::len(lmax), a.len())?;
    Error::check_len("b_lm", alm::len(lmax), b.len())?;
    out.fill(0.0);
    let (mut a, mut b) = (a, b);
    for m in 0..=lmax {
        let n = lmax + 1 - m;
        let (Some((am, rest_a)), Some((bm, rest_b))) =
            (a.split_at_checked(n), b.split_at_checked(n))
        else {
            break;
        };
        (a, b) = (rest_a, rest_b);
        let weight = if m == 0 { 1.0 } else { 2.0 };
        for ((out, a), b) in out.iter_mut().skip(m).zip(am).zip(bm) {
            *out += weight * (a.re * b.re + a.im * b.im);
        }
    }
    for (l, out) in out.iter_mut().enumerate() {
        *out /= 2.0 * l as f64 + 1.0;
    }
    Ok(())
}

/// a_lm ← `factor[l]` · a_lm.
///
/// # Errors
/// [`Error::Length`] unless `alm` has [`alm::len`]`(factor.len() − 1)` elements.
pub fn scale_by_l(alm: &mut [Complex<f64>], factor: &[f64]) -> Result<(), Error> {
    let Some(lmax) = factor.len().checked_sub(1) else {
        return Error::check_len("factor", 1, 0);
    };
    Error::check_len("a_lm", alm::len(lmax), alm.len())?;
    let mut rest = alm;
    for m in 0..=lmax {
        let Some((head, tail)) = rest.split_at_mut_checked(lmax + 1 - m) else {
            break;
        };
        for (a, &f) in head.iter_mut().zip(factor.iter().skip(m)) {
            *a *= f;
        }
        rest = tail;
    }
    Ok(())
}
