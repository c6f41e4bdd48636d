//! Another Nside, a beam, other coordinates, or coefficients themselves: what goes through harmonic coefficients.

use super::Args;
use crate::error::{Error, Result};
use crate::io::Run;
use crate::io::fits::Frame;
use crate::io::raw::LARGEST_NSIDE;
use crate::kernels::Complex;
use crate::kernels::healpix::Nside;
use crate::kernels::sht::alm;
use crate::kernels::simd::Level;
use crate::kernels::spectra::{beam, scale_by_l};
use crate::sht::{Analysis, ShtPlan, rotate_alms};
use crate::stages::emission::Stokes;

type Alm = Vec<Complex<f64>>;

/// What becomes of I, Q, U: a name and values each.
pub(super) enum Made {
    /// I, Q, U, as many as are asked for.
    Maps(Vec<(&'static str, Vec<f64>)>),
    /// T, E, B, as many as are asked for.
    Coefficients(Vec<(&'static str, Alm)>),
}

/// What is done to the maps of one run.
pub(super) struct Harmonics {
    from: u32,
    pub(super) to: u32,
    pub(super) lmax: usize,
    frame: Frame,
    coefficients: bool,
    level: Level,
    /// Plans at the two Nsides, made when needed; the second only if it differs.
    plans: [Option<ShtPlan>; 2],
}

impl Harmonics {
    pub(super) fn of(args: &Args, run: &Run, level: Level) -> Result<Self> {
        let from = run.manifest.nside;
        let to = args.nside.unwrap_or(from);
        if !to.is_power_of_two() || to > LARGEST_NSIDE {
            return Err(Error::usage(format!(
                "--nside {to} is not possible; choose a power of two up to {LARGEST_NSIDE}"
            )));
        }
        // What the coarser of the two grids can carry.
        let coarser = if args.alm { from } else { from.min(to) } as usize;
        let lmax = args.lmax.unwrap_or(2 * coarser);
        if lmax > 4 * coarser {
            return Err(Error::usage(format!(
                "--lmax {lmax} is above 4 Nside = {}; lower it",
                4 * coarser
            )));
        }
        Ok(Self {
            from,
            to,
            lmax,
            frame: args.coord,
            coefficients: args.alm,
            level,
            plans: [None, None],
        })
    }

    /// Whether maps with this beam go through coefficients.
    pub(super) fn is_needed(&self, fwhm_rad: f64) -> bool {
        self.to != self.from || fwhm_rad > 0.0 || self.frame != Frame::Galactic || self.coefficients
    }

    /// Those of `wanted` (`I`, `QU` or `IQU`), smoothed, rotated, resampled.
    pub(super) fn apply(&mut self, stokes: Stokes, wanted: &str, fwhm_rad: f64) -> Result<Made> {
        let (scalar, pair) = (wanted.contains('I'), wanted.contains('Q'));
        let [i, q, u] = stokes;
        let mut maps = Vec::new();
        if scalar {
            maps.push(("I", i));
        }
        if pair {
            maps.extend([("Q", q), ("U", u)]);
        }
        if !self.is_needed(fwhm_rad) {
            return Ok(Made::Maps(maps));
        }
        let lmax = self.lmax;
        let mut alms = self.analyse(&maps)?;
        drop(maps);
        let euler = self.frame.from_galactic();
        if self.frame != Frame::Galactic {
            let mut views: Vec<&mut [Complex<f64>]> =
                alms.iter_mut().map(|(_, alm)| alm.as_mut_slice()).collect();
            rotate_alms(&mut views, lmax, euler)?;
        }
        let window: Vec<f64> = (0..=lmax).map(|l| beam(fwhm_rad, l)).collect();
        for (_, alm) in &mut alms {
            scale_by_l(alm, &window)?;
        }
        if self.coefficients {
            return Ok(Made::Coefficients(alms));
        }
        self.synthesise(&alms).map(Made::Maps)
    }

    /// As healpy's `map2alm(iter=3)`: equal weights, three Jacobi iterations.
    fn analyse(&mut self, maps: &[(&'static str, Vec<f64>)]) -> Result<Vec<(&'static str, Alm)>> {
        let how = Analysis {
            iterations: 3,
            ring_weights: false,
        };
        let mut alms: Vec<(&'static str, Alm)> = maps
            .iter()
            .map(|(name, _)| {
                let letter = match *name {
                    "I" => "T",
                    "Q" => "E",
                    _ => "B",
                };
                (letter, vec![Complex::new(0.0, 0.0); alm::len(self.lmax)])
            })
            .collect();
        let plan = self.plan(0)?;
        match (maps, alms.as_mut_slice()) {
            ([(_, i), (_, q), (_, u)], [(_, t), (_, e), (_, b)]) => {
                plan.analysis_mixed(&[i], &[[q, u]], &mut [t], &mut [[e, b]], &how)?;
            }
            ([(_, q), (_, u)], [(_, e), (_, b)]) => plan.analysis_spin2(q, u, e, b, &how)?,
            ([(_, i)], [(_, t)]) => plan.analysis(i, t, &how)?,
            _ => {}
        }
        Ok(alms)
    }

    fn synthesise(
        &mut self,
        alms: &[(&'static str, Alm)],
    ) -> Result<Vec<(&'static str, Vec<f64>)>> {
        let npix = 12 * (self.to as usize).pow(2);
        let mut maps: Vec<(&'static str, Vec<f64>)> = alms
            .iter()
            .map(|(name, _)| {
                let letter = match *name {
                    "T" => "I",
                    "E" => "Q",
                    _ => "U",
                };
                (letter, vec![0.0; npix])
            })
            .collect();
        let plan = self.plan(1)?;
        match (alms, maps.as_mut_slice()) {
            ([(_, t), (_, e), (_, b)], [(_, i), (_, q), (_, u)]) => {
                plan.synthesis_mixed(&[t], &[[e, b]], &mut [i], &mut [[q, u]])?;
            }
            ([(_, e), (_, b)], [(_, q), (_, u)]) => plan.synthesis_spin2(e, b, q, u)?,
            ([(_, t)], [(_, i)]) => plan.synthesis(t, i)?,
            _ => {}
        }
        Ok(maps)
    }

    /// The plan of the input (0) or output (1).
    fn plan(&mut self, which: usize) -> Result<&mut ShtPlan> {
        let nside = [self.from, self.to][which];
        let which = if self.to == self.from { 0 } else { which };
        let slot = &mut self.plans[which];
        if slot.is_none() {
            *slot = Some(ShtPlan::new(
                Nside::new(nside.into())?,
                self.lmax,
                self.level,
            )?);
        }
        slot.as_mut()
            .ok_or_else(|| Error::usage("no transform can be made"))
    }
}
