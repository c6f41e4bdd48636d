//! Emission at the frequencies of the configuration, all three models, and the overview, in one pass over the sky.

use super::Realisation;
use super::laws::Laws;
use crate::Error;
use crate::io::output::MapWriter;
use crate::plot::overview::{self, Overview};
use crate::stages::emission::{self, Law, Layer, Model, Stokes};
use crate::stages::laws::sky::{Total, mean_std};
use crate::stages::regrid;
use crate::store::{Stored, slabs};
use dust3d_kernels::healpix::missing::{MISSING, is_missing};
use dust3d_kernels::healpix::{Nside, ring};
use rayon::prelude::*;
use std::borrow::Cow;
use std::ops::Range;

/// Finest grid of the overview's maps: finer than its picture's pixels.
const OVERVIEW_NSIDE: u64 = 256;

impl Realisation<'_> {
    pub(super) fn emission_and_overview(
        &mut self,
        templates: &[[Stored; 3]],
        laws: &Laws,
    ) -> Result<(), Error> {
        let nside = self.base.nside;
        let npix = nside.npix() as usize;
        let level = self.base.options.level;
        self.progress.stage("emission", slabs(npix).count() as u64);
        let bands = self
            .config
            .frequencies
            .iter()
            .map(|&nu| emission::monochromatic(nu))
            .collect::<Result<Vec<_>, _>>()?;
        let mut files = self.emission_files()?;
        let mean_t = mean(&self.base.t)?;
        let mean_beta = mean(&self.base.beta)?;
        let mut sum: Stokes = std::array::from_fn(|_| vec![0.0; npix]);
        let mut fitted = FittedPixels::new(nside)?;
        let mut maps = emission::blank(bands.len());
        for slab in slabs(npix) {
            let layers = templates
                .iter()
                .zip(laws.t.iter().zip(&laws.beta))
                .map(|(stokes, (t, beta))| SlabLayer::read(stokes, t, beta, &slab))
                .collect::<Result<Vec<_>, Error>>()?;
            for layer in &layers {
                for (sum, map) in sum.iter_mut().zip(&layer.stokes) {
                    add(&mut sum[slab.clone()], map);
                }
            }
            let total = sum.each_ref().map(|map| &map[slab.clone()]);
            let filled = |map: &Stored, mean: f64| -> Result<Vec<f64>, Error> {
                let values = map.view(slab.clone())?;
                let values = values.iter();
                Ok(values
                    .map(|&x| if is_missing(x) { mean } else { x })
                    .collect())
            };
            if !bands.is_empty() {
                let t = filled(&self.base.t, mean_t)?;
                let beta = filled(&self.base.beta, mean_beta)?;
                for (model, files) in Model::ALL.into_iter().zip(&mut files) {
                    let seen: Vec<Layer<'_>> = match model {
                        Model::ThreeD => layers.iter().map(SlabLayer::with_maps).collect(),
                        Model::Uniform => layers
                            .iter()
                            .enumerate()
                            .map(|(i, layer)| {
                                layer.with(Law::Uniform {
                                    t: laws.factors.avg * self.base.averages.t[i],
                                    beta: self.base.averages.beta[i],
                                })
                            })
                            .collect(),
                        Model::TwoD => vec![Layer {
                            stokes: total,
                            law: Law::Maps { t: &t, beta: &beta },
                        }],
                    };
                    emission::layers_into(level, &bands, &seen, slab.len(), &mut maps)?;
                    // Files side by side: writing takes longer than computing.
                    let maps: Vec<&Vec<f64>> = maps.iter().flatten().collect();
                    files
                        .par_iter_mut()
                        .zip(maps)
                        .try_for_each(|(file, map)| file.append(map))?;
                }
            }
            let pixels = fitted.within(&slab);
            let mut fit = Total::new(&laws.fit, pixels.len());
            for layer in &layers {
                let [i, t, beta] = [&layer.stokes[0], &layer.t, &layer.beta].map(|map| {
                    pixels
                        .iter()
                        .map(|p| map[p - slab.start])
                        .collect::<Vec<_>>()
                });
                fit.add(level, &i, &t, &beta)?;
            }
            fitted.put(pixels, |t, beta| fit.fit(level, t, beta))?;
            self.progress.advance(1);
        }
        files
            .into_iter()
            .flatten()
            .try_for_each(MapWriter::finish)?;

        self.progress.stage("overview", 1);
        let grid = fitted.nside;
        let [i, q, u] = sum.map(|map| regrid::scalar_owned(map, nside, grid, level));
        let (t, beta) = fitted.maps();
        let png = overview::render(&Overview {
            nside: self.config.nside,
            grid: grid.get() as u32,
            i: &i?,
            q: &q?,
            u: &u?,
            t: &t,
            beta: &beta,
        })?;
        self.writer
            .out
            .file("overview.png", "I, Q, U, T and beta of the total", &png)
    }

    /// The files of every model: frequency by frequency I, Q, U.
    fn emission_files(&self) -> Result<Vec<Vec<MapWriter<'_>>>, Error> {
        let of_model = |model: Model| {
            let mut files = Vec::new();
            for nu in &self.config.frequencies {
                for stokes in ["I", "Q", "U"] {
                    let stem = format!("emission/{}_{nu}GHz_{stokes}", model.name());
                    let quantity = format!("{stokes} at {nu} GHz, model {}", model.name());
                    files.push(self.writer.out.begin_map(
                        &stem,
                        &quantity,
                        "MJy/sr",
                        self.config.nside,
                        self.config.output.dtype,
                    )?);
                }
            }
            Ok(files)
        };
        Model::ALL.into_iter().map(of_model).collect()
    }
}

