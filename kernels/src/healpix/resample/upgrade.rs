//! Bilinear interpolation at the pixel centres of another grid.
//!
//! All centres of a ring share their two source rings and the weights between them; only longitude changes along it.

use super::super::interp::{RingPair, Stencil};
use super::super::layout::{Ring, locate_valid};
use super::super::missing::{MISSING, is_missing};
use super::super::{Location, Nside};
use super::{check_whole, copy_range};
use crate::Error;
use crate::simd::Level;

/// Interpolates a RING map at the pixel centres of another grid, usually a finer one.
///
/// out\[p\] = Σₖ wₖ map\[qₖ\], with the stencil of [`interp`](super::super::interp) at the centre of p. Missing
/// neighbours are left out and the other weights scaled to sum to 1; [`MISSING`] where none with a weight is left.
///
/// | argument | shape | domain |
/// | --- | --- | --- |
/// | `map` | 12 `nside_in`² | any, missing values allowed |
/// | `out` | 12 `nside_out`² | written |
///
/// # Errors
/// [`Error::Length`] unless both maps have their length.
pub fn upgrade_bilinear_ring(
    level: Level,
    nside_in: Nside,
    nside_out: Nside,
    map: &[f64],
    out: &mut [f64],
) -> Result<(), Error> {
    check_whole(nside_out, out.len())?;
    upgrade_bilinear_ring_range(level, nside_in, nside_out, map, 0, out)
}

/// Pixels `first`, `first` + 1, … of [`upgrade_bilinear_ring`], as many as fit `out`.
///
/// # Errors
/// As [`upgrade_bilinear_ring`], and [`Error::Pixel`] where the range leaves the map.
pub fn upgrade_bilinear_ring_range(
    _level: Level,
    nside_in: Nside,
    nside_out: Nside,
    map: &[f64],
    first: u64,
    out: &mut [f64],
) -> Result<(), Error> {
    nside_in.check_map("map", map.len())?;
    nside_out.check_range(first, out.len())?;
    if nside_in == nside_out {
        copy_range(map, first, out);
        return Ok(());
    }
    let mut rest = out;
    let mut pixel = first;
    while !rest.is_empty() {
        let at = locate_valid(nside_out, pixel);
        let ring = Ring::valid(nside_out, at.ring);
        let on_ring = (ring.len() - at.index).min(rest.len() as u64);
        let (here, after) = rest.split_at_mut(on_ring as usize);
        along_ring(nside_in, ring, at.index, map, here);
        rest = after;
        pixel += on_ring;
    }
    Ok(())
}

/// Interpolates at consecutive centres of a ring, from place `index` on.
fn along_ring(nside: Nside, ring: Ring, index: u64, map: &[f64], out: &mut [f64]) {
    let location = Location {
        z: ring.z(),
        sin_theta: ring.sin_theta(),
        phi: 0.0,
    };
    let pair = RingPair::around(nside, location, ring.theta());
    let quarter = (ring.len() / 4) as f64;
    let shift = if ring.is_shifted() { 0.5 } else { 0.0 };
    for (index, out) in (index..).zip(out) {
        let turns = (index as f64 + shift) / quarter;
        *out = weighted_mean(map, pair.stencil(turns));
    }
}

#[inline]
fn weighted_mean(map: &[f64], stencil: Stencil) -> f64 {
    let (mut sum, mut all, mut missing) = (0.0, 0.0, false);
    for (pixel, weight) in stencil.pixels.into_iter().zip(stencil.weights) {
        let value = map.get(pixel as usize).copied().unwrap_or(MISSING);
        if is_missing(value) {
            missing = true;
        } else {
            sum += weight * value;
            all += weight;
        }
    }
    if !missing {
        sum
    } else if all > 0.0 {
        sum / all
    } else {
        MISSING
    }
}
