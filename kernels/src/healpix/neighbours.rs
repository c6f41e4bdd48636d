//! The eight pixels around a pixel.
//!
//! Inside a face they differ by ±1 in x and y. A step over the border comes in at the opposite side of another face, which
//! depends only on the row of the first (north, equator, south). Between two faces of a cap, whose shared edge runs along a
//! meridian, it comes in at the same side instead, with x and y exchanged. Where only three faces meet, there is no
//! diagonal neighbour.

use super::Nside;
use super::faces::{FacePixel, NO_PIXEL};

/// Steps (x, y) to the SW, W, NW, N, NE, E, SE, S.
pub(super) const STEPS: [(i8, i8); 8] = [
    (-1, 0),
    (-1, 1),
    (0, 1),
    (1, 1),
    (1, 0),
    (1, -1),
    (0, -1),
    (-1, -1),
];

/// The face on the other side of a border.
#[derive(Clone, Copy)]
pub(super) struct Crossing {
    /// Its row: 0 north, 1 equator, 2 south.
    row: u64,
    /// How many columns farther east.
    shift: u64,
    /// Along a meridian between two faces of a cap: the crossing coordinates stay at their end, and x and y change
    /// places.
    pub(super) polar: bool,
}

impl Crossing {
    /// The face reached from `face`.
    #[inline]
    pub(super) const fn face(self, face: u64) -> u64 {
        4 * self.row + (face + self.shift) % 4
    }
}

const fn to(row: u64, shift: u64) -> Option<Crossing> {
    Some(Crossing {
        row,
        shift,
        polar: false,
    })
}

const fn polar(row: u64, shift: u64) -> Option<Crossing> {
    Some(Crossing {
        row,
        shift,
        polar: true,
    })
}

/// By row; then by crossing −x, none, +x; then by crossing −y, none, +y.
const CROSSINGS: [[[Option<Crossing>; 3]; 3]; 3] = [
    [
        [to(2, 0), to(1, 0), None],
        [to(1, 1), to(0, 0), polar(0, 3)],
        [None, polar(0, 1), polar(0, 2)],
    ],
    [
        [None, to(2, 3), to(1, 3)],
        [to(2, 0), to(1, 0), to(0, 3)],
        [to(1, 1), to(0, 0), None],
    ],
    [
        [polar(2, 2), polar(2, 3), None],
        [polar(2, 1), to(2, 0), to(1, 0)],
        [None, to(1, 1), to(0, 0)],
    ],
];

/// The face beyond the border crossed by −1, 0 or 1 in x and y; None where three faces meet.
#[inline]
pub(super) fn crossing(face: u64, x: i8, y: i8) -> Option<Crossing> {
    let row = CROSSINGS.get((face / 4) as usize)?;
    *row.get((x + 1) as usize)?.get((y + 1) as usize)?
}

/// The pixel one step away; None where three faces meet.
#[inline]
fn step(n: u64, from: FacePixel, (dx, dy): (i8, i8)) -> Option<FacePixel> {
    let last = n - 1;
    let (over_x, x) = wrap(from.x, dx, last);
    let (over_y, y) = wrap(from.y, dy, last);
    let crossing = crossing(from.face, over_x, over_y)?;
    let face = crossing.face(from.face);
    if !crossing.polar {
        return Some(FacePixel { face, x, y });
    }
    let x = if over_x == 0 { x } else { last - x };
    let y = if over_y == 0 { y } else { last - y };
    Some(FacePixel { face, x: y, y: x })
}

/// (−1, 0 or 1 face, coordinate there) of a step by d from c on 0 … last.
#[inline]
const fn wrap(c: u64, d: i8, last: u64) -> (i8, u64) {
    match d {
        -1 if c == 0 => (-1, last),
        1 if c == last => (1, 0),
        _ => (0, c.wrapping_add_signed(d as i64)),
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
