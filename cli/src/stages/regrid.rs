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

/// A scalar map (I, τ, T, β, fractions) on another grid.
///
/// # Errors
/// If `map` is not a map of Nside `from`.
pub fn scalar(map: &[f64], from: Nside, to: Nside, level: Level) -> Result<Vec<f64>, Error> {
    let kernel = match to.get().cmp(&from.get()) {
        std::cmp::Ordering::Equal => return Ok(map.to_vec()),
        std::cmp::Ordering::Less => resample::degrade_ring_range,
        std::cmp::Ordering::Greater => resample::upgrade_bilinear_ring_range,
    };
    let mut out = vec![0.0; to.npix() as usize];
    out.par_chunks_mut(CHUNK)
        .enumerate()
        .try_for_each(|(k, piece)| kernel(level, from, to, map, (k * CHUNK) as u64, piece))?;
    Ok(out)
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
    q: &[f64],
    u: &[f64],
    from: Nside,
    to: Nside,
    level: Level,
) -> Result<(Vec<f64>, Vec<f64>), Error> {
    if to.get() <= from.get() {
        return Ok((scalar(q, from, to, level)?, scalar(u, from, to, level)?));
    }
    let lmax = 2 * from.get() as usize;
    let zero = Complex::new(0.0, 0.0);
    let (mut e, mut b) = (vec![zero; alm::len(lmax)], vec![zero; alm::len(lmax)]);
    ShtPlan::new(from, lmax, level)?.analysis_spin2(q, u, &mut e, &mut b, &Analysis::default())?;
    let npix = to.npix() as usize;
    let (mut q, mut u) = (vec![0.0; npix], vec![0.0; npix]);
    ShtPlan::new(to, lmax, level)?.synthesis_spin2(&e, &b, &mut q, &mut u)?;
    Ok((q, u))
}
