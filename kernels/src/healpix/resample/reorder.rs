//! The same map in the other order.
//!
//! ```text
//! to NESTED:  every tile of 16 × 16 pixels (256 consecutive NESTED numbers):
//!                 every circle x + y of the tile:  a run of RING pixels → its places in the tile, from a table
//! to RING:    every stretch of a ring in one face:
//!                 every pixel:  one step in x up and in y down, among interleaved bits
//! ```
//!
//! Ring numbers are thus computed once per run, not per pixel, and both maps are read and written a few cache lines at a
//! time. Pixels of an unfinished tile, and those of the few tiles that φ = 0 crosses, go one by one.

use super::super::faces::{FacePixel, spread_bits};
use super::super::layout;
use super::super::{Nside, order};
use super::check_whole;
use super::stretch::Stretch;
use crate::Error;
use crate::simd::Level;

/// Pixels of a tile's side, and of a tile.
const SIDE: u64 = 16;
const TILE: usize = 256;

/// By circle x + y of a tile, from the south, and place on it, from the west: the NESTED number within the tile.
const PLACES: [[u8; 16]; 31] = {
    let mut places = [[0; 16]; 31];
    let mut x = 0_usize;
    while x < 16 {
        let mut y = 0_usize;
        while y < 16 {
            let circle = x + y;
            let west = circle.saturating_sub(15);
            let nested = spread_bits(x as u64) | (spread_bits(y as u64) << 1);
            places[circle][x - west] = nested as u8;
            y += 1;
        }
        x += 1;
    }
    places
};

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
    _level: Level,
    nside: Nside,
    ring: &[T],
    first: u64,
    nested: &mut [T],
) -> Result<(), Error> {
    let order = nside.nested_order()?;
    nside.check_map("ring", ring.len())?;
    nside.check_range(first, nested.len())?;
    let before = if nside.get() < SIDE {
        nested.len()
    } else {
        // To the next multiple of 256.
        nested
            .len()
            .min((first.wrapping_neg() % TILE as u64) as usize)
    };
    let (head, rest) = nested.split_at_mut(before);
    one_by_one(nside, order, ring, first, head);
    let (tiles, tail) = rest.as_chunks_mut::<TILE>();
    let mut pixel = first + before as u64;
    for tile in tiles {
        if !fill_tile(nside, FacePixel::from_nested(order, pixel), ring, tile) {
            one_by_one(nside, order, ring, pixel, tile);
        }
        pixel += TILE as u64;
    }
    one_by_one(nside, order, ring, pixel, tail);
    Ok(())
}

fn one_by_one<T: Copy>(nside: Nside, order: u32, ring: &[T], first: u64, nested: &mut [T]) {
    for (pixel, out) in (first..).zip(nested) {
        let from = order::nest2ring_valid(nside, order, pixel);
        if let Some(&value) = ring.get(from as usize) {
            *out = value;
        }
    }
}

/// Fills the tile whose southern corner is `south`; false, and nothing written, if φ = 0 goes through it.
fn fill_tile<T: Copy>(nside: Nside, south: FacePixel, ring: &[T], tile: &mut [T; TILE]) -> bool {
    if south.face == 4 && south.x == south.y {
        return false;
    }
    for (circle, places) in (0..).zip(&PLACES) {
        let x_west = u64::saturating_sub(circle, SIDE - 1);
        let len = SIDE.min(circle + 1) - x_west;
        let west = FacePixel {
            face: south.face,
            x: south.x + x_west,
            y: south.y + circle - x_west,
        };
        let first = layout::pixel_number(nside, west.to_ring(nside)) as usize;
        let Some(run) = ring.get(first..first + len as usize) else {
            return false;
        };
        for (&value, &place) in run.iter().zip(places) {
            tile[usize::from(place)] = value;
        }
    }
    true
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
