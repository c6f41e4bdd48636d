//! The total sky made from layers and factors, as the fit of a modified blackbody sees it.

use crate::Error;
use crate::config::Fit;
use crate::parallel;
use crate::stages::intensity::LayerAverages;
use crate::store::Stored;
use dust3d_kernels::fit::mbb::{MbbFit, fit_into};
use dust3d_kernels::healpix::missing::MISSING;
use dust3d_kernels::planck::mbb::{MbbNode, mbb_add_stokes};
use dust3d_kernels::simd::Level;
use dust3d_kernels::units::NU0_GHZ;
use std::ops::Range;

/// Least temperature of a layer, kelvin.
pub const T_FLOOR: f64 = 5.0;
/// Least spectral index of a layer.
pub const BETA_FLOOR: f64 = 0.0;

/// Factors of the emission laws: T_i = `avg`·T_avg + `t`·δT, β_i = β_avg + `beta`·δβ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factors {
    /// Of the average temperatures.
    pub avg: f64,
    /// Of the temperature fluctuations.
    pub t: f64,
    /// Of the spectral-index fluctuations.
    pub beta: f64,
}

/// Mean and standard deviation of T and β.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LawStats {
    /// Kelvin.
    pub t_mean: f64,
    /// Kelvin.
    pub t_std: f64,
    /// Dimensionless.
    pub beta_mean: f64,
    /// Dimensionless.
    pub beta_std: f64,
}

/// Statistics of the fit of the total, and how many pixels have none.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FitStats {
    /// Over the pixels with a fit.
    pub laws: LawStats,
    /// Pixels without.
    pub unconverged: u64,
}

/// The fit of the total: its frequencies, as bands of emission and as the fit's own tables.
pub struct TotalFit {
    nodes: Vec<MbbNode>,
    fit: MbbFit,
}

impl TotalFit {
    /// The fit a configuration describes.
    ///
    /// # Errors
    /// If a frequency or an uncertainty is out of range.
    pub fn new(config: &Fit) -> Result<Self, Error> {
        let nodes = config
            .nu_ghz
            .iter()
            .map(|&nu| MbbNode::new(nu, NU0_GHZ, 1.0));
        Ok(Self {
            nodes: nodes.collect::<Result<_, _>>()?,
            fit: MbbFit::new(&config.nu_ghz, &config.sigma)?,
        })
    }
}

/// Layers at ν₀ with the fluctuations of their laws.
pub struct Sky<'a> {
    /// Intensity of each layer at ν₀, MJy/sr.
    pub intensity: Vec<&'a Stored>,
    /// δT of each layer, kelvin.
    pub t: Vec<&'a Stored>,
    /// δβ of each layer.
    pub beta: Vec<&'a Stored>,
    /// Averages of each layer.
    pub averages: &'a LayerAverages,
    /// Instructions to use.
    pub level: Level,
}

impl Sky<'_> {
    /// Fits the total intensity with `factors` at the frequencies of `fit`.
    ///
    /// # Errors
    /// Those of the kernels (lengths).
    pub fn fit(&self, fit: &TotalFit, factors: &Factors) -> Result<FitStats, Error> {
        let npix = self.intensity.first().map_or(0, |i| i.len());
        let failure = std::sync::Mutex::new(None);
        let sums = parallel::sums(npix, |range| {
            self.fit_range(fit, factors, range).unwrap_or_else(|error| {
                if let Ok(mut failure) = failure.lock() {
                    *failure = Some(error);
                }
                [0.0; 6]
            })
        });
        if let Ok(Some(error)) = failure.into_inner() {
            return Err(error);
        }
        let [n, t, tt, b, bb, unconverged] = sums;
        let spread = |sum: f64, square: f64| (square / n - (sum / n).powi(2)).max(0.0).sqrt();
        Ok(FitStats {
            laws: LawStats {
                t_mean: T_SHIFT + t / n,
                t_std: spread(t, tt),
                beta_mean: BETA_SHIFT + b / n,
                beta_std: spread(b, bb),
            },
            unconverged: unconverged as u64,
        })
    }

    /// Count, ΣT, ΣT², Σβ, Σβ² (about the shifts) and pixels without fit, over some pixels.
    fn fit_range(
        &self,
        fit: &TotalFit,
        factors: &Factors,
        range: Range<usize>,
    ) -> Result<[f64; 6], Error> {
        let n = range.len();
        let (mut t, mut beta) = (vec![0.0; n], vec![0.0; n]);
        let mut total = Total::new(fit, n);
        for (layer, intensity) in self.intensity.iter().enumerate() {
            let averages = (
                factors.avg * self.averages.t[layer],
                self.averages.beta[layer],
            );
            let dt = self.t[layer].view(range.clone())?;
            let db = self.beta[layer].view(range.clone())?;
            for ((t, beta), (dt, db)) in t.iter_mut().zip(&mut beta).zip(dt.iter().zip(&*db)) {
                *t = law(averages.0, factors.t, *dt, T_FLOOR);
                *beta = law(averages.1, factors.beta, *db, BETA_FLOOR);
            }
            total.add(self.level, &intensity.view(range.clone())?, &t, &beta)?;
        }
        total.fit(self.level, &mut t, &mut beta)?;
        let mut sums = [0.0; 6];
        for (&t, &beta) in t.iter().zip(&beta) {
            if t.is_nan() {
                sums[5] += 1.0;
                continue;
            }
            let (t, beta) = (t - T_SHIFT, beta - BETA_SHIFT);
            sums[0] += 1.0;
            sums[1] += t;
            sums[2] += t * t;
            sums[3] += beta;
            sums[4] += beta * beta;
        }
        Ok(sums)
    }
}