/// A layer and its laws in some pixels.
struct SlabLayer<'a> {
    stokes: [Cow<'a, [f64]>; 3],
    t: Cow<'a, [f64]>,
    beta: Cow<'a, [f64]>,
}

impl<'a> SlabLayer<'a> {
    fn read(
        [i, q, u]: &'a [Stored; 3],
        t: &'a Stored,
        beta: &'a Stored,
        slab: &Range<usize>,
    ) -> Result<Self, Error> {
        let read = |map: &'a Stored| map.view(slab.clone());
        Ok(Self {
            stokes: [read(i)?, read(q)?, read(u)?],
            t: read(t)?,
            beta: read(beta)?,
        })
    }

    fn with<'b>(&'b self, law: Law<'b>) -> Layer<'b> {
        Layer {
            stokes: self.stokes.each_ref().map(|map| &**map),
            law,
        }
    }

    fn with_maps(&self) -> Layer<'_> {
        self.with(Law::Maps {
            t: &self.t,
            beta: &self.beta,
        })
    }
}

fn add(sum: &mut [f64], map: &[f64]) {
    for (sum, x) in sum.iter_mut().zip(map) {
        *sum += x;
    }
}

/// Mean over the pixels that are not missing.
fn mean(map: &Stored) -> Result<f64, Error> {
    Ok(mean_std(&map.whole()?).0)
}

/// T and β fitted to the total at the pixel centres of the overview's grid.
struct FittedPixels {
    nside: Nside,
    /// (pixel of the working grid, pixel of the overview's), in order.
    pairs: Vec<(usize, usize)>,
    next: usize,
    t: Vec<f64>,
    beta: Vec<f64>,
}

impl FittedPixels {
    fn new(fine: Nside) -> Result<Self, Error> {
        let nside = Nside::new(fine.get().min(OVERVIEW_NSIDE))?;
        let npix = nside.npix() as usize;
        let mut pairs = (0..npix)
            .map(|p| {
                Ok((
                    ring::vec2pix(fine, ring::pix2vec(nside, p as u64)?)? as usize,
                    p,
                ))
            })
            .collect::<Result<Vec<_>, Error>>()?;
        pairs.sort_unstable();
        Ok(Self {
            nside,
            pairs,
            next: 0,
            t: vec![MISSING; npix],
            beta: vec![MISSING; npix],
        })
    }

    /// The pixels of the working grid in the next slab.
    fn within(&self, slab: &Range<usize>) -> Vec<usize> {
        let rest = self.pairs[self.next..].iter();
        rest.map(|&(fine, _)| fine)
            .take_while(|fine| *fine < slab.end)
            .collect()
    }

    /// Takes the fits in `pixels`, those of the last [`within`](Self::within).
    fn put(
        &mut self,
        pixels: Vec<usize>,
        fit: impl FnOnce(&mut [f64], &mut [f64]) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let (mut t, mut beta) = (vec![0.0; pixels.len()], vec![0.0; pixels.len()]);
        fit(&mut t, &mut beta)?;
        let targets = &self.pairs[self.next..self.next + pixels.len()];
        for (&(_, p), (t, beta)) in targets.iter().zip(t.into_iter().zip(beta)) {
            if !t.is_nan() {
                (self.t[p], self.beta[p]) = (t, beta);
            }
        }
        self.next += pixels.len();
        Ok(())
    }

    fn maps(self) -> (Vec<f64>, Vec<f64>) {
        (self.t, self.beta)
    }
}
