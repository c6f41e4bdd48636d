//! Log-normal small scales of the intensity of a layer.
//!
//! I_κ = I exp(κ g − κ²/2), g the windowed seed scaled to unit variance: positive by construction, with fluctuations
//! proportional to the large-scale intensity ([MKD18], section 5). Then large scales are restored, twice: every cell of a
//! coarse grid gets back its observed mean. (A ratio of smoothed maps does not do: a layer spans such a dynamic range
//! that harmonic smoothing makes it negative over much of the sky.)
//!
//! The one amplitude κ of the layer is the smallest that brings the power at high l to the extrapolated power law.

use super::super::regrid;
use crate::Error;
use crate::parallel;
use crate::sht::{Analysis, ShtPlan};
use dust3d_kernels::fit::find_root;
use dust3d_kernels::healpix::Nside;
use dust3d_kernels::simd::Level;
use dust3d_kernels::spectra::{PowerLaw, alm_len, cross_spectrum};
use num_complex::Complex;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How κ was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum KappaStatus {
    /// The power matches the extrapolated law.
    Root,
    /// The observed layer has as much power already: κ = 0.
    Enough,
    /// Even κ = 1 does not reach the law.
    Limit,
}

/// Steps of the scan of κ over 0 … 1.
const KAPPA_STEPS: usize = 20;
/// κ is refined to this.
const KAPPA_TOLERANCE: f64 = 1e-10;

/// Adds small scales to `observed` (MJy/sr); returns the map, κ and how it was found.
///
/// `g`: the fluctuation map, any amplitude; `law`: the target spectrum.
///
/// # Errors
/// Those of the transforms (lengths).
pub fn add(
    plan: &mut ShtPlan,
    observed: &[f64],
    g: &[f64],
    law: &PowerLaw,
    restore_fwhm_rad: f64,
) -> Result<(Vec<f64>, f64, KappaStatus), Error> {
    if law.amplitude == 0.0 {
        return Ok((observed.to_vec(), 0.0, KappaStatus::Enough));
    }
    let layer = Layer {
        observed,
        g: unit_variance(g),
        cells: restoring_nside(plan.nside(), restore_fwhm_rad)?,
        nside: plan.nside(),
        level: plan.level(),
    };
    let mut match_power = PowerMatch::new(plan, &layer, law);

    // The scan needs signs only, for which one pass of quadrature does; the root is refined on the accurate analysis.
    let quick = Analysis {
        iterations: 0,
        ..Analysis::default()
    };
    let accurate = Analysis::default();
    let at_zero = match_power.excess(0.0, &accurate)?;
    if at_zero >= 0.0 {
        return Ok((layer.with(0.0)?, 0.0, KappaStatus::Enough));
    }
    let mut low = (0.0, at_zero);
    let mut analysis = &quick;
    let mut step = 1;
    while step <= KAPPA_STEPS {
        let kappa = step as f64 / KAPPA_STEPS as f64;
        let excess = match_power.excess(kappa, analysis)?;
        if excess < 0.0 {
            low = (kappa, excess);
            step += 1;
            continue;
        }
        if analysis.iterations == quick.iterations {
            // Confirm the step with the accurate analysis, from the last two points on.
            analysis = &accurate;
            if low.0 > 0.0 {
                low.1 = match_power.excess(low.0, analysis)?;
                if low.1 >= 0.0 {
                    step = 1;
                    low = (0.0, at_zero);
                }
            }
            continue;
        }
        let kappa = find_root(
            |kappa| match_power.excess(kappa, &accurate),
            low,
            (kappa, excess),
            KAPPA_TOLERANCE,
        )?;
        return Ok((layer.with(kappa)?, kappa, KappaStatus::Root));
    }
    Ok((layer.with(1.0)?, 1.0, KappaStatus::Limit))
}

/// One layer's observed intensity and its fluctuation map.
struct Layer<'a> {
    observed: &'a [f64],
    g: Vec<f64>,
    nside: Nside,
    level: Level,
    /// Grid whose cells keep their observed mean; none to skip restoring.
    cells: Option<Nside>,
}

