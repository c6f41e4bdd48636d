//! Small scales added to the layers: the templates.

use super::{Realisation, records};
use crate::Error;
use crate::sht::Harmonics;
use crate::stages::small_scales::{self, Fitted, StokesMaps};
use crate::store::{Store, Stored};
use num_complex::Complex;
use rayon::prelude::*;

/// What small scales know of a layer.
pub(super) struct Measured {
    alms: [Stored; 3],
    fitted: Fitted,
}

impl Measured {
    fn keep(store: &Store, harmonics: &Harmonics, fitted: &Fitted) -> Result<Self, Error> {
        let flat =
            |alm: &[Complex<f64>]| store.keep(alm.iter().flat_map(|c| [c.re, c.im]).collect());
        Ok(Self {
            alms: [
                flat(&harmonics.t)?,
                flat(&harmonics.e)?,
                flat(&harmonics.b)?,
            ],
            fitted: fitted.clone(),
        })
    }

    fn load(&self) -> Result<(Harmonics, Fitted), Error> {
        let alm = |stored: &Stored| -> Result<Vec<Complex<f64>>, Error> {
            let flat = stored.whole()?;
            let (pairs, _) = flat.as_chunks::<2>();
            Ok(pairs.iter().map(|&[re, im]| Complex::new(re, im)).collect())
        };
        let [t, e, b] = &self.alms;
        let harmonics = Harmonics {
            t: alm(t)?,
            e: alm(e)?,
            b: alm(b)?,
        };
        Ok((harmonics, self.fitted.clone()))
    }
}

impl Realisation<'_> {
    /// Adds small scales to the layers and writes the templates.
    pub(super) fn templates(&mut self) -> Result<Vec<[Stored; 3]>, Error> {
        let count = self.base.layers.len();
        self.progress.stage("small scales", count as u64);
        let dtype = self.config.output.dtype;
        let mut templates = Vec::with_capacity(count);
        for number in 1..=count {
            let layer = self.layer(number)?;
            let maps = if self.config.small_scales.enabled {
                self.with_small_scales(number, layer)?
            } else {
                layer
            };
            let (writer, store) = (self.writer, &self.base.store);
            let kept = [("I", maps.i), ("Q", maps.q), ("U", maps.u)]
                .into_par_iter()
                .map(|(stokes, map)| {
                    writer.map(
                        &format!("templates/{stokes}_{number}"),
                        "template of the layer at 353 GHz",
                        "MJy/sr",
                        &map,
                        dtype,
                    )?;
                    store.keep(map)
                })
                .collect::<Result<Vec<_>, Error>>()?;
            templates.extend(<[Stored; 3]>::try_from(kept));
            self.progress.advance(1);
        }
        Ok(templates)
    }

    /// The renormalised layer, counted from 1.
    fn layer(&mut self, number: usize) -> Result<StokesMaps, Error> {
        let gone =
            || Error::usage("the layers are used up; prepare with reuse for several realisations");
        let slot = &mut self.base.layers[number - 1];
        let [i, q, u] = if self.base.options.reuse {
            let [i, q, u] = slot.as_ref().ok_or_else(gone)?;
            let copy = |map: &Stored| Ok::<_, Error>(map.whole()?.into_owned());
            [copy(i)?, copy(q)?, copy(u)?]
        } else {
            let [i, q, u] = slot.take().ok_or_else(gone)?;
            [i.take()?, q.take()?, u.take()?]
        };
        Ok(StokesMaps { i, q, u })
    }

    fn with_small_scales(&mut self, number: usize, layer: StokesMaps) -> Result<StokesMaps, Error> {
        let config = &self.config.small_scales;
        let base = &mut *self.base;
        let (harmonics, fitted) = match &base.measured[number - 1] {
            Some(measured) => measured.load()?,
            None => {
                let (harmonics, fitted) =
                    small_scales::measure(&mut base.plan, config, base.reach, &layer)?;
                if base.options.reuse {
                    base.measured[number - 1] =
                        Some(Measured::keep(&base.store, &harmonics, &fitted)?);
                }
                (harmonics, fitted)
            }
        };
        let (maps, report) = small_scales::add_small_scales(
            &mut base.plan,
            config,
            self.config.seed,
            number,
            &layer,
            (&harmonics, &fitted),
        )?;
        self.manifest.counts.limited_pixels += report.limited_pixels;
        self.manifest
            .small_scales
            .push(records::small_scales(&report));
        if self.writer.keeps_all() {
            let csv = records::spectra_csv(&report);
            self.writer.out.file(
                &format!("spectra/layer_{number}.csv"),
                "spectra of the layer before and after small scales, (MJy/sr)^2",
                csv.as_bytes(),
            )?;
        }
        Ok(maps)
    }
}
