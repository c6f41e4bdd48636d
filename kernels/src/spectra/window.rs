//! Gaussian beam windows.

use crate::scalar::{exp, expm1};

/// √(8 ln 2): full width at half maximum over standard deviation of a Gaussian.
const FWHM_OVER_SIGMA: f64 = 2.354_820_045_030_949_4;

/// Standard deviation of a Gaussian beam of full width at half maximum `fwhm`, in the same unit.
#[must_use]
pub fn fwhm_to_sigma(fwhm: f64) -> f64 {
    fwhm / FWHM_OVER_SIGMA
}

/// Window b_l = exp(−l(l+1)σ²/2) of a Gaussian beam, for spin 0 and spin 2 alike.
///
/// `fwhm_rad` in radians, ≥ 0; zero gives 1.
#[must_use]
pub fn beam(fwhm_rad: f64, l: usize) -> f64 {
    exp(-0.5 * exponent(fwhm_rad, l))
}

/// 1 − b_l², without cancellation where the beam is narrow.
///
/// `fwhm_rad` in radians, ≥ 0; zero gives 0.
#[must_use]
pub fn beam_complement(fwhm_rad: f64, l: usize) -> f64 {
    -expm1(-exponent(fwhm_rad, l))
}

/// l(l+1)σ².
fn exponent(fwhm_rad: f64, l: usize) -> f64 {
    let sigma = fwhm_to_sigma(fwhm_rad);
    let l = l as f64;
    l * (l + 1.0) * sigma * sigma
}
