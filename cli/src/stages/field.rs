//! Polarisation fractions of each layer from the large-scale galactic field (\[MKD18\], section 4.2).
//!
//! The kernel is [`dust3d_kernels::field::line_of_sight`]; this stage runs it over the pixels of a map.

use crate::Error;
use crate::config::FieldConfig;
use crate::parallel;
use dust3d_kernels::field::line_of_sight::{ratios_into, ratios_scratch_len};
use dust3d_kernels::field::{Density, Grains, Model, Spiral};
use dust3d_kernels::healpix::{Nside, ring};
use dust3d_kernels::simd::Level;
use std::ops::Range;

/// The model of the field that a configuration describes, at some pitch angle.
#[must_use]
pub fn model(config: &FieldConfig, pitch_rad: f64) -> Model {
    Model {
        density: Density {
            h_r_kpc: config.h_r_kpc,
            h_z_kpc: config.h_z_kpc,
        },
        spiral: Spiral {
            pitch_rad,
            r_sun_kpc: config.r_sun_kpc,
            b0_ug: config.b0_ug,
            r0_kpc: config.r0_kpc,
            z0_kpc: config.z0_kpc,
            ..Spiral::default()
        },
        grains: Grains {
            p0: config.p0,
            k: config.k,
        },
    }
}

/// Unit vectors to the centres of some pixels of a RING map.
///
/// # Errors
/// If a pixel does not exist.
pub fn directions(
    nside: Nside,
    pixels: Range<usize>,
    level: Level,
) -> Result<Vec<[f64; 3]>, Error> {
    let pixels: Vec<u64> = pixels.map(|p| p as u64).collect();
    let mut components = [(); 3].map(|()| vec![0.0; pixels.len()]);
    ring::pix2vec_into(
        level,
        nside,
        &pixels,
        components.each_mut().map(Vec::as_mut_slice),
    )?;
    let [x, y, z] = components;
    Ok(x.into_iter()
        .zip(y.into_iter().zip(z))
        .map(|(x, (y, z))| [x, y, z])
        .collect())
}

/// Q_m/I_m and U_m/I_m in some pixels, one list per layer; `edges_kpc` are the far edges of the layers, the first begins
/// at the Sun.
///
/// # Errors
/// If a parameter of the model is out of range, the edges do not increase, or a pixel does not exist.
pub fn ratios(
    model: &Model,
    edges_kpc: &[f64],
    nside: Nside,
    pixels: Range<usize>,
    level: Level,
) -> Result<(Vec<Vec<f64>>, Vec<Vec<f64>>), Error> {
    let layers = edges_kpc.len();
    let edges: Vec<f64> = std::iter::once(0.0)
        .chain(edges_kpc.iter().copied())
        .collect();
    let mut maps = vec![vec![0.0; pixels.len()]; 2 * layers];
    let results = parallel::for_columns(&mut maps, |range, mut maps| -> Result<(), Error> {
        let directions = directions(nside, shifted(range, pixels.start), level)?;
        let mut scratch = [0.0; ratios_scratch_len()];
        let (q, u) = maps.split_at_mut(layers);
        ratios_into(level, model, &edges, &directions, q, u, &mut scratch)?;
        Ok(())
    });
    results.into_iter().collect::<Result<(), _>>()?;
    let u = maps.split_off(layers);
    Ok((maps, u))
}

const fn shifted(range: Range<usize>, by: usize) -> Range<usize> {
    range.start + by..range.end + by
}
