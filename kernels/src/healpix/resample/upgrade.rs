//! Bilinear interpolation at the pixel centres of another grid.
//!
//! All centres of a ring share their two source rings and the weights between them; only longitude changes along it.
//!
//! ```text
//! for each ring of `out`, between source rings N and S with weights n and s:
//!     for each run of pixels between the same two centres of N and the same two of S:
//!         level ← n N[w] + s S[w']                  w, w': the centres to the west, at places c, c' of the run's ring
//!         slopes ← n (N[w + 1] − N[w]) per pixel, s (S[w' + 1] − S[w']) per pixel
//!         out[i] ← level + slope (i − c) + slope' (i − c')
//! ```
//!
//! * A run is as long as the grid is finer; in it everything but i is constant, so the inner loop is two
//!   multiplications and no floor, index, division or branch, and the compiler makes vectors of it.
//! * Where a run begins and what it holds depends on the pixels alone: a range has the bits of the whole map. Products
//!   and sums are not fused: all levels give the same bits.
//! * Next to the poles, where values are missing, and down to coarser grids each pixel takes its stencil
//!   ([`interp`](super::super::interp)).

use super::super::interp::{RingPair, Source, Stencil};
use super::super::layout::{Ring, locate_valid};
use super::super::missing::{MISSING, is_missing};
use super::super::{Location, Nside};
use super::{check_whole, copy_range};
use crate::simd::Level;
use crate::{Error, dispatch};

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
    level: Level,
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
        along_ring(level, nside_in, ring, at.index, map, here);
        rest = after;
        pixel += on_ring;
    }
    Ok(())
}

/// Interpolates at consecutive centres of a ring, from place `index` on.
fn along_ring(level: Level, nside: Nside, ring: Ring, index: u64, map: &[f64], out: &mut [f64]) {
    let location = Location {
        z: ring.z(),
        sin_theta: ring.sin_theta(),
        phi: 0.0,
    };
    let pair = RingPair::around(nside, location, ring.theta());
    let centres = Centres {
        quarter: (ring.len() / 4) as f64,
        shift: if ring.is_shifted() { 0.5 } else { 0.0 },
        first: index,
    };
    if let Some(sources) = pair.sources(map) {
        let finer = sources.iter().all(|s| s.quarter < centres.quarter);
        let complete = |s: &Source<'_>| !s.values.iter().any(|&x| is_missing(x));
        if finer && sources.iter().all(complete) {
            dispatch!(level, |_token: _L| by_runs(&sources, &centres, out));
            return;
        }
    }
    for (index, out) in (index..).zip(out) {
        let turns = (index as f64 + centres.shift) / centres.quarter;
        *out = weighted_mean(map, pair.stencil(turns));
    }
}

/// Consecutive pixel centres on a ring.
struct Centres {
    quarter: f64,
    shift: f64,
    first: u64,
}

/// Pixels between the same two centres of a source ring.
#[derive(Clone, Copy)]
struct Run {
    /// The first pixel that is not.
    end: usize,
    /// Value at the western centre, times the ring's weight.
    value: f64,
    /// Change from pixel to pixel.
    slope: f64,
    /// Place of the western centre among the pixels of the ring.
    origin: f64,
}

impl Run {
    /// The run from pixel `start` on; it ends at `n` at the latest.
    #[inline(always)]
    fn from(source: &Source<'_>, centres: &Centres, start: usize, n: usize) -> Self {
        let west = floor(source.at(centres.turns(start)));
        let spacing = centres.quarter / source.quarter;
        // The estimate of where the next interval begins is right but for rounding.
        let next = (west + 1.0 + source.shift) * spacing - centres.shift;
        let mut end = (next - centres.first as f64).clamp(start as f64 + 1.0, n as f64) as usize;
        while end < n && floor(source.at(centres.turns(end))) == west {
            end += 1;
        }
        while end > start + 1 && floor(source.at(centres.turns(end - 1))) > west {
            end -= 1;
        }
        let (value_west, value_east) = source.neighbours(west);
        Self {
            end,
            value: source.weight * value_west,
            slope: source.weight * (value_east - value_west) / spacing,
            origin: (west + source.shift) * spacing - centres.shift,
        }
    }
}

/// Interpolates between two source rings without missing values, coarser than the centres.
#[inline(always)]
fn by_runs(sources: &[Source<'_>; 2], centres: &Centres, out: &mut [f64]) {
    let n = out.len();
    let mut start = 0;
    let [north, south] = sources;
    let mut a = Run::from(north, centres, 0, n);
    let mut b = Run::from(south, centres, 0, n);
    while start < n {
        if a.end <= start {
            a = Run::from(north, centres, start, n);
        }
        if b.end <= start {
            b = Run::from(south, centres, start, n);
        }
        let end = a.end.min(b.end);
        let first = (centres.first + start as u64) as f64;
        let value = a.value + b.value;
        let Some(run) = out.get_mut(start..end) else {
            return;
        };
        for (k, out) in (0_i32..).zip(run) {
            let i = first + f64::from(k);
            *out = value + a.slope * (i - a.origin) + b.slope * (i - b.origin);
        }
        start = end;
    }
}

impl Centres {
    /// Longitude of the k-th centre in quarter turns.
    #[inline(always)]
    fn turns(&self, k: usize) -> f64 {
        ((self.first + k as u64) as f64 + self.shift) / self.quarter
    }
}

/// Longitudes lie within 2³⁰ spacings of 0, where the integer conversion is exact and the fastest floor.
#[inline(always)]
fn floor(x: f64) -> f64 {
    let whole = x as i64 as f64;
    if whole > x { whole - 1.0 } else { whole }
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
