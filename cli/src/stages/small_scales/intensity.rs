//! Log-normal small scales of the intensity of a layer.
//!
//! I_κ = I exp(κ g − κ²/2), g the windowed seed scaled to unit variance: positive by construction, with fluctuations
//! proportional to the large-scale intensity (\[MKD18\], section 5). Then large scales are restored, twice: every cell of a
//! coarse grid gets back its observed mean. (A ratio of smoothed maps does not do: a layer spans such a dynamic range
//! that harmonic smoothing makes it negative over much of the sky.)
//!
//! The one amplitude κ of the layer is the smallest that brings the power at high l to the extrapolated power law.

use super::super::laws::sky::mean_std;
use super::super::regrid;
use crate::Error;
use crate::parallel::{self, CHUNK};
use crate::sht::{Analysis, ShtPlan};
use dust3d_kernels::fit::find_root;
use dust3d_kernels::healpix::Nside;
use dust3d_kernels::sht::alm;
use dust3d_kernels::simd::Level;
use dust3d_kernels::spectra::{PowerLaw, cross_spectrum, log_normal_into};
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
/// The quick excess is trusted to have the sign of the accurate one where it is this many times the difference of the
/// two near the root.
const SAFETY: f64 = 4.0;
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
    let cells = restoring_nside(plan.nside(), restore_fwhm_rad)?;
    let layer = Layer::new(observed, g, plan.nside(), cells, plan.level())?;
    let mut power = PowerMatch::new(plan, &layer, law);
    let at_zero = power.excess_of(observed_alm)?;
    if at_zero >= 0.0 {
        return Ok(untouched(KappaStatus::Enough));
    }
    let (trial, status) = power.find(at_zero)?;
    Ok(LogNormal {
        map: trial.map,
        alm: trial.alm,
        kappa: trial.kappa,
        status,
    })
}

/// One layer's observed intensity and its fluctuation map.
struct Layer<'a> {
    observed: &'a [f64],
    g: &'a [f64],
    /// Standard deviation of `g`.
    sigma: f64,
    nside: Nside,
    level: Level,
    /// Grid whose cells keep their observed mean, and those means; none to skip restoring.
    cells: Option<(Nside, Vec<f64>)>,
}

impl<'a> Layer<'a> {
    fn new(
        observed: &'a [f64],
        g: &'a [f64],
        nside: Nside,
        cells: Option<Nside>,
        level: Level,
    ) -> Result<Self, Error> {
        let (_, sigma) = mean_std(g);
        let means = |cells| Ok::<_, Error>((cells, regrid::scalar(observed, nside, cells, level)?));
        Ok(Self {
            observed,
            g,
            sigma,
            nside,
            level,
            cells: cells.map(means).transpose()?,
        })
    }

    /// The layer with fluctuations of amplitude κ, large scales restored twice.
    fn with(&self, kappa: f64) -> Result<Vec<f64>, Error> {
        if kappa == 0.0 {
            return Ok(self.observed.to_vec());
        }
        let mut map = vec![0.0; self.observed.len()];
        let amplitude = if self.sigma > 0.0 {
            kappa / self.sigma
        } else {
            0.0
        };
        let shift = 0.5 * kappa * kappa;
        map.par_chunks_mut(CHUNK)
            .zip(
                self.observed
                    .par_chunks(CHUNK)
                    .zip(self.g.par_chunks(CHUNK)),
            )
            .try_for_each(|(out, (i, g))| {
                log_normal_into(self.level, i, g, amplitude, shift, out)
            })?;
        if let Some((cells, wanted)) = &self.cells {
            for _ in 0..2 {
                let mut ratio = regrid::scalar(&map, self.nside, *cells, self.level)?;
                for (r, w) in ratio.iter_mut().zip(wanted) {
                    *r = if *r == 0.0 { 1.0 } else { w / *r };
                }
                regrid::multiply(&mut map, self.nside, &ratio, *cells, self.level)?;
            }
        }
        Ok(map)
    }
}

/// The layer with fluctuations of some amplitude.
struct Trial {
    kappa: f64,
    map: Vec<f64>,
    alm: Vec<Complex<f64>>,
    /// Mean of ln C_l over the multipoles compared, minus the wanted.
    excess: f64,
}

