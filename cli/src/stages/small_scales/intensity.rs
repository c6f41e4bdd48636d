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
use dust3d_kernels::sht::alm;
use dust3d_kernels::simd::Level;
use dust3d_kernels::spectra::{PowerLaw, cross_spectrum};
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
/// Secant steps before the bracket is halved instead.
const SECANTS: usize = 12;
/// (κ, excess of power).
type Point = (f64, f64);
/// κ is refined to this.
const KAPPA_TOLERANCE: f64 = 1e-10;

/// A layer with small scales.
pub struct LogNormal {
    /// The map, MJy/sr.
    pub map: Vec<f64>,
    /// Its a_lm.
    pub alm: Vec<Complex<f64>>,
    /// Amplitude of the fluctuations.
    pub kappa: f64,
    /// How `kappa` was found.
    pub status: KappaStatus,
}

/// Adds small scales to `observed` (MJy/sr), whose a_lm are `observed_alm`.
///
/// `g`: the fluctuation map, any amplitude; `law`: the target spectrum.
///
/// κ is scanned in twentieths on one pass of quadrature, which gives the same signs as the accurate analysis but for a
/// step next to the root; the accurate analysis then decides the step, and refines the root by secants that start with
/// the slope of the quick one: three or four accurate analyses in all.
///
/// # Errors
/// Those of the transforms (lengths).
pub fn add(
    plan: &mut ShtPlan,
    observed: &[f64],
    observed_alm: &[Complex<f64>],
    g: &[f64],
    law: &PowerLaw,
    restore_fwhm_rad: f64,
) -> Result<LogNormal, Error> {
    let untouched = |status| LogNormal {
        map: observed.to_vec(),
        alm: observed_alm.to_vec(),
        kappa: 0.0,
        status,
    };
    if law.amplitude == 0.0 {
        return Ok(untouched(KappaStatus::Enough));
    }
    let layer = Layer {
        observed,
        g: unit_variance(g),
        cells: restoring_nside(plan.nside(), restore_fwhm_rad)?,
        nside: plan.nside(),
        level: plan.level(),
    };
    let mut power = PowerMatch::new(plan, &layer, law);
    let at_zero = power.excess_of(observed_alm)?;
    if at_zero >= 0.0 {
        return Ok(untouched(KappaStatus::Enough));
    }
    let Some((low, high)) = power.scan(at_zero)? else {
        let (map, _) = power.evaluate(1.0, &Analysis::default())?;
        return Ok(LogNormal {
            map,
            alm: power.alm,
            kappa: 1.0,
            status: KappaStatus::Limit,
        });
    };
    let (kappa, map) = power.refine(low, high)?;
    Ok(LogNormal {
        map,
        alm: power.alm,
        kappa,
        status: KappaStatus::Root,
    })
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
            alm: vec![Complex::new(0.0, 0.0); alm::len(lmax)],
            spectrum: vec![0.0; lmax + 1],
            plan,
            layer,
        }
    }

    /// The first step of the scan over which the sign changes, as (κ, excess) at both ends; none if there is none.
    fn scan(&mut self, at_zero: f64) -> Result<Option<(Point, Point)>, Error> {
        let (quick, accurate) = (quick(), Analysis::default());
        let mut analysis = &quick;
        let mut low = (0.0, at_zero);
        let mut step = 1;
        while step <= KAPPA_STEPS {
            let kappa = step as f64 / KAPPA_STEPS as f64;
            let (_, excess) = self.evaluate(kappa, analysis)?;
            if excess < 0.0 {
                low = (kappa, excess);
                step += 1;
            } else if analysis.iterations == accurate.iterations {
                return Ok(Some((low, (kappa, excess))));
            } else {
                // The accurate analysis has the last word, from the last two points on.
                analysis = &accurate;
                if low.0 > 0.0 {
                    low.1 = self.evaluate(low.0, analysis)?.1;
                    if low.1 >= 0.0 {
                        (step, low) = (1, (0.0, at_zero));
                    }
                }
            }
        }
        Ok(None)
    }

    /// The root between two points, and the map there; its accurate a_lm are left in `self.alm`.
    fn refine(&mut self, low: Point, high: Point) -> Result<(f64, Vec<f64>), Error> {
        let accurate = Analysis::default();
        let (mut last, mut slope) = (low, (high.1 - low.1) / (high.0 - low.0));
        for _ in 0..SECANTS {
            let kappa = (last.0 - last.1 / slope).clamp(low.0, high.0);
            let (map, excess) = self.evaluate(kappa, &accurate)?;
            let moved = kappa - last.0;
            if moved != 0.0 {
                slope = (excess - last.1) / moved;
            }
            last = (kappa, excess);
            if (excess / slope).abs() < KAPPA_TOLERANCE {
                return Ok((kappa, map));
            }
        }
        let kappa = find_root(
            |kappa| Ok::<_, Error>(self.evaluate(kappa, &accurate)?.1),
            low,
            high,
            KAPPA_TOLERANCE,
        )?;
        let (map, _) = self.evaluate(kappa, &accurate)?;
        Ok((kappa, map))
    }

    /// The layer with amplitude κ and its excess of power; its a_lm are left in `self.alm`.
    fn evaluate(&mut self, kappa: f64, analysis: &Analysis) -> Result<(Vec<f64>, f64), Error> {
        let map = self.layer.with(kappa)?;
        let mut alm = std::mem::take(&mut self.alm);
        self.plan.analysis(&map, &mut alm, analysis)?;
        let excess = self.excess_of(&alm)?;
        self.alm = alm;
        Ok((map, excess))
    }

    /// Mean of ln C_l over the multipoles compared, minus the wanted.
    fn excess_of(&mut self, alm: &[Complex<f64>]) -> Result<f64, Error> {
        cross_spectrum(alm, alm, &mut self.spectrum)?;
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

/// One pass of quadrature.
fn quick() -> Analysis {
    Analysis {
        iterations: 0,
        ..Analysis::default()
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
