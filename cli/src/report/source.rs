//! The run that a report is about, and what several figures need of it.

use super::figure::MapPanel;
use crate::config::Config;
use crate::cut_sky::{Mask, mask};
use crate::error::{Error, Result};
use crate::io::Run;
use crate::kernels::healpix::missing::{MISSING, is_missing};
use crate::kernels::healpix::{Nside, resample};
use crate::kernels::simd::Level;
use crate::plot::{Colours, Scale, View};
use crate::replay;
use crate::sht::{Harmonics, ShtPlan, StokesView};
use crate::stages::emission::{Model, Stokes, monochromatic};
use std::collections::BTreeMap;

/// Beam of the map from which masks are made, radians: masks follow the large scales.
const MASK_BEAM: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// Maps are shown at this resolution at most: half a million screen pixels hold no more.
const SHOWN_NSIDE: u32 = 256;

/// What may be chosen about a report.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Percentages of the sky on which spectra of layers are measured, besides the whole.
    pub sky_percent: Vec<f64>,
    /// Percentage of the sky on which maps are correlated.
    pub correlation_percent: f64,
    /// Further percentages for the correlation between frequencies.
    pub fractions_percent: Vec<f64>,
    /// Width of the edges of masks, degrees.
    pub apodise_deg: f64,
    /// A mask of the user's own, on the run's grid, in place of the one of `correlation_percent`.
    pub mask: Option<Mask>,
    /// Multipoles per band of decoupled spectra; none = no such figure.
    pub master_band: Option<usize>,
}

impl Default for Options {
    /// The paper's fractions of the sky.
    fn default() -> Self {
        Self {
            sky_percent: vec![75.0, 25.0],
            correlation_percent: 70.0,
            fractions_percent: vec![50.0, 25.0],
            apodise_deg: 2.0,
            mask: None,
            master_band: None,
        }
    }
}

/// The run and what was computed of it so far.
pub(super) struct Source<'a> {
    pub(super) run: &'a Run,
    pub(super) config: Config,
    pub(super) options: &'a Options,
    pub(super) nside: Nside,
    pub(super) lmax: usize,
    pub(super) layers: usize,
    pub(super) level: Level,
    /// Transforms on the run's grid up to its band limit.
    pub(super) plan: ShtPlan,
    /// I, Q, U observed at 353 GHz.
    pub(super) observed: Stokes,
    /// I, Q, U of the sum of the templates.
    pub(super) total: Stokes,
    /// a_lm of both, whole sky.
    pub(super) observed_alm: Harmonics,
    pub(super) total_alm: Harmonics,
    masks: BTreeMap<(u64, u64), Mask>,
}

impl<'a> Source<'a> {
    pub(super) fn new(run: &'a Run, options: &'a Options, level: Level) -> Result<Self> {
        let manifest = &run.manifest;
        let nside = Nside::new(manifest.nside.into())?;
        let lmax = manifest.lmax.unwrap_or(2 * manifest.nside as usize);
        let mut plan = ShtPlan::new(nside, lmax, level)?;
        let stokes = |name: &str| -> Result<Stokes> {
            Ok([
                run.map(&format!("observations/I{name}"))?.values,
                run.map(&format!("observations/Q{name}"))?.values,
                run.map(&format!("observations/U{name}"))?.values,
            ])
        };
        let observed = stokes("_353")?;
        let mut total: Stokes = std::array::from_fn(|_| vec![0.0; plan.npix()]);
        for number in 1..=run.layers() {
            for (letter, total) in ["I", "Q", "U"].into_iter().zip(&mut total) {
                let map = run.map(&format!("templates/{letter}_{number}"))?.values;
                for (sum, x) in total.iter_mut().zip(&map) {
                    *sum += x;
                }
            }
        }
        let both = Harmonics::of_all(
            &mut plan,
            &[
                observed.each_ref().map(Vec::as_slice),
                total.each_ref().map(Vec::as_slice),
            ],
            None,
        )?;
        let [observed_alm, total_alm]: [Harmonics; 2] = both
            .try_into()
            .map_err(|_| Error::input("two skies were analysed"))?;
        Ok(Self {
            config: manifest.config.clone().unwrap_or_default(),
            layers: run.layers(),
            masks: BTreeMap::new(),
            run,
            options,
            nside,
            lmax,
            level,
            plan,
            observed,
            total,
            observed_alm,
            total_alm,
        })
    }

    pub(super) fn map(&self, stem: &str) -> Result<Vec<f64>> {
        Ok(self.run.map(stem)?.values)
    }

    /// The maps `stem`_1 … N.
    pub(super) fn maps(&self, stem: &str) -> Result<Vec<Vec<f64>>> {
        (1..=self.layers)
            .map(|number| self.map(&format!("{stem}_{number}")))
            .collect()
    }

    /// Whether the run kept the maps `stem`_1 … N.
    pub(super) fn kept(&self, stem: &str) -> bool {
        (1..=self.layers).all(|number| self.run.holds(&format!("{stem}_{number}")))
    }

    /// I, Q, U observed at a frequency, where the run has all three and none of their pixels is missing.
    pub(super) fn observed_at(&self, ghz: u32) -> Result<Option<Stokes>> {
        let stems = ["I", "Q", "U"].map(|letter| format!("observations/{letter}_{ghz}"));
        if !stems.iter().all(|stem| self.run.holds(stem)) {
            return Ok(None);
        }
        let mut stokes: Stokes = std::array::from_fn(|_| Vec::new());
        for (map, stem) in stokes.iter_mut().zip(&stems) {
            *map = self.map(stem)?;
        }
        let whole = stokes.iter().flatten().all(|value| !is_missing(*value));
        Ok(whole.then_some(stokes))
    }

