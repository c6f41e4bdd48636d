//! A finished run read back: its layers with the emission laws of a model, whole or slab by slab, and what they emit.

use crate::error::{Error, Result};
use crate::io::Run;
use crate::io::manifest::InputRecord;
use crate::io::run::MapStream;
use crate::kernels::healpix::missing::is_missing;
use crate::kernels::planck::mbb::MbbNode;
use crate::kernels::simd::Level;
use crate::stages::emission::{Law, Layer, Model, Stokes, blank, layers_into};
use crate::stages::laws::sky::mean_std;
use crate::store::slabs;
use rayon::prelude::*;
use std::ops::RangeInclusive;

/// A layer with its law, read from the run.
pub struct LayerMaps {
    /// I, Q, U at ν₀, MJy/sr.
    pub stokes: Stokes,
    /// Its law.
    pub law: LawMaps,
}

/// The law of a layer.
pub enum LawMaps {
    /// Temperature and spectral index per pixel.
    Maps {
        /// Kelvin.
        t: Vec<f64>,
        /// Dimensionless.
        beta: Vec<f64>,
    },
    /// One of each for the whole sky.
    Uniform {
        /// Kelvin.
        t: f64,
        /// Dimensionless.
        beta: f64,
    },
}

impl LayerMaps {
    /// The same, borrowed.
    #[must_use]
    pub fn view(&self) -> Layer<'_> {
        Layer {
            stokes: self.stokes.each_ref().map(Vec::as_slice),
            law: match &self.law {
                LawMaps::Maps { t, beta } => Law::Maps { t, beta },
                &LawMaps::Uniform { t, beta } => Law::Uniform { t, beta },
            },
        }
    }

    /// Puts the next pixels at the end.
    fn append(&mut self, next: &Self) {
        for (map, piece) in self.stokes.iter_mut().zip(&next.stokes) {
            map.extend_from_slice(piece);
        }
        if let (
            LawMaps::Maps { t, beta },
            LawMaps::Maps {
                t: next_t,
                beta: next_beta,
            },
        ) = (&mut self.law, &next.law)
        {
            t.extend_from_slice(next_t);
            beta.extend_from_slice(next_beta);
        }
    }
}

/// Gives every layer of `model` to `visit`, whole: those of the run, or their sum for [`Model::TwoD`]. What was read is
/// added to `inputs`; `step` is called after each layer of the run.
///
/// # Errors
/// A file that is not there, or not as it was when the run was made; or what `visit` fails with.
pub fn each_layer(
    run: &Run,
    model: Model,
    inputs: &mut Vec<InputRecord>,
    mut step: impl FnMut(),
    mut visit: impl FnMut(&LayerMaps) -> Result<()>,
) -> Result<()> {
    let numbers = 1..=run.layers();
    let groups: Vec<RangeInclusive<usize>> = match model {
        Model::ThreeD | Model::Uniform => numbers.map(|number| number..=number).collect(),
        Model::TwoD => vec![numbers],
    };
    for numbers in groups {
        let mut stream = LayerStream::open(run, model, numbers.clone(), inputs)?;
        let mut whole: Option<LayerMaps> = None;
        for slab in slabs(run.npix()) {
            for piece in stream.next(slab.len())? {
                match &mut whole {
                    None => whole = Some(piece),
                    Some(whole) => whole.append(&piece),
                }
            }
        }
        stream.finish()?;
        if let Some(layer) = whole {
            visit(&layer)?;
        }
        numbers.for_each(|_| step());
    }
    Ok(())
}

fn add_to(sum: &mut Option<Stokes>, stokes: Stokes) {
    match sum {
        None => *sum = Some(stokes),
        Some(sum) => {
            for (total, part) in sum.iter_mut().flatten().zip(stokes.iter().flatten()) {
                *total += part;
            }
        }
    }
}

/// (s_avg T_avg, β_avg) of a layer, counted from 1.
///
/// # Errors
/// A manifest without them.
pub fn uniform_law(run: &Run, number: usize) -> Result<(f64, f64)> {
    let manifest = &run.manifest;
    let law = manifest
        .laws
        .as_ref()
        .zip(manifest.layer_averages.as_ref())
        .and_then(|(laws, averages)| {
            Some((
                laws.s_avg * averages.t.get(number - 1)?,
                *averages.beta.get(number - 1)?,
            ))
        });
    law.ok_or_else(|| {
        Error::input(format!(
            "the manifest of `{}` lacks the averages of layer {number}; make the run again",
            run.dir.display()
        ))
    })
}

/// What the manifest says of a map that is read.
fn input_record(run: &Run, stem: &str) -> Result<InputRecord> {
    let record = run.record(stem)?;
    Ok(InputRecord {
        name: stem.to_owned(),
        path: Some(run.dir.join(&record.path).display().to_string()),
        nside: record.nside.unwrap_or(run.manifest.nside),
        unit: record.unit.clone().unwrap_or_default(),
        blake3: record.blake3.clone(),
    })
}

fn fill_with_mean(map: &mut [f64]) {
    let (mean, _) = mean_std(map);
    for value in map.iter_mut().filter(|value| is_missing(**value)) {
        *value = mean;
    }
}

/// Layers of a run, slab by slab: a few megabytes at a time, however large the maps.
pub struct LayerStream {
    layers: Vec<([MapStream; 3], LawStream)>,
    /// For [`Model::TwoD`]: the whole T and β of the sum, and how much of them is used.
    sum: Option<(Vec<f64>, Vec<f64>, usize)>,
}

