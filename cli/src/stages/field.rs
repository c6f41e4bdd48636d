//! Polarisation fractions of each layer from the large-scale galactic field (\[MKD18\], section 4.2).
//!
//! The kernel is [`dust3d_kernels::field::line_of_sight`]; this stage runs it over the pixels of a map.

use super::mirror;
use crate::Error;
use crate::config::FieldConfig;
use crate::parallel;
use dust3d_kernels::field::line_of_sight::{ratios_into, ratios_scratch_len};
use dust3d_kernels::field::{Density, Grains, Model, Spiral};
use dust3d_kernels::healpix::{Nside, ring};
use dust3d_kernels::simd::Level;
use rayon::prelude::*;
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

/// Q_m/I_m and U_m/I_m of every layer, piece by piece from the north pole to the south pole.
///
/// The field and the density are the same on both sides of the Galactic plane but for the sign of U: the south is the
/// mirror image of the north, where that is kept in memory, with the same bits.
pub struct Ratios<'a> {
    model: &'a Model,
    /// Edges of the layers, from the Sun on.
    edges_kpc: Vec<f64>,
    nside: Nside,
    level: Level,
    /// Q, then U of every layer, as far as the northern half is done; none to compute every pixel.
    north: Option<Vec<Vec<f64>>>,
    /// Pixels done.
    done: usize,
}

impl<'a> Ratios<'a> {
    /// `edges_kpc` are the far edges of the layers, the first begins at the Sun. With `keep_north`, half a map is kept
    /// for every Q and U.
    #[must_use]
    pub fn new(
        model: &'a Model,
        edges_kpc: &[f64],
        nside: Nside,
        level: Level,
        keep_north: bool,
    ) -> Self {
        let north = || vec![Vec::with_capacity(mirror::north_len(nside)); 2 * edges_kpc.len()];
        Self {
            model,
            edges_kpc: std::iter::once(0.0)
                .chain(edges_kpc.iter().copied())
                .collect(),
            nside,
            level,
            north: keep_north.then(north),
            done: 0,
        }
    }

    /// Q_m/I_m and U_m/I_m in the next `count` pixels, one list per layer.
    ///
    /// # Errors
    /// If a parameter of the model is out of range, the edges do not increase, or the map is at its end.
    pub fn next(&mut self, count: usize) -> Result<(Vec<Vec<f64>>, Vec<Vec<f64>>), Error> {
        let layers = self.edges_kpc.len() - 1;
        let (start, end) = (self.done, self.done + count);
        let mut maps = if let Some(mut north) = self.north.take() {
            let split = mirror::north_len(self.nside).clamp(start, end);
            let mut maps = self.compute(start..split)?;
            for (k, (map, north)) in maps.iter_mut().zip(&mut north).enumerate() {
                north.extend_from_slice(map);
                map.resize(count, 0.0);
                let south = &mut map[split - start..];
                mirror::reflect(self.nside, north, split, south)?;
                if k >= layers {
                    south.par_iter_mut().for_each(|u| *u = -*u);
                }
            }
            self.north = Some(north);
            maps
        } else {
            self.compute(start..end)?
        };
        self.done = end;
        let u = maps.split_off(layers);
        Ok((maps, u))
    }

    /// Q of every layer, then U.
    fn compute(&self, pixels: Range<usize>) -> Result<Vec<Vec<f64>>, Error> {
        let layers = self.edges_kpc.len() - 1;
        let mut maps = vec![vec![0.0; pixels.len()]; 2 * layers];
        let results = parallel::for_columns(&mut maps, |range, mut maps| -> Result<(), Error> {
            let directions = directions(self.nside, shifted(range, pixels.start), self.level)?;
            let mut scratch = [0.0; ratios_scratch_len()];
            let (q, u) = maps.split_at_mut(layers);
            let edges = &self.edges_kpc;
            ratios_into(
                self.level,
                self.model,
                edges,
                &directions,
                q,
                u,
                &mut scratch,
            )?;
            Ok(())
        });
        results.into_iter().collect::<Result<(), _>>()?;
        Ok(maps)
    }
}

const fn shifted(range: Range<usize>, by: usize) -> Range<usize> {
    range.start + by..range.end + by
}
