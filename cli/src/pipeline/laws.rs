//! Emission laws of the layers, calibrated.

use super::{Realisation, records};
use crate::Error;
use crate::stages::laws::sky::{BETA_FLOOR, T_FLOOR, TotalFit, mean_std};
use crate::stages::laws::{
    self, Calibration, CalibrationStatus, Factors, LawStats, ObservedLaws, Sky,
};
use crate::store::Stored;
use rayon::prelude::*;

/// Pixels that the calibration looks at first.
const SAMPLE_PIXELS: usize = 65_536;

/// T and β of every layer.
pub(super) struct Laws {
    pub(super) t: Vec<Stored>,
    pub(super) beta: Vec<Stored>,
    pub(super) factors: Factors,
    pub(super) fit: TotalFit,
}

/// Fluctuations of the laws, whole and in the pixels of the sample.
#[derive(Default)]
struct Drawn {
    whole: Vec<Stored>,
    sample: Vec<Stored>,
}

impl Realisation<'_> {
    /// Draws the laws, calibrates and writes them.
    pub(super) fn laws(&mut self, templates: &[[Stored; 3]]) -> Result<Laws, Error> {
        let config = self.config;
        let count = templates.len();
        self.progress.stage("emission laws", count as u64);
        let observed = match self.base.laws.take() {
            Some(observed) => observed,
            None => self.measure()?,
        };
        let npix = self.base.nside.npix() as usize;
        // A stride that shares no factor with the length of a ring meets every longitude.
        let stride = (npix / SAMPLE_PIXELS).max(1) | 1;
        let pick = |map: &[f64]| Stored::Memory(map.iter().copied().step_by(stride).collect());
        let (mut t, mut beta) = (Drawn::default(), Drawn::default());
        for number in 1..=count {
            let (dt, db) = laws::draw(
                &mut self.base.plan,
                &observed,
                config.seed,
                number,
                config.laws.refilter_iterations,
            )?;
            for (drawn, map) in [(&mut t, dt), (&mut beta, db)] {
                drawn.sample.push(pick(&map));
                drawn.whole.push(self.base.store.keep(map)?);
            }
            self.progress.advance(1);
        }
        let statistics = observed.statistics;
        if self.base.options.reuse {
            self.base.laws = Some(observed);
        }

        self.progress.stage("calibration", 4);
        self.manifest.mbb_fit_observed = Some(records::fit(&statistics));
        let fit = TotalFit::new(&config.fit)?;
        let calibration = self.calibrate(templates, &t, &beta, &pick, &fit, &statistics)?;
        self.manifest.mbb_fit_total = Some(records::fit(&calibration.fit.laws));
        self.manifest.counts.unconverged_fits = calibration.fit.unconverged;

        let factors = calibration.factors;
        let averages = self.base.averages.clone();
        let scaled: Vec<f64> = averages.t.iter().map(|t| factors.avg * t).collect();
        let (t, t_stats) = self.apply(t.whole, &scaled, factors.t, Kind::Temperature)?;
        let (beta, beta_stats) =
            self.apply(beta.whole, &averages.beta, factors.beta, Kind::Index)?;
        self.manifest.laws = Some(records::laws(&calibration, &t_stats, &beta_stats));
        Ok(Laws {
            t,
            beta,
            factors,
            fit,
        })
    }

    fn measure(&mut self) -> Result<ObservedLaws, Error> {
        let base = &mut *self.base;
        let (t, beta) = (base.t.whole()?, base.beta.whole()?);
        ObservedLaws::measure(&mut base.plan, &t, &beta, base.laws_nside)
    }

    /// Finds the factors of the laws, or takes those given.
    fn calibrate(
        &self,
        templates: &[[Stored; 3]],
        t: &Drawn,
        beta: &Drawn,
        pick: &dyn Fn(&[f64]) -> Stored,
        fit: &TotalFit,
        statistics: &LawStats,
    ) -> Result<Calibration, Error> {
        let config = &self.config.laws;
        let level = self.base.options.level;
        let whole = Sky {
            intensity: templates.iter().map(|[i, ..]| i).collect(),
            t: t.whole.iter().collect(),
            beta: beta.whole.iter().collect(),
            averages: &self.base.averages,
            level,
        };
        if !config.calibrate {
            let factors = Factors {
                avg: config.s_avg,
                t: config.s_t,
                beta: config.s_beta,
            };
            return Ok(Calibration {
                factors,
                status: CalibrationStatus::Given,
                fit: whole.fit(fit, &factors)?,
            });
        }
        let picked = templates
            .iter()
            .map(|[i, ..]| Ok(pick(&i.whole()?)))
            .collect::<Result<Vec<_>, Error>>()?;
        let sample = Sky {
            intensity: picked.iter().collect(),
            t: t.sample.iter().collect(),
            beta: beta.sample.iter().collect(),
            averages: &self.base.averages,
            level,
        };
        laws::calibrate(&sample, &whole, fit, statistics, self.progress)
    }

    /// Turns fluctuations into laws, writes them, and returns them with the mean and standard deviation of each.
    fn apply(
        &mut self,
        fluctuations: Vec<Stored>,
        averages: &[f64],
        factor: f64,
        kind: Kind,
    ) -> Result<(Vec<Stored>, Vec<(f64, f64)>), Error> {
        let (stem, quantity, unit, floor) = match kind {
            Kind::Temperature => ("laws/T", "dust temperature of the layer", "K", T_FLOOR),
            Kind::Index => ("laws/beta", "spectral index of the layer", "", BETA_FLOOR),
        };
        let (writer, dtype) = (self.writer, self.config.output.dtype);
        let store = &self.base.store;
        // Layers side by side, because writing is half of the time.
        let (floored, made): (Vec<u64>, Vec<_>) = fluctuations
            .into_par_iter()
            .zip(averages)
            .enumerate()
            .map(|(i, (map, &average))| {
                let mut map = map.take()?;
                let floored = laws::apply(&mut map, average, factor, floor);
                let statistics = mean_std(&map);
                let stem = format!("{stem}_{}", i + 1);
                writer.map(&stem, quantity, unit, &map, dtype)?;
                Ok((floored, (store.keep(map)?, statistics)))
            })
            .collect::<Result<Vec<_>, Error>>()?
            .into_iter()
            .unzip();
        self.manifest.counts.floored_laws += floored.iter().sum::<u64>();
        Ok(made.into_iter().unzip())
    }
}

#[derive(Clone, Copy)]
enum Kind {
    Temperature,
    Index,
}
