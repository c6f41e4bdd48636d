//! Spectra of the observed temperature and spectral index, to be given to every layer.

use super::sky::{LawStats, mean_std};
use crate::Error;
use crate::parallel;
use crate::sht::{Analysis, ShtPlan};
use crate::stages::intensity::mean;
use dust3d_kernels::healpix::missing::is_missing;
use dust3d_kernels::sht::alm;
use dust3d_kernels::spectra::{Cov2, cross_spectrum, fit_power_law};
use num_complex::Complex;
use rayon::prelude::*;

/// What the layers' T and β maps are made from.
pub struct ObservedLaws {
    /// Covariance of the fluctuations of T (first) and β at each l, 0 … lmax; zero at l = 0.
    pub covariances: Vec<Cov2>,
    /// Mean and standard deviation of the observed T and β.
    pub statistics: LawStats,
    /// Fluctuations of T about its mean in all pixels that have one, sorted, kelvin.
    pub t_sorted: Vec<f64>,
    /// Fluctuations of β about its mean in all pixels that have one, sorted.
    pub beta_sorted: Vec<f64>,
}

impl ObservedLaws {
    /// Measures the observed `t` and `beta` (working grid; missing pixels count as no fluctuation in the spectra).
    ///
    /// `input_nside`: of the coarser of the two inputs. Beyond l = 2 `input_nside`, where an input carries nothing, T and
    /// β continue with the power law of the last octave and their correlation with its mean there.
    ///
    /// # Errors
    /// If a map has another length than the plan's.
    pub fn measure(
        plan: &mut ShtPlan,
        t: &[f64],
        beta: &[f64],
        input_nside: usize,
    ) -> Result<Self, Error> {
        let ((t_mean, t_std), (beta_mean, beta_std)) = (mean_std(t), mean_std(beta));
        let statistics = LawStats {
            t_mean,
            t_std,
            beta_mean,
            beta_std,
        };
        let (t_sorted, t) = fluctuations(t);
        let (beta_sorted, beta) = fluctuations(beta);
        let mut covariances = covariances(plan, &t, &beta)?;
        extend(&mut covariances, input_nside);
        if let Some(monopole) = covariances.first_mut() {
            *monopole = Cov2::default();
        }
        Ok(Self {
            covariances,
            statistics,
            t_sorted,
            beta_sorted,
        })
    }
}

/// The map minus its mean: the valid pixels sorted, and the map with zero where it is missing.
fn fluctuations(map: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let mean = mean(map);
    let filled = parallel::map(map.len(), |range, out| {
        for (out, &x) in out.iter_mut().zip(&map[range]) {
            *out = if is_missing(x) { 0.0 } else { x - mean };
        }
    });
    let mut sorted: Vec<f64> = map
        .iter()
        .filter(|&&x| !is_missing(x))
        .map(|x| x - mean)
        .collect();
    sorted.par_sort_unstable_by(f64::total_cmp);
    (sorted, filled)
}

/// Covariance of two maps at each l.
///
/// # Errors
/// If a map has another length than the plan's.
pub fn covariances(plan: &mut ShtPlan, x: &[f64], y: &[f64]) -> Result<Vec<Cov2>, Error> {
    let (x, y) = analyse(plan, x, y)?;
    covariances_of_alm(&x, &y, plan.lmax())
}

/// a_lm of two maps.
pub(super) fn analyse(
    plan: &mut ShtPlan,
    x: &[f64],
    y: &[f64],
) -> Result<(Vec<Complex<f64>>, Vec<Complex<f64>>), Error> {
    let zero = vec![Complex::new(0.0, 0.0); alm::len(plan.lmax())];
    let (mut a, mut b) = (zero.clone(), zero);
    plan.analysis_batch(&[x, y], &mut [&mut a, &mut b], &Analysis::default())?;
    Ok((a, b))
}

/// Covariance of two fields' a_lm at each l.
pub(super) fn covariances_of_alm(
    x: &[Complex<f64>],
    y: &[Complex<f64>],
    lmax: usize,
) -> Result<Vec<Cov2>, Error> {
    let spectrum = |a: &[Complex<f64>], b: &[Complex<f64>]| -> Result<Vec<f64>, Error> {
        let mut c = vec![0.0; lmax + 1];
        cross_spectrum(a, b, &mut c)?;
        Ok(c)
    };
    let (xx, xy, yy) = (spectrum(x, x)?, spectrum(x, y)?, spectrum(y, y)?);
    Ok((0..=lmax)
        .map(|l| Cov2 {
            xx: xx[l],
            xy: xy[l],
            yy: yy[l],
        })
        .collect())
}

/// Continues the spectra beyond l = 2 `nside` from the octave `nside` … 2 `nside`.
fn extend(covariances: &mut [Cov2], nside: usize) {
    let (lo, hi) = (nside, 2 * nside);
    if covariances.len() <= hi + 1 {
        return;
    }
    let xx: Vec<f64> = covariances.iter().map(|c| c.xx).collect();
    let yy: Vec<f64> = covariances.iter().map(|c| c.yy).collect();
    let (xx, yy) = (fit_power_law(&xx, lo, hi), fit_power_law(&yy, lo, hi));
    let octave = &covariances[lo..=hi];
    let correlation = octave.iter().map(Cov2::correlation).sum::<f64>() / octave.len() as f64;
    for (l, c) in covariances.iter_mut().enumerate().skip(hi + 1) {
        let at = |law: Option<dust3d_kernels::spectra::PowerLaw>| law.map_or(0.0, |law| law.at(l));
        c.xx = at(xx);
        c.yy = at(yy);
        c.xy = correlation * (c.xx * c.yy).sqrt();
    }
}
