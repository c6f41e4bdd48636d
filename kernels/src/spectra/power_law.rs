//! Power laws C_l = A (l/80)^α fitted to a spectrum.
//!
//! Least squares of ln C against ln(l/80) with weights 2l+1, the number of modes. Multipoles with C_l ≤ 0 (or not
//! finite) are left out. \[MKD18\], section 5; the pivot 80 is that of Planck's dust papers.

use crate::scalar::{exp, ln, pow};

/// The pivot multipole.
const PIVOT: f64 = 80.0;

/// C_l = `amplitude` · (l/80)^`slope`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerLaw {
    /// C at l = 80, in the unit of the spectrum.
    pub amplitude: f64,
    /// The exponent α.
    pub slope: f64,
}

impl PowerLaw {
    /// C_l; zero where the amplitude is zero and at l = 0.
    #[must_use]
    pub fn at(&self, l: usize) -> f64 {
        if l == 0 || self.amplitude == 0.0 {
            0.0
        } else {
            self.amplitude * pow(l as f64 / PIVOT, self.slope)
        }
    }
}

/// The range of multipoles a fit over `lo ..= hi` really uses on a grid that carries signal to `reach`.
///
/// `hi` is cut to `reach` (the least of lmax and 1.5 Nside of the coarsest map involved); where that leaves less than
/// an octave, `lo` becomes max(2, ⌊hi/2⌋).
#[must_use]
pub fn fit_range(lo: usize, hi: usize, reach: usize) -> (usize, usize) {
    let hi = if hi < reach { hi } else { reach };
    let lo = if hi < 2 * lo { (hi / 2).max(2) } else { lo };
    (lo, hi)
}

/// Amplitude and slope over `lo ..= hi`; `None` with fewer than two usable multipoles.
#[must_use]
pub fn fit_power_law(c: &[f64], lo: usize, hi: usize) -> Option<PowerLaw> {
    let (mut w, mut wx, mut wy) = (0.0, 0.0, 0.0);
    for (x, y, weight) in points(c, lo, hi) {
        w += weight;
        wx += weight * x;
        wy += weight * y;
    }
    let (mean_x, mean_y) = (wx / w, wy / w);
    let (mut xx, mut xy) = (0.0, 0.0);
    for (x, y, weight) in points(c, lo, hi) {
        xx += weight * (x - mean_x) * (x - mean_x);
        xy += weight * (x - mean_x) * (y - mean_y);
    }
    (xx > 0.0).then(|| {
        let slope = xy / xx;
        PowerLaw {
            amplitude: exp(mean_y - slope * mean_x),
            slope,
        }
    })
}

/// Amplitude over `lo ..= hi` of a power law of given slope; zero where no multipole is usable.
#[must_use]
pub fn fit_amplitude(c: &[f64], lo: usize, hi: usize, slope: f64) -> f64 {
    let (mut w, mut sum) = (0.0, 0.0);
    for (x, y, weight) in points(c, lo, hi) {
        w += weight;
        sum += weight * (y - slope * x);
    }
    if w > 0.0 { exp(sum / w) } else { 0.0 }
}

/// (ln(l/80), ln C_l, 2l+1) for the usable multipoles.
fn points(c: &[f64], lo: usize, hi: usize) -> impl Iterator<Item = (f64, f64, f64)> {
    c.iter()
        .enumerate()
        .skip(lo.max(1))
        .take_while(move |&(l, _)| l <= hi)
        .filter(|&(_, &c)| c > 0.0 && c < f64::INFINITY)
        .map(|(l, &c)| {
            let l = l as f64;
            (ln(l / PIVOT), ln(c), 2.0 * l + 1.0)
        })
}