    /// I, Q, U of a model at some frequencies (GHz), from the templates and laws.
    pub(super) fn emission(&self, model: Model, ghz: &[f64]) -> Result<Vec<Stokes>> {
        let bands = ghz
            .iter()
            .map(|&nu| monochromatic(nu))
            .collect::<std::result::Result<Vec<_>, _>>()?;
        replay::emission(self.run, model, &bands, self.level, &mut Vec::new(), || {})
    }

    /// The faintest `percent` of the sky on the grid of Nside `nside`, its edges apodised; 100 = the whole.
    pub(super) fn sky(&mut self, percent: f64, nside: Nside) -> Result<Mask> {
        let key = (percent.to_bits(), nside.get());
        if let Some(mask) = self.masks.get(&key) {
            return Ok(mask.clone());
        }
        let mask = if percent >= 100.0 {
            Mask::whole(nside.npix() as usize)
        } else {
            let lmax = self.lmax.min(2 * nside.get() as usize);
            let mut to = ShtPlan::new(nside, lmax, self.level)?;
            let smooth = mask::smoothed_alm(&self.observed_alm.t, self.lmax, MASK_BEAM, &mut to)?;
            Mask::faintest(&smooth, percent / 100.0).apodised(
                nside,
                self.options.apodise_deg.to_radians(),
                self.level,
            )?
        };
        self.masks.insert(key, mask.clone());
        Ok(mask)
    }

    /// The mask on which maps are correlated: the user's, or the faintest sky.
    pub(super) fn correlation_mask(&mut self, nside: Nside) -> Result<Mask> {
        match &self.options.mask {
            None => self.sky(self.options.correlation_percent, nside),
            Some(mask) => {
                let mut weight = vec![0.0; nside.npix() as usize];
                resample::degrade_ring(self.level, self.nside, nside, &mask.weight, &mut weight)?;
                Ok(Mask { weight })
            }
        }
    }

    /// The masks made so far, with a name each.
    pub(super) fn masks(&self) -> impl Iterator<Item = (String, u32, &Mask)> {
        self.masks
            .iter()
            .filter(|((percent, _), _)| f64::from_bits(*percent) < 100.0)
            .map(|((percent, nside), mask)| {
                let percent = f64::from_bits(*percent);
                (
                    format!("masks/sky_{percent}_nside{nside}"),
                    *nside as u32,
                    mask,
                )
            })
    }

    /// A map to be shown: the whole sky.
    pub(super) fn panel(
        &self,
        values: &[f64],
        title: impl Into<String>,
        show: Show,
    ) -> Result<MapPanel> {
        panel(self.nside, values, title, show, self.level)
    }
}

/// The usual ways to show a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Show {
    /// Positive, of large range, MJy/sr.
    Intensity,
    /// Signed, of large range, MJy/sr.
    Signed,
    /// A difference, MJy/sr.
    Difference,
    /// Positive, of large range, of this unit.
    Positive(&'static str),
    /// Evenly over the values, of this unit.
    Even(&'static str),
}

/// I, Q, U, borrowed.
pub(super) fn views(stokes: &Stokes) -> StokesView<'_> {
    stokes.each_ref().map(Vec::as_slice)
}

/// A map of the whole sky to be shown.
pub(super) fn panel(
    nside: Nside,
    values: &[f64],
    title: impl Into<String>,
    show: Show,
    level: Level,
) -> Result<MapPanel> {
    let values: Vec<f64> = values
        .iter()
        .map(|&value| if is_missing(value) { MISSING } else { value })
        .collect();
    let (nside, values) = if nside.get() > SHOWN_NSIDE.into() {
        let to = Nside::new(SHOWN_NSIDE.into())?;
        let mut small = vec![0.0; to.npix() as usize];
        resample::degrade_ring(level, nside, to, &values, &mut small)?;
        (SHOWN_NSIDE, small)
    } else {
        (nside.get() as u32, values)
    };
    let (scale, colours, unit) = look(&values, show);
    Ok(MapPanel {
        nside,
        values,
        title: title.into(),
        unit,
        scale,
        colours,
        view: View::Mollweide,
    })
}

/// Scale, colours and unit of values shown in a way.
pub(super) fn look(values: &[f64], show: Show) -> (Scale, Colours, &'static str) {
    match show {
        Show::Intensity => (Scale::symlog_of(values), Colours::Inferno, "MJy/sr"),
        Show::Signed => (symmetric(values), Colours::Planck, "MJy/sr"),
        Show::Difference => (symmetric(values), Colours::Diverging, "MJy/sr"),
        Show::Positive(unit) => (Scale::symlog_of(values), Colours::Inferno, unit),
        Show::Even(unit) => (Scale::linear_of(values), Colours::Planck, unit),
    }
}

/// A symmetric-log scale about zero, whatever the signs of the values, over at most four decades.
fn symmetric(values: &[f64]) -> Scale {
    match Scale::symlog_of(values) {
        Scale::SymLog { max, threshold, .. } => Scale::SymLog {
            min: -max,
            max,
            threshold: threshold.max(1e-3 * max),
        },
        scale @ Scale::Linear { .. } => scale,
    }
}
