//! The layers of a finished run, one at a time, with the emission laws of a model.

use crate::error::{Error, Result};
use crate::io::Run;
use crate::io::manifest::InputRecord;
use crate::kernels::healpix::missing::is_missing;
use crate::stages::emission::{Law, Layer, Model, Stokes};
use crate::stages::laws::sky::mean_std;

/// A layer with its law, read from the run.
pub(super) struct LayerMaps {
    /// I, Q, U at ν₀, MJy/sr.
    pub(super) stokes: Stokes,
    /// Its law.
    pub(super) law: LawMaps,
}

/// The law of a layer.
pub(super) enum LawMaps {
    /// Temperature and spectral index per pixel.
    Maps { t: Vec<f64>, beta: Vec<f64> },
    /// One of each for the whole sky.
    Uniform { t: f64, beta: f64 },
}

impl LayerMaps {
    /// The same, borrowed.
    pub(super) fn view(&self) -> Layer<'_> {
        Layer {
            stokes: self.stokes.each_ref().map(Vec::as_slice),
            law: match &self.law {
                LawMaps::Maps { t, beta } => Law::Maps { t, beta },
                &LawMaps::Uniform { t, beta } => Law::Uniform { t, beta },
            },
        }
    }
}

/// How many layers `run` has.
pub(super) fn layer_count(run: &Run) -> usize {
    run.manifest.layers.unwrap_or(0)
}

/// Gives every layer of `model` to `visit`: those of the run, or their sum for [`Model::TwoD`]. What was read is added to
/// `inputs`; `step` is called after each layer of the run.
pub(super) fn each_layer(
    run: &Run,
    model: Model,
    inputs: &mut Vec<InputRecord>,
    mut step: impl FnMut(),
    mut visit: impl FnMut(&LayerMaps) -> Result<()>,
) -> Result<()> {
    let mut read = |stem: String| -> Result<Vec<f64>> {
        let record = run.record(&stem)?;
        inputs.push(InputRecord {
            name: stem.clone(),
            path: Some(run.dir.join(&record.path).display().to_string()),
            nside: record.nside.unwrap_or(run.manifest.nside),
            unit: record.unit.clone().unwrap_or_default(),
            blake3: record.blake3.clone(),
        });
        Ok(run.map(&stem)?.values)
    };
    let mut sum: Option<Stokes> = None;
    for number in 1..=layer_count(run) {
        let mut stokes: Stokes = std::array::from_fn(|_| Vec::new());
        for (letter, map) in ["I", "Q", "U"].into_iter().zip(&mut stokes) {
            *map = read(format!("templates/{letter}_{number}"))?;
        }
        let law = match model {
            Model::ThreeD => LawMaps::Maps {
                t: read(format!("laws/T_{number}"))?,
                beta: read(format!("laws/beta_{number}"))?,
            },
            Model::Uniform => uniform_law(run, number)?,
            Model::TwoD => {
                add_to(&mut sum, stokes);
                step();
                continue;
            }
        };
        visit(&LayerMaps { stokes, law })?;
        step();
    }
    let Some(stokes) = sum else {
        return Ok(());
    };
    let (mut t, mut beta) = (
        read("observations/T".to_owned())?,
        read("observations/beta".to_owned())?,
    );
    for map in [&mut t, &mut beta] {
        let (mean, _) = mean_std(map);
        for value in map.iter_mut().filter(|value| is_missing(**value)) {
            *value = mean;
        }
    }
    visit(&LayerMaps {
        stokes,
        law: LawMaps::Maps { t, beta },
    })
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

/// (s_avg T_avg, β_avg) of a layer.
fn uniform_law(run: &Run, number: usize) -> Result<LawMaps> {
    let manifest = &run.manifest;
    let law = manifest
        .laws
        .as_ref()
        .zip(manifest.layer_averages.as_ref())
        .and_then(|(laws, averages)| {
            Some(LawMaps::Uniform {
                t: laws.s_avg * averages.t.get(number - 1)?,
                beta: *averages.beta.get(number - 1)?,
            })
        });
    law.ok_or_else(|| {
        Error::input(format!(
            "the manifest of `{}` lacks the averages of layer {number}; make the run again",
            run.dir.display()
        ))
    })
}