/// The power of a layer at high l beside that of its law, as a function of κ.
///
/// ```text
/// for κ in 0.05, 0.10 … 1:                       one pass of quadrature each
///     stop at the first with too much power
/// κ ← secants of the quick excess
/// analyse the layer at κ accurately
/// until the step is below 1e-10:
///     κ ← secant of the accurate excess
///     a_lm ← a_lm + analysis(layer at κ − layer before)
/// ```
///
/// * Quadrature without iterations errs by a percent of C_l at most, nearly the same at neighbouring κ: it finds the
///   step of the scan, unless an end of the step is so near the root that the accurate excess might have another sign
///   there. Then the scan is repeated with accurate analyses.
/// * Analysis is linear, and each Jacobi iteration takes two digits off the error. The difference of two nearby layers
///   is small already, and needs as many iterations fewer as it is smaller ([`iterations_for`]).
struct PowerMatch<'a> {
    plan: &'a mut ShtPlan,
    layer: &'a Layer<'a>,
    /// Mean of ln C over the multipoles compared.
    wanted: f64,
    range: std::ops::RangeInclusive<usize>,
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
            spectrum: vec![0.0; lmax + 1],
            plan,
            layer,
        }
    }

    /// The layer at the smallest root, or at κ = 1 if there is none.
    fn find(&mut self, at_zero: f64) -> Result<(Trial, KappaStatus), Error> {
        let accurate = Analysis::default();
        let Some((low, high)) = self.scan(at_zero, &quick())? else {
            // The last word is the accurate analysis's, should it see more power.
            let most = self.evaluate(1.0, &accurate)?;
            return if most.excess < 0.0 {
                Ok((most, KappaStatus::Limit))
            } else {
                self.find_accurately(at_zero)
            };
        };
        let slope = (high.1 - low.1) / (high.0 - low.0);
        let mut kappa = secant(low, high);
        let mut quick_excess = self.evaluate(kappa, &quick())?.excess;
        kappa = (kappa - quick_excess / slope).clamp(low.0, high.0);
        quick_excess = self.evaluate(kappa, &quick())?.excess;

        let start = self.evaluate(kappa, &accurate)?;
        let doubt = SAFETY * (start.excess - quick_excess).abs();
        if (low.0 == 0.0 || low.1 < -doubt) && high.1 > doubt {
            self.refine(start, slope, (low.0, high.0))
        } else {
            self.find_accurately(at_zero)
        }
    }

    /// As [`find`](Self::find), every step of the scan analysed accurately.
    fn find_accurately(&mut self, at_zero: f64) -> Result<(Trial, KappaStatus), Error> {
        let accurate = Analysis::default();
        let Some((low, high)) = self.scan(at_zero, &accurate)? else {
            return Ok((self.evaluate(1.0, &accurate)?, KappaStatus::Limit));
        };
        let start = self.evaluate(secant(low, high), &accurate)?;
        let slope = (high.1 - low.1) / (high.0 - low.0);
        self.refine(start, slope, (low.0, high.0))
    }

    /// The first step of the scan over which the sign changes, as (κ, excess) at both ends; none if there is none.
    fn scan(&mut self, at_zero: f64, analysis: &Analysis) -> Result<Option<(Point, Point)>, Error> {
        let mut low = (0.0, at_zero);
        for step in 1..=KAPPA_STEPS {
            let kappa = step as f64 / KAPPA_STEPS as f64;
            let excess = self.evaluate(kappa, analysis)?.excess;
            if excess >= 0.0 {
                return Ok(Some((low, (kappa, excess))));
            }
            low = (kappa, excess);
        }
        Ok(None)
    }

    /// The root in `bounds`, from an accurate trial near it and the slope of the excess.
    fn refine(
        &mut self,
        mut trial: Trial,
        mut slope: f64,
        bounds: (f64, f64),
    ) -> Result<(Trial, KappaStatus), Error> {
        for _ in 0..SECANTS {
            let kappa = (trial.kappa - trial.excess / slope).clamp(bounds.0, bounds.1);
            let step = kappa - trial.kappa;
            if step.abs() < KAPPA_TOLERANCE {
                return Ok((trial, KappaStatus::Root));
            }
            let next = self.moved(&trial, kappa)?;
            let found = (next.excess - trial.excess) / step;
            if found > 0.0 {
                slope = found;
            }
            trial = next;
        }
        // The secants do not settle: bisect.
        let accurate = Analysis::default();
        let (low, high) = bounds;
        let (at_low, at_high) = (
            self.evaluate(low, &accurate)?.excess,
            self.evaluate(high, &accurate)?.excess,
        );
        let kappa = find_root(
            |kappa| Ok::<_, Error>(self.evaluate(kappa, &accurate)?.excess),
            (low, at_low),
            (high, at_high),
            KAPPA_TOLERANCE,
        )?;
        Ok((self.evaluate(kappa, &accurate)?, KappaStatus::Root))
    }

    /// The layer with amplitude κ, analysed from nothing.
    fn evaluate(&mut self, kappa: f64, analysis: &Analysis) -> Result<Trial, Error> {
        let map = self.layer.with(kappa)?;
        let mut alm = vec![Complex::new(0.0, 0.0); alm::len(self.plan.lmax())];
        self.plan.analysis(&map, &mut alm, analysis)?;
        self.trial(kappa, map, alm)
    }

    /// The layer with amplitude κ, its difference to an accurate trial analysed.
    fn moved(&mut self, from: &Trial, kappa: f64) -> Result<Trial, Error> {
        let analysis = Analysis {
            iterations: iterations_for(kappa - from.kappa),
            ..Analysis::default()
        };
        let map = self.layer.with(kappa)?;
        let difference = parallel::map(map.len(), |range, out| {
            for ((out, x), y) in out
                .iter_mut()
                .zip(&map[range.clone()])
                .zip(&from.map[range])
            {
                *out = x - y;
            }
        });
        let mut alm = vec![Complex::new(0.0, 0.0); from.alm.len()];
        self.plan.analysis(&difference, &mut alm, &analysis)?;
        alm.par_iter_mut().zip(&from.alm).for_each(|(a, b)| *a += b);
        self.trial(kappa, map, alm)
    }

    fn trial(&mut self, kappa: f64, map: Vec<f64>, alm: Vec<Complex<f64>>) -> Result<Trial, Error> {
        let excess = self.excess_of(&alm)?;
        Ok(Trial {
            kappa,
            map,
            alm,
            excess,
        })
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

/// Jacobi iterations that a difference of layers needs when κ moves by `step`, for an error no larger than that of an
/// accurate analysis of the whole: each gains a factor of a hundred or more.
fn iterations_for(step: f64) -> usize {
    match step.abs() {
        x if x > 1e-2 => 3,
        x if x > 1e-4 => 2,
        x if x > 1e-6 => 1,
        _ => 0,
    }
}

/// Where the line through two points is zero.
fn secant(low: Point, high: Point) -> f64 {
    low.0 - low.1 * (high.0 - low.0) / (high.1 - low.1)
}
