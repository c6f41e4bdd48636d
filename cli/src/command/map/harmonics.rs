//! Analysis of maps into coefficients and back, for the tools on maps.

use crate::cut_sky::Mask;
use crate::error::{Error, Result};
use crate::io::{MapFile, MapSource};
use crate::kernels::Complex;
use crate::kernels::healpix::Nside;
use crate::kernels::healpix::missing::is_missing;
use crate::kernels::sht::alm;
use crate::kernels::simd::Level;
use crate::sht::{Analysis, ShtPlan};
use crate::stages::laws::sky::mean_std;

/// I, or I, Q, U, of one Nside.
pub(super) struct Maps {
    pub(super) nside: u32,
    pub(super) maps: Vec<MapFile>,
    pub(super) missing: usize,
}

/// Coefficients T, or T, E, B.
pub(super) struct Coefficients {
    pub(super) lmax: usize,
    pub(super) alms: Vec<Vec<Complex<f64>>>,
}

impl Maps {
    /// Reads one map or three.
    pub(super) fn read(specs: &[String]) -> Result<Self> {
        if specs.len() != 1 && specs.len() != 3 {
            return Err(Error::usage(format!(
                "{} maps are given; give one (I) or three (I Q U)",
                specs.len()
            )));
        }
        let sources = specs
            .iter()
            .map(MapSource::parse)
            .collect::<Result<Vec<_>>>()?;
        let maps = sources
            .iter()
            .map(MapSource::read)
            .collect::<Result<Vec<_>>>()?;
        let nside = maps[0].nside;
        if let Some((spec, map)) = specs.iter().zip(&maps).find(|(_, map)| map.nside != nside) {
            return Err(Error::input(format!(
                "`{}` has Nside {nside} and `{spec}` has {}; bring them to one Nside first (dust3d map degrade)",
                specs[0], map.nside
            )));
        }
        let missing = maps
            .iter()
            .map(|map| {
                map.values
                    .iter()
                    .filter(|value| is_missing(**value))
                    .count()
            })
            .sum();
        Ok(Self {
            nside,
            maps,
            missing,
        })
    }

    /// The band limit asked for, or 2 Nside.
    pub(super) fn lmax(&self, asked: Option<usize>) -> Result<usize> {
        let nside = self.nside as usize;
        let lmax = asked.unwrap_or(2 * nside);
        if lmax > 4 * nside {
            return Err(Error::usage(format!(
                "--lmax {lmax} is above 4 Nside = {}; lower it",
                4 * nside
            )));
        }
        Ok(lmax)
    }

    /// Multiplies all maps by weights: intensity without its weighted mean, missing pixels as no fluctuation.
    pub(super) fn weigh(&mut self, mask: &Mask) {
        for (index, map) in self.maps.iter_mut().enumerate() {
            let (mut sum, mut all) = (0.0, 0.0);
            for (x, w) in map.values.iter().zip(&mask.weight) {
                if !is_missing(*x) {
                    sum += x * w;
                    all += w;
                }
            }
            let mean = if index == 0 && all > 0.0 {
                sum / all
            } else {
                0.0
            };
            for (x, w) in map.values.iter_mut().zip(&mask.weight) {
                *x = if is_missing(*x) { 0.0 } else { (*x - mean) * w };
            }
        }
    }

    /// The coefficients as healpy's `map2alm(iter=…)` finds them: equal weights and Jacobi iterations. Missing pixels
    /// count as no fluctuation.
    pub(super) fn analyse(
        self,
        lmax: usize,
        iterations: usize,
        level: Level,
    ) -> Result<Coefficients> {
        let mut plan = ShtPlan::new(Nside::new(self.nside.into())?, lmax, level)?;
        let how = Analysis {
            iterations,
            ring_weights: false,
        };
        let mut maps = self
            .maps
            .into_iter()
            .map(|map| map.values)
            .collect::<Vec<_>>();
        for (index, map) in maps.iter_mut().enumerate() {
            // Without fluctuation, intensity is its mean; Q and U, whose means mean nothing, are zero.
            let (mean, _) = if index == 0 {
                mean_std(map)
            } else {
                (0.0, 0.0)
            };
            let fill = if mean.is_finite() { mean } else { 0.0 };
            for value in map.iter_mut().filter(|value| is_missing(**value)) {
                *value = fill;
            }
        }
        let zero = vec![Complex::new(0.0, 0.0); alm::len(lmax)];
        let mut alms = vec![zero; maps.len()];
        match (maps.as_slice(), alms.as_mut_slice()) {
            ([i, q, u], [t, e, b]) => {
                plan.analysis_mixed(&[i], &[[q, u]], &mut [t], &mut [[e, b]], &how)?;
            }
            ([i, ..], [t, ..]) => plan.analysis(i, t, &how)?,
            _ => {}
        }
        Ok(Coefficients { lmax, alms })
    }
}
