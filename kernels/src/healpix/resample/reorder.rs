//! The same map in the other order.
//!
//! ```text
//! every tile of 16 × 16 or 64 × 64 pixels (consecutive NESTED numbers):
//!     every circle x + y of the tile:  a run of RING pixels ↔ places in the tile, from a table of x and one of y
//! ```
//!
//! Ring numbers are thus computed once per run, not per pixel, and both maps are read and written a few cache lines at a
//! time: what is written, in small tiles to NESTED order, from end to end, and in large ones to RING order, in runs of
//! eight lines. Pixels of an unfinished tile, and those of the few tiles that φ = 0 crosses, go one by one.
//!
//! Parts of a map in RING order are not made of tiles; there every stretch of a ring in one face is followed through its
//! face, one step in x up and in y down, among interleaved bits.

use super::super::faces::{FacePixel, spread_bits};
use super::super::layout;
use super::super::{Nside, order};
use super::check_whole;
use super::stretch::Stretch;
use crate::Error;
use crate::simd::Level;

/// Pixels of a large tile's side, and of a small one's; their squares.
const SIDE: usize = 64;
const TILE: usize = SIDE * SIDE;
const SMALL_SIDE: usize = 16;
const SMALL_TILE: usize = SMALL_SIDE * SMALL_SIDE;

/// By x: the place in the tile at y = 0.
const PLACES_X: [u16; SIDE] = {
    let mut places = [0; SIDE];
    let mut x = 0_usize;
    while x < SIDE {
        places[x] = spread_bits(x as u64) as u16;
        x += 1;
    }
    places
};

/// By 63 − y: the place in the tile at x = 0.
const PLACES_Y: [u16; SIDE] = {
    let mut places = [0; SIDE];
    let mut y = 0_usize;
    while y < SIDE {
        places[SIDE - 1 - y] = PLACES_X[y] << 1;
        y += 1;
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
    if nside.get() < SMALL_SIDE as u64 {
        one_by_one(nside, order, ring, first, nested);
    } else {
        fill(nside, order, ring, first, nested);
    }
    Ok(())
}

/// Fills whole tiles by runs, what is before and after one by one.
fn fill<T: Copy>(nside: Nside, order: u32, ring: &[T], first: u64, nested: &mut [T]) {
    // To the next multiple of a tile.
    let before = (first.wrapping_neg() % SMALL_TILE as u64) as usize;
    let (head, rest) = nested.split_at_mut(before.min(nested.len()));
    one_by_one(nside, order, ring, first, head);
    let (tiles, tail) = rest.as_chunks_mut::<SMALL_TILE>();
    let mut pixel = first + before as u64;
    for tile in tiles {
        if !fill_tile(nside, FacePixel::from_nested(order, pixel), ring, tile) {
            one_by_one(nside, order, ring, pixel, tile);
        }
        pixel += SMALL_TILE as u64;
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

/// A circle of a tile: where its RING pixels begin, and the places in the tile of the first of them.
struct Run<'a> {
    first: usize,
    x: &'a [u16],
    y: &'a [u16],
}

impl Run<'_> {
    /// Circle x + y = `circle` of the tile of side S whose southern corner is `south`, away from φ = 0.
    #[inline]
    fn of<const S: usize>(nside: Nside, south: FacePixel, circle: usize) -> Option<Self> {
        let x_west = circle.saturating_sub(S - 1);
        let len = S.min(circle + 1) - x_west;
        let y_west = circle - x_west;
        let west = FacePixel {
            face: south.face,
            x: south.x + x_west as u64,
            y: south.y + y_west as u64,
        };
        let from = (SIDE - 1).checked_sub(y_west)?;
        Some(Self {
            first: layout::pixel_number(nside, west.to_ring(nside)) as usize,
            x: PLACES_X.get(x_west..x_west + len)?,
            y: PLACES_Y.get(from..from + len)?,
        })
    }

    #[inline]
    fn places<const A: usize>(&self) -> impl Iterator<Item = usize> {
        let place = |(&x, &y): (&u16, &u16)| usize::from(x | y) & (A - 1);
        self.x.iter().zip(self.y).map(place)
    }
}

/// Does φ = 0 go through a tile?
#[inline]
const fn on_meridian(south: FacePixel) -> bool {
    south.face == 4 && south.x == south.y
}

/// Fills the small tile whose southern corner is `south`; false, and nothing of use written, if φ = 0 goes through it.
fn fill_tile<T: Copy>(
    nside: Nside,
    south: FacePixel,
    ring: &[T],
    tile: &mut [T; SMALL_TILE],
) -> bool {
    if on_meridian(south) {
        return false;
    }
    for circle in 0..2 * SMALL_SIDE - 1 {
        let Some(run) = Run::of::<SMALL_SIDE>(nside, south, circle) else {
            return false;
        };
        let Some(values) = ring.get(run.first..run.first + run.x.len()) else {
            return false;
        };
        for (&value, place) in values.iter().zip(run.places::<SMALL_TILE>()) {
            tile[place] = value;
        }
    }
    true
}

/// Writes all tiles of a NESTED map into the RING map.
fn empty<const S: usize, const A: usize, T: Copy>(
    nside: Nside,
    order: u32,
    nested: &[T],
    ring: &mut [T],
) {
    let (tiles, _) = nested.as_chunks::<A>();
    for (pixel, tile) in (0..).step_by(A).zip(tiles) {
        let south = FacePixel::from_nested(order, pixel);
        if on_meridian(south) {
            for (pixel, &value) in (pixel..).zip(tile) {
                let to = order::nest2ring_valid(nside, order, pixel);
                if let Some(to) = ring.get_mut(to as usize) {
                    *to = value;
                }
            }
            continue;
        }
        for circle in 0..2 * S - 1 {
            let Some(run) = Run::of::<S>(nside, south, circle) else {
                continue;
            };
            let Some(values) = ring.get_mut(run.first..run.first + run.x.len()) else {
                continue;
            };
            for (value, place) in values.iter_mut().zip(run.places::<A>()) {
                *value = tile[place];
            }
        }
    }
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
    if ring.len() == nested.len() && nside.get() >= SMALL_SIDE as u64 {
        if nside.get() < 4 * SIDE as u64 {
            empty::<SMALL_SIDE, SMALL_TILE, T>(nside, order, nested, ring);
        } else {
            empty::<SIDE, TILE, T>(nside, order, nested, ring);
        }
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