impl Layer<'_> {
    /// The layer with fluctuations of amplitude κ, large scales restored twice.
    fn with(&self, kappa: f64) -> Result<Vec<f64>, Error> {
        if kappa == 0.0 {
            return Ok(self.observed.to_vec());
        }
        let mut map = parallel::map(self.observed.len(), |range, out| {
            for ((out, i), g) in out
                .iter_mut()
                .zip(&self.observed[range.clone()])
                .zip(&self.g[range])
            {
                *out = i * (kappa * g - 0.5 * kappa * kappa).exp();
            }
        });
        if let Some(cells) = self.cells {
            let wanted = regrid::scalar(self.observed, self.nside, cells, self.level)?;
            for _ in 0..2 {
                let mut ratio = regrid::scalar(&map, self.nside, cells, self.level)?;
                for (r, w) in ratio.iter_mut().zip(&wanted) {
                    *r = if *r == 0.0 { 1.0 } else { w / *r };
                }
                let ratio = regrid::scalar(&ratio, cells, self.nside, self.level)?;
                map.par_iter_mut().zip(ratio).for_each(|(x, r)| *x *= r);
            }
        }
        Ok(map)
    }
}

/// The power of a layer at high l beside that of its law.
struct PowerMatch<'a> {
    plan: &'a mut ShtPlan,
    layer: &'a Layer<'a>,
    /// Mean of ln C over the multipoles compared.
    wanted: f64,
    range: std::ops::RangeInclusive<usize>,
    alm: Vec<Complex<f64>>,
    spectrum: Vec<f64>,
}

impl<'a> PowerMatch<'a> {
    fn new(plan: &'a mut ShtPlan, layer: &'a Layer<'a>, law: &PowerLaw) -> Self {
        let lmax = plan.lmax();
        // ⌈0.6 lmax⌉ … ⌊0.9 lmax⌋ in integers.
        let range = (6 * lmax).div_ceil(10)..=9 * lmax / 10;
        let count = range.clone().count() as f64;
        Self {
            wanted: range.clone().map(|l| law.at(l).ln()).sum::<f64>() / count,
            range,
            alm: vec![Complex::new(0.0, 0.0); alm_len(lmax)],
            spectrum: vec![0.0; lmax + 1],
            plan,
            layer,
        }
    }

    /// Mean of ln C_l of the layer with amplitude κ, minus the wanted.
    fn excess(&mut self, kappa: f64, analysis: &Analysis) -> Result<f64, Error> {
        let map = self.layer.with(kappa)?;
        self.plan.analysis(&map, &mut self.alm, analysis)?;
        cross_spectrum(&self.alm, &self.alm, &mut self.spectrum)?;
        let (sum, count) = self
            .range
            .clone()
            .map(|l| self.spectrum[l])
            .filter(|&c| c > 0.0)
            .fold((0.0, 0.0), |(s, n), c| (s + c.ln(), n + 1.0));
        Ok(if count > 0.0 {
            sum / count - self.wanted
        } else {
            0.0
        })
    }
}

/// The grid whose cells keep their mean: the finest with Nside ≤ Nside/4 and cells no smaller than the scale.
fn restoring_nside(nside: Nside, fwhm_rad: f64) -> Result<Option<Nside>, Error> {
    if fwhm_rad <= 0.0 {
        return Ok(None);
    }
    let mut cells = 1;
    loop {
        let finer = 2 * cells;
        let size = (4.0 * std::f64::consts::PI / (12.0 * (finer * finer) as f64)).sqrt();
        if 4 * finer > nside.get() || size < fwhm_rad {
            return Ok(Some(Nside::new(cells)?));
        }
        cells = finer;
    }
}

/// `map` scaled to unit variance; zero stays zero.
fn unit_variance(map: &[f64]) -> Vec<f64> {
    let n = map.len() as f64;
    let [sum] = parallel::sums(map.len(), |r| [map[r].iter().sum()]);
    let mean = sum / n;
    let [square] = parallel::sums(map.len(), |r| {
        [map[r].iter().map(|x| (x - mean).powi(2)).sum()]
    });
    let sigma = (square / n).sqrt();
    if sigma > 0.0 {
        map.iter().map(|x| x / sigma).collect()
    } else {
        map.to_vec()
    }
}
