//! Fractions of the dust in each layer: reddening shells, filled where nothing was observed.
//!
//! \[MKD18\], section 4.1. From the cumulative reddening at the layers' edges (distance moduli):
//!
//! 1. average over the observed sub-pixels to at most Nside 64 (a sub-pixel missing at one edge is left out of all),
//! 2. f_i = Δ_i / Σ_j Δ_j, Δ_i the reddening between two edges (layer 1: everything nearer than the first),
//! 3. a pixel that was not observed takes the mean of the observed pixels around its three mirror images
//!    (l, −b), (−l, b), (−l, −b), within a radius that doubles until there is one,
//! 4. interpolate to the working grid and renormalise: Σ f_i = 1, f_i ≥ 0.

use super::regrid;
use crate::Error;
use crate::parallel;
use dust3d_kernels::healpix::disc::{self, Inclusion};
use dust3d_kernels::healpix::missing::{MISSING, is_missing};
use dust3d_kernels::healpix::{Location, Nside, ring};
use dust3d_kernels::simd::Level;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::ops::Range;

/// Finest grid on which the cube is used; \[MKD18\] works at this Nside.
const CUBE_NSIDE: u64 = 64;

/// The fractions of every layer, whole at the cube's resolution, and what was found missing.
pub struct Fractions {
    /// One map per layer, near to far.
    coarse: Vec<Vec<f64>>,
    nside: Nside,
    /// Pixels of the cube's own grid with any edge missing.
    pub missing_cube_pixels: u64,
}

impl Fractions {
    /// The fractions in some pixels of a finer grid, one list per layer.
    ///
    /// # Errors
    /// If the pixels do not exist.
    pub fn at(
        &self,
        nside: Nside,
        pixels: Range<usize>,
        level: Level,
    ) -> Result<Vec<Vec<f64>>, Error> {
        let mut maps = self
            .coarse
            .iter()
            .map(|f| regrid::scalar_range(f, self.nside, nside, pixels.clone(), level))
            .collect::<Result<Vec<_>, _>>()?;
        parallel::for_columns(&mut maps, |_, mut layers| {
            normalise(&mut layers);
        });
        Ok(maps)
    }
}

/// Fractions from the cumulative reddening `edges` (one map per layer edge, near to far) at `from`.
///
/// # Errors
/// If no pixel is covered, or a map has another length than 12 `from`².
pub fn fractions(
    edges: &[&[f64]],
    from: Nside,
    fill_radius_rad: f64,
    level: Level,
) -> Result<Fractions, Error> {
    let npix = from.npix() as usize;
    let observed: Vec<bool> = (0..npix)
        .into_par_iter()
        .map(|p| {
            edges
                .iter()
                .all(|e| e.get(p).is_some_and(|&x| !is_missing(x)))
        })
        .collect();
    let missing_cube_pixels = observed.iter().filter(|&&o| !o).count() as u64;

    let nside = Nside::new(from.get().min(CUBE_NSIDE))?;
    let cumulative = edges
        .iter()
        .map(|edge| {
            let masked: Vec<f64> = edge
                .iter()
                .zip(&observed)
                .map(|(&x, &o)| if o { x } else { MISSING })
                .collect();
            regrid::scalar(&masked, from, nside, level)
        })
        .collect::<Result<Vec<_>, _>>()?;

    let (shares, covered) = shares(&cumulative);
    if !covered.contains(&true) {
        return Err(Error::input(
            "the reddening cube has no pixel with all layer edges observed and positive reddening; check the cube's files",
        ));
    }
    Ok(Fractions {
        coarse: fill(shares, &covered, nside, fill_radius_rad, level)?,
        nside,
        missing_cube_pixels,
    })
}

/// f_i where covered (zero elsewhere), and which pixels are covered.
fn shares(cumulative: &[Vec<f64>]) -> (Vec<Vec<f64>>, Vec<bool>) {
    let npix = cumulative.first().map_or(0, Vec::len);
    let mut shares = vec![vec![0.0; npix]; cumulative.len()];
    let mut covered = vec![false; npix];
    for p in 0..npix {
        if cumulative.iter().any(|c| is_missing(c[p])) {
            continue;
        }
        let mut nearer = 0.0;
        let mut total = 0.0;
        for (share, c) in shares.iter_mut().zip(cumulative) {
            share[p] = (c[p] - nearer).max(0.0);
            nearer = c[p];
            total += share[p];
        }
        covered[p] = total > 0.0;
        for share in &mut shares {
            share[p] = if covered[p] { share[p] / total } else { 0.0 };
        }
    }
    (shares, covered)
}

/// Fills the pixels that are not covered from their mirror images.
fn fill(
    mut shares: Vec<Vec<f64>>,
    covered: &[bool],
    nside: Nside,
    radius_rad: f64,
    level: Level,
) -> Result<Vec<Vec<f64>>, Error> {
    let holes: Vec<usize> = (0..covered.len()).filter(|&p| !covered[p]).collect();
    let filled = holes
        .par_iter()
        .map(|&p| {
            let around = covered_mirrors(p as u64, covered, nside, radius_rad, level)?;
            let sums = shares
                .iter()
                .map(|f| around.iter().map(|&k| f[k]).sum::<f64>())
                .collect::<Vec<_>>();
            let total: f64 = sums.iter().sum();
            Ok(sums.into_iter().map(|s| s / total).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>, Error>>()?;
    for (&p, f) in holes.iter().zip(filled) {
        for (share, f) in shares.iter_mut().zip(f) {
            share[p] = f;
        }
    }
    Ok(shares)
}

/// The covered pixels, each once and in order, around the mirror images of a pixel, within the least doubling of the
/// radius that finds any.
fn covered_mirrors(
    pixel: u64,
    covered: &[bool],
    nside: Nside,
    radius_rad: f64,
    level: Level,
) -> Result<Vec<usize>, Error> {
    let [x, y, z] = ring::pix2vec(nside, pixel)?;
    let mirrors = [[x, y, -z], [x, -y, z], [x, -y, -z]];
    let mut radius = radius_rad;
    loop {
        let mut found = Vec::new();
        for mirror in mirrors {
            let centre = Location::from_vec(mirror)?;
            disc::ring_ranges(
                level,
                nside,
                centre,
                radius.min(PI),
                Inclusion::default(),
                |range| {
                    found
                        .extend((range.start as usize..range.end as usize).filter(|&p| covered[p]));
                },
            )?;
        }
        if !found.is_empty() || radius >= PI {
            found.sort_unstable();
            found.dedup();
            return Ok(found);
        }
        radius *= 2.0;
    }
}

/// Scales the layers of every pixel to the sum 1.
fn normalise(layers: &mut [&mut [f64]]) {
    let n = layers.first().map_or(0, |l| l.len());
    for p in 0..n {
        // Interpolation weights can be negative by rounding.
        for layer in layers.iter_mut() {
            layer[p] = layer[p].max(0.0);
        }
        let sum: f64 = layers.iter().map(|l| l[p]).sum();
        for layer in layers.iter_mut() {
            layer[p] /= sum;
        }
    }
}
