//! Maps from one Nside to another.
//!
//! Down, a pixel is the plain average of its sub-pixels. Up, scalars are interpolated bilinearly at the new pixel
//! centres; Q and U go through E and B, because interpolating their components would turn polarisation near the poles.
//! Missing sub-pixels and neighbours are left out. A map of the right Nside is copied bit for bit.

use crate::Error;
use crate::sht::{Analysis, ShtPlan};
use dust3d_kernels::healpix::{Nside, resample};
use dust3d_kernels::sht::alm;
use dust3d_kernels::simd::Level;
use num_complex::Complex;
use rayon::prelude::*;

use crate::parallel::CHUNK;
use std::ops::Range;

/// A scalar map (I, τ, T, β, fractions) on another grid.
///
/// # Errors
/// If `map` is not a map of Nside `from`.
pub fn scalar(map: &[f64], from: Nside, to: Nside, level: Level) -> Result<Vec<f64>, Error> {
    scalar_range(map, from, to, 0..to.npix() as usize, level)
}

/// As [`scalar`], some pixels of the other grid.
///
/// # Errors
/// If `map` is not a map of Nside `from`, or the pixels do not exist.
pub fn scalar_range(
    map: &[f64],
    from: Nside,
    to: Nside,
    pixels: Range<usize>,
    level: Level,
) -> Result<Vec<f64>, Error> {
    let kernel = match to.get() < from.get() {
        true => resample::degrade_ring_range,
        false => resample::upgrade_bilinear_ring_range,
    };
    let mut out = vec![0.0; pixels.len()];
    out.par_chunks_mut(CHUNK)
        .enumerate()
        .try_for_each(|(k, piece)| {
            kernel(
                level,
                from,
                to,
                map,
                (pixels.start + k * CHUNK) as u64,
                piece,
            )
        })?;
    Ok(out)
}

/// As [`scalar`], of a map that is not needed any more: one of the right Nside stays where it is.
///
/// # Errors
/// If `map` is not a map of Nside `from`.
pub fn scalar_owned(
    map: Vec<f64>,
    from: Nside,
    to: Nside,
    level: Level,
) -> Result<Vec<f64>, Error> {
    if from == to && map.len() as u64 == to.npix() {
        return Ok(map);
    }
    scalar(&map, from, to, level)
}

/// `map` *= `factor`, a map of the coarser grid `from`, interpolated.
///
/// # Errors
/// If a map has another length than its Nside says.
pub fn multiply(
    map: &mut [f64],
    nside: Nside,
    factor: &[f64],
    from: Nside,
    level: Level,
) -> Result<(), Error> {
    map.par_chunks_mut(CHUNK)
        .enumerate()
        .try_for_each_init(Vec::new, |piece, (k, map)| {
            piece.resize(map.len(), 0.0);
            let first = (k * CHUNK) as u64;
            resample::upgrade_bilinear_ring_range(level, from, nside, factor, first, piece)?;
            for (x, f) in map.iter_mut().zip(piece.iter()) {
                *x *= f;
            }
            Ok(())
        })
}

/// Q and U (COSMO) on another grid.
///
/// # Errors
/// If `q` and `u` are not maps of Nside `from`.
pub fn polarisation(
    q: Vec<f64>,
    u: Vec<f64>,
    from: Nside,
    to: Nside,
    level: Level,
) -> Result<(Vec<f64>, Vec<f64>), Error> {
    if to.get() <= from.get() {
        return Ok((
            scalar_owned(q, from, to, level)?,
            scalar_owned(u, from, to, level)?,
        ));
    }
    let lmax = 2 * from.get() as usize;
    let zero = Complex::new(0.0, 0.0);
    let (mut e, mut b) = (vec![zero; alm::len(lmax)], vec![zero; alm::len(lmax)]);
    ShtPlan::new(from, lmax, level)?.analysis_spin2(
        &q,
        &u,
        &mut e,
        &mut b,
        &Analysis::default(),
    )?;
    drop((q, u));
    let npix = to.npix() as usize;
    let (mut q, mut u) = (vec![0.0; npix], vec![0.0; npix]);
    ShtPlan::new(to, lmax, level)?.synthesis_spin2(&e, &b, &mut q, &mut u)?;
    Ok((q, u))
}