enum LawStream {
    Maps(Box<[MapStream; 2]>),
    Uniform {
        t: f64,
        beta: f64,
    },
    /// The layer is only added to the sum.
    None,
}

impl LayerStream {
    /// Opens the maps of `model` in the layers `numbers`, counted from 1; they are added to `inputs`.
    ///
    /// # Errors
    /// The run does not hold one of them.
    pub fn open(
        run: &Run,
        model: Model,
        numbers: RangeInclusive<usize>,
        inputs: &mut Vec<InputRecord>,
    ) -> Result<Self> {
        let mut open = |stem: String| -> Result<MapStream> {
            inputs.push(input_record(run, &stem)?);
            run.stream(&stem)
        };
        let mut layers = Vec::new();
        for number in numbers {
            let stokes = [
                open(format!("templates/I_{number}"))?,
                open(format!("templates/Q_{number}"))?,
                open(format!("templates/U_{number}"))?,
            ];
            let law = match model {
                Model::ThreeD => LawStream::Maps(Box::new([
                    open(format!("laws/T_{number}"))?,
                    open(format!("laws/beta_{number}"))?,
                ])),
                Model::Uniform => {
                    let (t, beta) = uniform_law(run, number)?;
                    LawStream::Uniform { t, beta }
                }
                Model::TwoD => LawStream::None,
            };
            layers.push((stokes, law));
        }
        let sum = if model == Model::TwoD {
            let mut whole = |stem: &str| -> Result<Vec<f64>> {
                inputs.push(input_record(run, stem)?);
                let mut map = run.map(stem)?.values;
                fill_with_mean(&mut map);
                Ok(map)
            };
            Some((whole("observations/T")?, whole("observations/beta")?, 0))
        } else {
            None
        };
        Ok(Self { layers, sum })
    }

    /// Every layer in the next `count` pixels, or their sum.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn next(&mut self, count: usize) -> Result<Vec<LayerMaps>> {
        let read = |(stokes, law): &mut ([MapStream; 3], LawStream)| -> Result<_> {
            let [i, q, u] = stokes;
            let stokes = [i.next(count)?, q.next(count)?, u.next(count)?];
            let law = match law {
                LawStream::Maps(maps) => {
                    let [t, beta] = &mut **maps;
                    Some(LawMaps::Maps {
                        t: t.next(count)?,
                        beta: beta.next(count)?,
                    })
                }
                &mut LawStream::Uniform { t, beta } => Some(LawMaps::Uniform { t, beta }),
                LawStream::None => None,
            };
            Ok((stokes, law))
        };
        // Files are read and converted side by side; the order of what comes back is that of the layers.
        let slabs: Vec<(Stokes, Option<LawMaps>)> = self
            .layers
            .par_iter_mut()
            .map(read)
            .collect::<Result<_>>()?;
        let mut layers = Vec::new();
        let mut sum: Option<Stokes> = None;
        for (stokes, law) in slabs {
            match law {
                Some(law) => layers.push(LayerMaps { stokes, law }),
                None => add_to(&mut sum, stokes),
            }
        }
        if let (Some(stokes), Some((t, beta, used))) = (sum, &mut self.sum) {
            let range = *used..*used + count;
            *used += count;
            layers.push(LayerMaps {
                stokes,
                law: LawMaps::Maps {
                    t: t[range.clone()].to_vec(),
                    beta: beta[range].to_vec(),
                },
            });
        }
        Ok(layers)
    }

    /// Checks that every map, now read, is as the run wrote it.
    ///
    /// # Errors
    /// One is not.
    pub fn finish(self) -> Result<()> {
        for (stokes, law) in self.layers {
            for map in stokes {
                map.finish()?;
            }
            if let LawStream::Maps(maps) = law {
                for map in *maps {
                    map.finish()?;
                }
            }
        }
        Ok(())
    }
}

/// Gives I, Q, U of every band to `take`, slab by slab. What is read is added to `inputs`; `step` is called after each
/// slab.
///
/// # Errors
/// A file that is not there, or not as it was when the run was made; or what `take` fails with.
pub fn each_slab(
    run: &Run,
    model: Model,
    bands: &[Vec<MbbNode>],
    level: Level,
    inputs: &mut Vec<InputRecord>,
    mut step: impl FnMut(),
    mut take: impl FnMut(&[Stokes]) -> Result<()>,
) -> Result<()> {
    let mut layers = LayerStream::open(run, model, 1..=run.layers(), inputs)?;
    let mut out = blank(bands.len());
    for slab in slabs(run.npix()) {
        let layers = layers.next(slab.len())?;
        let views: Vec<Layer<'_>> = layers.iter().map(LayerMaps::view).collect();
        layers_into(level, bands, &views, slab.len(), &mut out)?;
        take(&out)?;
        step();
    }
    layers.finish()
}

/// I, Q, U of every band, whole.
///
/// # Errors
/// As [`each_slab`].
pub fn emission(
    run: &Run,
    model: Model,
    bands: &[Vec<MbbNode>],
    level: Level,
    inputs: &mut Vec<InputRecord>,
    step: impl FnMut(),
) -> Result<Vec<Stokes>> {
    let mut whole: Vec<Stokes> = bands
        .iter()
        .map(|_| std::array::from_fn(|_| Vec::with_capacity(run.npix())))
        .collect();
    each_slab(run, model, bands, level, inputs, step, |slab| {
        for (map, piece) in whole.iter_mut().flatten().zip(slab.iter().flatten()) {
            map.extend_from_slice(piece);
        }
        Ok(())
    })?;
    Ok(whole)
}
