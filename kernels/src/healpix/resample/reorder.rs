//! The same map in the other order.
//!
//! ```text
//! every tile of 16 × 16 pixels:
//!     every circle x + y of the tile:  a run of RING pixels ↔ places in the tile
//! ```
//!
//! Whole maps go tile by tile along the rings; see [`tiles`](super::tiles). What is written to NESTED order is asked for
//! one tile ahead, as no pattern tells where it will be. Parts of a map in NESTED order go from tile to tile as they come.
//! Pixels of an unfinished tile, and those of the few tiles that φ = 0 crosses, go one by one.
//!
//! Parts of a map in RING order are not made of tiles; there every stretch of a ring in one face is followed through its
//! face, one step in x up and in y down, among interleaved bits.

use super::super::faces::FacePixel;
use super::super::{Nside, order};
use super::check_whole;
use super::stretch::Stretch;
use super::tiles::{Runs, SIDE, TILE, along_rings};
use crate::simd::{Lanes, Level};
use crate::{Error, dispatch};

/// Writes a RING map in NESTED order. Values are copied bit for bit, missing ones too.
///
/// | argument | shape |
/// | --- | --- |
/// | `ring` | 12 nside² |
/// | `nested` | 12 nside², written |
///
/// # Errors
/// [`Error::Nside`] where Nside is not a power of two; [`Error::Length`] unless both have their length.
pub fn to_nested<T: Copy>(
    level: Level,
    nside: Nside,
    ring: &[T],
    nested: &mut [T],
) -> Result<(), Error> {
    check_whole(nside, nested.len())?;
    to_nested_range(level, nside, ring, 0, nested)
}

/// Pixels `first`, `first` + 1, … of [`to_nested`], as many as fit `nested`.
///
/// # Errors
/// As [`to_nested`], and [`Error::Pixel`] where the range leaves the map.
pub fn to_nested_range<T: Copy>(
    level: Level,
    nside: Nside,
    ring: &[T],
    first: u64,
    nested: &mut [T],
) -> Result<(), Error> {
    let order = nside.nested_order()?;
    nside.check_map("ring", ring.len())?;
    nside.check_range(first, nested.len())?;
    if nside.get() < SIDE as u64 {
        one_by_one(nside, order, ring, first, nested);
    } else if nested.len() == ring.len() {
        dispatch!(level, |token: L| fill_all::<L, T>(
            token, nside, order, ring, nested
        ));
    } else {
        fill(nside, order, ring, first, nested);
    }
    Ok(())
}

/// Fills all tiles of a NESTED map.
#[inline(always)]
fn fill_all<L: Lanes, T: Copy>(
    token: L::Token,
    nside: Nside,
    order: u32,
    ring: &[T],
    nested: &mut [T],
) {
    let (tiles, _) = nested.as_chunks_mut::<TILE>();
    along_rings(nside, order, |number, next, runs| {
        if let Some(next) = tiles.get(next) {
            for value in next.iter().step_by((64 / size_of::<T>().max(1)).max(1)) {
                L::prefetch(token, value);
            }
        }
        if let Some(tile) = tiles.get_mut(number) {
            match runs {
                Some(runs) => runs.fill(ring, tile),
                None => one_by_one(nside, order, ring, (number * TILE) as u64, tile),
            }
        }
    });
}

/// Fills whole tiles by runs, what is before and after one by one.
fn fill<T: Copy>(nside: Nside, order: u32, ring: &[T], first: u64, nested: &mut [T]) {
    // To the next multiple of a tile.
    let before = (first.wrapping_neg() % TILE as u64) as usize;
    let (head, rest) = nested.split_at_mut(before.min(nested.len()));
    one_by_one(nside, order, ring, first, head);
    let (tiles, tail) = rest.as_chunks_mut::<TILE>();
    let mut pixel = first + before as u64;
    for tile in tiles {
        match Runs::of(nside, FacePixel::from_nested(order, pixel)) {
            Some(runs) => runs.fill(ring, tile),
            None => one_by_one(nside, order, ring, pixel, tile),
        }
        pixel += TILE as u64;
    }
    one_by_one(nside, order, ring, pixel, tail);
}

fn one_by_one<T: Copy>(nside: Nside, order: u32, ring: &[T], first: u64, nested: &mut [T]) {
    for (pixel, out) in (first..).zip(nested) {
        let from = order::nest2ring_valid(nside, order, pixel);
        if let Some(&value) = ring.get(from as usize) {
            *out = value;
        }
    }
}

/// Writes all tiles of a NESTED map into the RING map.
fn empty_all<T: Copy>(nside: Nside, order: u32, nested: &[T], ring: &mut [T]) {
    let (tiles, _) = nested.as_chunks::<TILE>();
    along_rings(nside, order, |number, _, runs| {
        let Some(tile) = tiles.get(number) else {
            return;
        };
        if let Some(runs) = runs {
            return runs.empty(tile, ring);
        }
        for (pixel, &value) in ((number * TILE) as u64..).zip(tile) {
            let to = order::nest2ring_valid(nside, order, pixel);
            if let Some(to) = ring.get_mut(to as usize) {
                *to = value;
            }
        }
    });
}

/// Writes a NESTED map in RING order. Values are copied bit for bit, missing ones too.
///
/// | argument | shape |
/// | --- | --- |
/// | `nested` | 12 nside² |
/// | `ring` | 12 nside², written |
///
/// # Errors
/// [`Error::Nside`] where Nside is not a power of two; [`Error::Length`] unless both have their length.
pub fn to_ring<T: Copy>(
    level: Level,
    nside: Nside,
    nested: &[T],
    ring: &mut [T],
) -> Result<(), Error> {
    check_whole(nside, ring.len())?;
    to_ring_range(level, nside, nested, 0, ring)
}

/// Pixels `first`, `first` + 1, … of [`to_ring`], as many as fit `ring`.
///
/// # Errors
/// As [`to_ring`], and [`Error::Pixel`] where the range leaves the map.
pub fn to_ring_range<T: Copy>(
    _level: Level,
    nside: Nside,
    nested: &[T],
    first: u64,
    ring: &mut [T],
) -> Result<(), Error> {
    let order = nside.nested_order()?;
    nside.check_map("nested", nested.len())?;
    nside.check_range(first, ring.len())?;
    if ring.len() == nested.len() && nside.get() >= SIDE as u64 {
        empty_all(nside, order, nested, ring);
        return Ok(());
    }
    let face_len = 1_usize << (2 * order);
    let within = face_len as u64 - 1;
    let (even, odd) = (
        within & 0x5555_5555_5555_5555,
        within & 0xaaaa_aaaa_aaaa_aaaa,
    );
    let mut rest = ring;
    let mut stretch = Stretch::from_pixel(nside, first);
    while !rest.is_empty() {
        let (here, after) = rest.split_at_mut(rest.len().min(stretch.len as usize));
        let FacePixel { face, x, y } = stretch.west;
        let start = face as usize * face_len;
        let Some(face) = nested.get(start..start + face_len) else {
            break;
        };
        let at = FacePixel { face: 0, x, y }.to_nested(order);
        let (mut x, mut y) = (at & even, at & odd);
        for out in here {
            if let Some(&value) = face.get((x | y) as usize) {
                *out = value;
            }
            // Carries pass through the other coordinate's bits.
            x = ((x | odd) + 1) & even;
            y = y.wrapping_sub(2) & odd;
        }
        rest = after;
        stretch = stretch.next(nside);
    }
    Ok(())
}
