//! The eight pixels around a pixel.
//!
//! Inside a face they differ by ±1 in x and y. Across an edge the face changes by a rule that depends only on the row of
//! the face (north, equator, south); across the pole-ward edges of a cap face x and y change places. A corner where only
//! three faces meet has no diagonal neighbour.

use super::Nside;
use super::faces::{FacePixel, NO_PIXEL};

/// Steps (x, y) to the SW, W, NW, N, NE, E, SE, S.
const STEPS: [(i64, i64); 8] = [
    (-1, 0),
    (-1, 1),
    (0, 1),
    (1, 1),
    (1, 0),
    (1, -1),
    (0, -1),
    (-1, -1),
];

/// The pixel one step away; None where three faces meet.
#[inline]
fn step(n: u64, from: FacePixel, (dx, dy): (i64, i64)) -> Option<FacePixel> {
    let last = n - 1;
    // Where a step leaves the face: −1, 0 or 1 face along x and y, and the wrapped coordinate.
    let (out_x, x) = wrap(from.x, dx, last);
    let (out_y, y) = wrap(from.y, dy, last);
    let column = from.face & 3;
    let east = (column + 1) & 3;
    let west = (column + 3) & 3;
    let opposite = (column + 2) & 3;
    let to = |face, x, y| Some(FacePixel { face, x, y });
    match (from.face / 4, out_x, out_y) {
        (_, 0, 0) => to(from.face, x, y),
        (0, 1, 0) => to(east, y, last),
        (0, 0, 1) => to(west, last, x),
        (0, -1, 0) => to(4 + column, x, y),
        (0, 0, -1) => to(4 + east, x, y),
        (0, 1, 1) => to(opposite, last, last),
        (0, -1, -1) => to(8 + column, x, y),
        (1, 1, 0) => to(column, x, y),
        (1, 0, 1) => to(west, x, y),
        (1, -1, 0) => to(8 + west, x, y),
        (1, 0, -1) => to(8 + column, x, y),
        (1, 1, -1) => to(4 + east, x, y),
        (1, -1, 1) => to(4 + west, x, y),
        (2, 1, 0) => to(4 + east, x, y),
        (2, 0, 1) => to(4 + column, x, y),
        (2, -1, 0) => to(8 + west, y, 0),
        (2, 0, -1) => to(8 + east, 0, x),
        (2, 1, 1) => to(column, x, y),
        (2, -1, -1) => to(8 + opposite, 0, 0),
        _ => None,
    }
}

/// (−1, 0 or 1 face, coordinate there) of a step by d from c on 0 … last.
#[inline]
const fn wrap(c: u64, d: i64, last: u64) -> (i64, u64) {
    match d {
        -1 if c == 0 => (-1, last),
        1 if c == last => (1, 0),
        _ => (0, c.wrapping_add_signed(d)),
    }
}

/// The numbers of the eight neighbours in SW, W, NW, N, NE, E, SE, S order, [`NO_PIXEL`] where there is none.
#[inline]
pub(super) fn of(nside: Nside, at: FacePixel, number: impl Fn(FacePixel) -> u64) -> [u64; 8] {
    STEPS.map(|d| step(nside.get(), at, d).map_or(NO_PIXEL, &number))
}

/// [`NO_PIXEL`] as None.
#[inline]
pub(super) fn as_options(pixels: [u64; 8]) -> [Option<u64>; 8] {
    pixels.map(|p| (p != NO_PIXEL).then_some(p))
}
