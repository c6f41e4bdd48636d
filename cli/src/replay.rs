//! What a finished run emits: its templates and laws read back, layer by layer, in any bands.

use crate::error::{Error, Result};
use crate::io::Run;
use crate::io::manifest::InputRecord;
use crate::kernels::healpix::missing::is_missing;
use crate::kernels::planck::mbb::MbbNode;
use crate::kernels::simd::Level;
use crate::stages::emission::{Law, Layer, Model, Stokes, add_layer};
use crate::stages::laws::sky::mean_std;

/// I, Q, U in every band, from the templates and laws of the run. `read` hears of every file before it is read, `layer`
/// of every layer that is done.
///
/// # Errors
/// A file that is not there, or not as it was when the run was made.
pub fn emission(
    run: &Run,
    model: Model,
    bands: &[Vec<MbbNode>],
    level: Level,
    mut read: impl FnMut(InputRecord),
    mut layer: impl FnMut(),
) -> Result<Vec<Stokes>> {
    let npix = 12 * (run.manifest.nside as usize).pow(2);
    let mut out: Vec<Stokes> = bands
        .iter()
        .map(|_| std::array::from_fn(|_| vec![0.0; npix]))
        .collect();
    let mut map = |stem: String| -> Result<Vec<f64>> {
        let record = run.record(&stem)?;
        read(InputRecord {
            name: stem.clone(),
            path: Some(run.dir.join(&record.path).display().to_string()),
            nside: record.nside.unwrap_or(run.manifest.nside),
            unit: record.unit.clone().unwrap_or_default(),
            blake3: record.blake3.clone(),
        });
        Ok(run.map(&stem)?.values)
    };
    let mut sum: Option<Stokes> = None;
    for number in 1..=run.layers() {
        let mut stokes: Stokes = std::array::from_fn(|_| Vec::new());
        for (letter, slot) in ["I", "Q", "U"].into_iter().zip(&mut stokes) {
            *slot = map(format!("templates/{letter}_{number}"))?;
        }
        let views = stokes.each_ref().map(Vec::as_slice);
        match model {
            Model::ThreeD => {
                let (t, beta) = (
                    map(format!("laws/T_{number}"))?,
                    map(format!("laws/beta_{number}"))?,
                );
                let law = Law::Maps { t: &t, beta: &beta };
                add_layer(level, bands, &Layer { stokes: views, law }, &mut out)?;
            }
            Model::Uniform => {
                let (t, beta) = uniform_law(run, number)?;
                let law = Law::Uniform { t, beta };
                add_layer(level, bands, &Layer { stokes: views, law }, &mut out)?;
            }
            Model::TwoD => match &mut sum {
                None => sum = Some(stokes),
                Some(sum) => {
                    for (total, part) in sum.iter_mut().flatten().zip(stokes.iter().flatten()) {
                        *total += part;
                    }
                }
            },
        }
        layer();
    }
    if let Some(sum) = sum {
        let (mut t, mut beta) = (
            map("observations/T".to_owned())?,
            map("observations/beta".to_owned())?,
        );
        for map in [&mut t, &mut beta] {
            let (mean, _) = mean_std(map);
            for value in map.iter_mut().filter(|value| is_missing(**value)) {
                *value = mean;
            }
        }
        let law = Law::Maps { t: &t, beta: &beta };
        let stokes = sum.each_ref().map(Vec::as_slice);
        add_layer(level, bands, &Layer { stokes, law }, &mut out)?;
    }
    Ok(out)
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