/// The total intensity in some pixels at the frequencies of a fit.
pub struct Total<'a> {
    fit: &'a TotalFit,
    bands: Vec<Vec<f64>>,
}

impl<'a> Total<'a> {
    /// Nothing yet, in `n` pixels.
    #[must_use]
    pub fn new(fit: &'a TotalFit, n: usize) -> Self {
        Self {
            fit,
            bands: vec![vec![0.0; n]; fit.nodes.len()],
        }
    }

    /// Adds a layer: its intensity at ν₀ (MJy/sr), T (kelvin) and β.
    ///
    /// # Errors
    /// Those of the kernels (lengths).
    pub fn add(
        &mut self,
        level: Level,
        intensity: &[f64],
        t: &[f64],
        beta: &[f64],
    ) -> Result<(), Error> {
        let nodes: Vec<&[MbbNode]> = self.fit.nodes.iter().map(std::slice::from_ref).collect();
        let mut out: Vec<&mut [f64]> = self.bands.iter_mut().map(Vec::as_mut_slice).collect();
        Ok(mbb_add_stokes(
            level,
            &nodes,
            [intensity],
            t,
            beta,
            &mut out,
        )?)
    }

    /// T and β of the fit, NaN where there is none.
    ///
    /// # Errors
    /// Those of the kernels (lengths).
    pub fn fit(&self, level: Level, t: &mut [f64], beta: &mut [f64]) -> Result<(), Error> {
        let maps: Vec<&[f64]> = self.bands.iter().map(Vec::as_slice).collect();
        let mut tau = vec![0.0; t.len()];
        fit_into(level, &self.fit.fit, &maps, &mut tau, t, beta, None)?;
        Ok(())
    }
}

/// Sums are taken about these, so that squares keep their digits.
const T_SHIFT: f64 = 20.0;
const BETA_SHIFT: f64 = 1.6;

/// T or β of a layer in a pixel.
#[inline]
#[must_use]
pub fn law(average: f64, factor: f64, fluctuation: f64, floor: f64) -> f64 {
    (average + factor * fluctuation).max(floor)
}

/// Mean and standard deviation of a map over its valid pixels.
#[must_use]
pub fn mean_std(map: &[f64]) -> (f64, f64) {
    let [n, sum] = parallel::sums(map.len(), |r| valid_sums(&map[r], |x| x));
    let mean = sum / n;
    let [_, square] = parallel::sums(map.len(), |r| valid_sums(&map[r], |x| (x - mean).powi(2)));
    (mean, (square / n).sqrt())
}

/// How many values are valid, and the sum of `term` over them. Eight sums side by side: none waits for the one before.
fn valid_sums(values: &[f64], term: impl Fn(f64) -> f64) -> [f64; 2] {
    let (mut counts, mut sums) = ([0.0; 8], [0.0; 8]);
    let mut add = |eight: &[f64; 8]| {
        for ((&x, count), sum) in eight.iter().zip(&mut counts).zip(&mut sums) {
            // Without branches: missing values and NaN are not beyond the limit.
            let valid = (x - MISSING).abs() > -1e-5 * MISSING;
            *count += if valid { 1.0 } else { 0.0 };
            *sum += if valid { term(x) } else { 0.0 };
        }
    };
    let (eights, rest) = values.as_chunks::<8>();
    for eight in eights {
        add(eight);
    }
    let mut last = [MISSING; 8];
    last[..rest.len()].copy_from_slice(rest);
    add(&last);
    [counts.iter().sum(), sums.iter().sum()]
}
