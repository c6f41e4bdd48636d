//! Spectra of weighted maps.
//!
//! Maps are multiplied by the weights (intensity after its weighted mean is subtracted, which would otherwise spread the
//! mask's own spectrum over the low multipoles) and analysed as if the product were the whole sky; the spectra are divided by the
//! mean of the squared weight. That corrects the level, not the mixing of neighbouring multipoles nor, in polarisation,
//! of E with B: see [`master`](super::master).

use super::mask::Mask;
use crate::Error;
use crate::kernels::sht::alm;
use crate::sht::{Harmonics, ShtPlan, Spectra, StokesView};
use num_complex::Complex;

impl Harmonics {
    /// Of I, Q, U times the weights of a mask (none: the whole sky).
    ///
    /// # Errors
    /// If a map does not fit the plan.
    pub fn of(
        plan: &mut ShtPlan,
        maps: StokesView<'_>,
        mask: Option<&Mask>,
    ) -> Result<Self, Error> {
        Ok(Self::of_all(plan, &[maps], mask)?.remove(0))
    }

    /// Of several skies at once.
    ///
    /// # Errors
    /// If a map does not fit the plan.
    pub fn of_all(
        plan: &mut ShtPlan,
        skies: &[StokesView<'_>],
        mask: Option<&Mask>,
    ) -> Result<Vec<Self>, Error> {
        let weighted: Vec<[Vec<f64>; 3]> = match mask {
            None => Vec::new(),
            Some(mask) => skies
                .iter()
                .map(|[i, q, u]| {
                    let mean = mean(i, mask);
                    let weigh = |map: &[f64], mean: f64| -> Vec<f64> {
                        let pairs = map.iter().zip(&mask.weight);
                        pairs.map(|(x, w)| (x - mean) * w).collect()
                    };
                    [weigh(i, mean), weigh(q, 0.0), weigh(u, 0.0)]
                })
                .collect(),
        };
        let skies: Vec<StokesView<'_>> = if mask.is_some() {
            weighted
                .iter()
                .map(|maps| maps.each_ref().map(Vec::as_slice))
                .collect()
        } else {
            skies.to_vec()
        };
        Self::analyse(plan, &skies)
    }
}

impl Spectra {
    /// Every spectrum divided by a number, such as [`Mask::mean_square`].
    #[must_use]
    pub fn over(mut self, divisor: f64) -> Self {
        for spectrum in [&mut self.tt, &mut self.ee, &mut self.bb, &mut self.te] {
            for c in spectrum {
                *c /= divisor;
            }
        }
        self
    }
}

/// Mean of a map with the weights of a mask.
#[must_use]
pub fn mean(map: &[f64], mask: &Mask) -> f64 {
    let pairs = || map.iter().zip(&mask.weight);
    let weight: f64 = pairs().map(|(_, w)| w).sum();
    pairs().map(|(x, w)| x * w).sum::<f64>() / weight
}

/// Coefficients up to `to` of those up to `from`: cut, or continued by zeros.
#[must_use]
pub fn truncated(from_alm: &[Complex<f64>], from: usize, to: usize) -> Vec<Complex<f64>> {
    let mut out = vec![Complex::new(0.0, 0.0); alm::len(to)];
    for m in 0..=to.min(from) {
        for l in m..=to.min(from) {
            out[alm::index(to, l, m)] = from_alm[alm::index(from, l, m)];
        }
    }
    out
}
