//! Bilinear interpolation at the pixel centres of another grid.
//!
//! All centres of a ring share their two source rings and the weights between them; only longitude changes along it.
//!
//! ```text
//! for each ring of `out`, between source rings N and S with weights n and s:
//!     for eight pixels i at a time:
//!         for each ring R of (N, S):
//!             e ← longitude of i in R's spacings;  w ← ⌊e⌋
//!             sum += n_R (R[w] + (e − w) (R[w + 1] − R[w]))
//! ```
//!
//! * e is a multiple of i plus a constant: no division, no angle.
//! * The source rings are short enough to stay in the first-level cache; the loads of R[w], R[w + 1] are the cost.
//! * Eight pixels that lie between the first and the last centre of both rings have w from 0 on and w + 1 on the ring;
//!   the others, at longitude 0, find their neighbours one by one with the same arithmetic.
//! * Products and sums are not fused: all levels give the same bits, and so do ranges, however they are cut.
//! * Next to the poles, and where values are missing, each pixel takes its stencil ([`interp`](super::super::interp)).

use super::super::interp::{RingPair, Source, Stencil};
use super::super::layout::{Ring, locate_valid};
use super::super::missing::{MISSING, is_missing};
use super::super::{Location, Nside};
use super::{check_whole, copy_range};
use crate::simd::{Bits as _, Lanes, Level, Mask as _};
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
    };
    if let Some(sources) = pair.sources(map) {
        let complete = |s: &Source<'_>| !s.values.iter().any(|&x| is_missing(x));
        if sources.iter().all(complete) {
            let [north, south] = sources.map(|source| Line::new(source, &centres));
            dispatch!(level, |token: L| along_lines::<L>(
                token,
                [&north, &south],
                index as f64,
                out
            ));
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
}

/// A source ring as seen from the centres of another: e = scale · i − shift.
struct Line<'a> {
    source: Source<'a>,
    scale: f64,
    shift: f64,
}

impl<'a> Line<'a> {
    fn new(source: Source<'a>, centres: &Centres) -> Self {
        let scale = source.quarter / centres.quarter;
        Self {
            source,
            scale,
            shift: source.shift - centres.shift * scale,
        }
    }

    /// The ring's share of the value at place `i`.
    fn at(&self, i: f64) -> f64 {
        let e = i * self.scale - self.shift;
        let west = floor(e);
        let (value_west, value_east) = self.source.neighbours(west);
        (value_west + (e - west) * (value_east - value_west)) * self.source.weight
    }

    /// As [`at`](Self::at) in eight places; none where one of them is not between two centres in the order of the ring.
    #[inline(always)]
    fn at_eight<L: Lanes>(&self, token: L::Token, i: L) -> Option<L> {
        let e = i * L::splat(token, self.scale) - L::splat(token, self.shift);
        let west = e.floor();
        let last = self.source.values.len().saturating_sub(1) as f64;
        let zero = L::splat(token, 0.0);
        if !(west.ge(zero) & west.lt(L::splat(token, last))).all() {
            return None;
        }
        let places = west.to_whole(token).to_array();
        let (mut value_west, mut value_east) = ([0.0; 8], [0.0; 8]);
        for ((place, west), east) in places.into_iter().zip(&mut value_west).zip(&mut value_east) {
            let pair = self.source.values.get(place as usize..place as usize + 2);
            let Some(&[a, b]) = pair else { return None };
            (*west, *east) = (a, b);
        }
        let value_west = L::load(token, &value_west);
        let value_east = L::load(token, &value_east);
        let value = value_west + (e - west) * (value_east - value_west);
        Some(value * L::splat(token, self.source.weight))
    }
}

/// Places of eight consecutive pixels after the first.
const EIGHT: [f64; 8] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// Interpolates at the places `first`, `first` + 1, … between two source rings without missing values.
#[inline(always)]
fn along_lines<L: Lanes>(
    token: L::Token,
    [north, south]: [&Line<'_>; 2],
    first: f64,
    out: &mut [f64],
) {
    let (eights, rest) = out.as_chunks_mut::<8>();
    let mut place = first;
    for eight in eights {
        let i = L::splat(token, place) + L::load(token, &EIGHT);
        let (a, b) = (north.at_eight::<L>(token, i), south.at_eight::<L>(token, i));
        if let (Some(a), Some(b)) = (a, b) {
            (a + b).store(eight);
        } else {
            for (out, k) in eight.iter_mut().zip(EIGHT) {
                *out = north.at(place + k) + south.at(place + k);
            }
        }
        place += 8.0;
    }
    for (out, k) in rest.iter_mut().zip(EIGHT) {
        *out = north.at(place + k) + south.at(place + k);
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
