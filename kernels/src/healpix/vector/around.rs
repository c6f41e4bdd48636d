//! The eight neighbours.
//!
//! NESTED: a step in x or y is a sum within the even or the odd bits, the others set (or cleared) so that the carry passes
//! them. A step over the border of a face wraps to the opposite side by itself, and only needs the right face; the few
//! pixels at a border get it one by one. Words are enough, at every Nside.
//!
//! RING: circles of constant x + y are rings, x − y counts half pixels along them, and so do eight neighbours on five
//! rings:
//!
//! * in the belt the rings are alike, and no face matters: the neighbours lie ½ or 1 pixel beside, whatever the face;
//! * in a cap the same holds within a quarter of longitude, counted from its middle: x − y = twice − (2 column + 1) q;
//! * at either end of a quarter (2 pixels in q) it does not, and pixels go through the scalar kernel.

use super::super::neighbours::{STEPS, crossing};
use super::super::nested::Nested;
use super::super::points::Order;
use super::super::ring::Ringwise;
use super::super::{NO_PIXEL, Nside};
use super::grid::Grid;
use super::place::Place;
use super::points::all_exist;
use super::slices::{Reads, Writes, count};
use crate::dispatch;
use crate::simd::{Bits, Lanes, Level, Mask};

type Planes<'a> = [Writes<'a, u64>; 8];

/// Which lanes lie at the borders of their face.
#[derive(Clone, Copy)]
struct Borders {
    x_first: u8,
    x_last: u8,
    y_first: u8,
    y_last: u8,
}

/// Gives the neighbours across a border their faces; their bits within the face have wrapped already.
#[inline(never)]
fn cross_borders(
    nside: Nside,
    borders: Borders,
    pixels: &[u64; 8],
    out: &mut Planes<'_>,
    k: usize,
) {
    let within = nside.get() * nside.get() - 1;
    let (even, odd) = (within & EVEN, within & ODD);
    let shift = within.count_ones();
    let mut left = borders.x_first | borders.x_last | borders.y_first | borders.y_last;
    while left != 0 {
        let lane = left.trailing_zeros() as usize;
        left &= left - 1;
        let Some(&pixel) = pixels.get(lane) else {
            return;
        };
        let face = pixel >> shift;
        let at = |mask: u8| ((mask >> lane) & 1) as i8;
        let (x_first, x_last) = (at(borders.x_first), at(borders.x_last));
        let (y_first, y_last) = (at(borders.y_first), at(borders.y_last));
        for (plane, (dx, dy)) in out.iter_mut().zip(STEPS) {
            let over_x = if dx < 0 { -x_first } else { dx * x_last };
            let over_y = if dy < 0 { -y_first } else { dy * y_last };
            if over_x == 0 && over_y == 0 {
                continue;
            }
            let Some(to) = plane.get(k).get_mut(lane) else {
                return;
            };
            *to = crossing(face, over_x, over_y).map_or(NO_PIXEL, |crossing| {
                let mut xy = *to & within;
                if crossing.polar {
                    xy ^= if over_x == 0 { 0 } else { even };
                    xy ^= if over_y == 0 { 0 } else { odd };
                    xy = ((xy & even) << 1) | ((xy & odd) >> 1);
                }
                (crossing.face(face) << shift) | xy
            });
        }
    }
}

const EVEN: u64 = 0x5555_5555_5555_5555;
const ODD: u64 = 0xaaaa_aaaa_aaaa_aaaa;

#[inline(always)]
fn nested_body<L: Lanes>(
    token: L::Token,
    nside: Nside,
    pixels: &[u64],
    out: [&mut [u64]; 8],
) -> bool {
    let n = count(pixels.len());
    let pixels = Reads::new(pixels);
    if !all_exist::<L>(token, nside.npix(), &pixels, n) {
        return false;
    }
    let within = nside.get() * nside.get() - 1;
    let even = L::Bits::splat(token, within & EVEN);
    let odd = L::Bits::splat(token, within & ODD);
    let (one, two) = (L::Bits::splat(token, 1), L::Bits::splat(token, 2));
    let face = L::Bits::splat(token, !within);
    let mut out = out.map(Writes::new);
    for k in 0..n {
        let p = L::Bits::load(token, pixels.get(k));
        let (x, y, base) = (p & even, p & odd, p & face);
        let x_up = ((x | odd) + one) & even;
        let x_down = (x - one) & even;
        let y_up = (((y | even) + two) & odd) | base;
        let y_down = ((y - two) & odd) | base;
        let y_same = y | base;
        (x_down | y_same).store(out[0].get(k));
        (x_down | y_up).store(out[1].get(k));
        (x | y_up).store(out[2].get(k));
        (x_up | y_up).store(out[3].get(k));
        (x_up | y_same).store(out[4].get(k));
        (x_up | y_down).store(out[5].get(k));
        (x | y_down).store(out[6].get(k));
        (x_down | y_down).store(out[7].get(k));
        let (x_first, x_last) = (L::is_zero(x), L::is_zero(x ^ even));
        let (y_first, y_last) = (L::is_zero(y), L::is_zero(y ^ odd));
        if (x_first | x_last | y_first | y_last).any() {
            let borders = Borders {
                x_first: x_first.bits(),
                x_last: x_last.bits(),
                y_first: y_first.bits(),
                y_last: y_last.bits(),
            };
            cross_borders(nside, borders, pixels.get(k), &mut out, k);
        }
    }
    for plane in out {
        plane.finish();
    }
    true
}

/// Neighbours of NESTED pixels; false, and nothing written, if one does not exist. All slices are equally long, and
/// Nside is a power of two.
pub(in super::super) fn nested_neighbours(
    level: Level,
    nside: Nside,
    _order: Nested,
    pixels: &[u64],
    out: [&mut [u64]; 8],
) -> bool {
    dispatch!(level, |token: L| nested_body::<L>(
        token, nside, pixels, out
    ))
}

/// Writes the neighbours of the lanes named by `border`, from the scalar kernel.
#[inline(never)]
fn one_by_one(nside: Nside, border: u8, pixels: &[u64; 8], out: &mut Planes<'_>, k: usize) {
    for (lane, &pixel) in pixels.iter().enumerate() {
        if (border >> lane) & 1 == 0 {
            continue;
        }
        for (plane, neighbour) in out.iter_mut().zip(Ringwise.neighbours(nside, pixel)) {
            if let Some(to) = plane.get(k).get_mut(lane) {
                *to = neighbour;
            }
        }
    }
}

/// What the neighbours of a pixel are counted from.
#[derive(Clone, Copy)]
struct Around<L: Lanes> {
    height: L,
    /// The middle of the quarter, in eighths of a turn; in the belt, 0.
    centre: L,
    /// Half pixels east of there.
    across: L,
}

/// A ring near a pixel: its first pixel, a quarter of its length, and half pixels from φ = 0 to the pixel's longitude.
#[derive(Clone, Copy)]
struct Near<L: Lanes> {
    first: L,
    quarter: L,
    twice: L,
}

impl<L: Lanes> Grid<L> {
    #[inline(always)]
    fn around(&self, at: Place<L>) -> (Around<L>, L::Mask) {
        // The rings two beyond those of this zone are all of one length.
        let caps = (self.n - self.two).lt(at.height.abs());
        if !caps.any() {
            return (
                Around {
                    height: at.height,
                    centre: self.zero,
                    across: at.twice,
                },
                caps,
            );
        }
        let index = (at.twice * self.half).floor();
        let pair = at.quarter + at.quarter;
        let upper = pair.le(index);
        let within = L::select(upper, index - pair, index);
        let odd = at.quarter.le(within);
        let within = L::select(odd, within - at.quarter, within);
        let border = caps & (within.eq(self.zero) | within.eq(at.quarter - self.one));
        let column = L::select(upper, self.c(5.0), self.one);
        let column = L::select(odd, column + self.two, column);
        let centre = self.where_set(caps, column);
        (
            Around {
                height: at.height,
                centre,
                across: centre.neg_mul_add(at.quarter, at.twice),
            },
            border,
        )
    }

    /// The ring `up` rings north.
    #[inline(always)]
    fn near(&self, from: Around<L>, up: f64) -> Near<L> {
        let height = from.height + self.c(up);
        let (cap, quarter) = self.ring_at(height);
        Near {
            first: self.first_pixel(cap, height.lt(self.zero), height, quarter),
            quarter,
            twice: from.centre.mul_add(quarter, from.across),
        }
    }

    /// The pixel at the same longitude.
    #[inline(always)]
    fn same(&self, at: Near<L>) -> L::Bits {
        let index = (at.twice * self.half).floor();
        (at.first + index).to_whole(self.token)
    }

    /// The pixels half a pixel west and east.
    #[inline(always)]
    fn beside(&self, at: Near<L>) -> (L::Bits, L::Bits) {
        let west = ((at.twice - self.one) * self.half).floor();
        let turn = at.quarter * self.c(4.0);
        let east = west + self.one;
        let east = L::select(turn.le(east), self.zero, east);
        let west = L::select(west.lt(self.zero), turn - self.one, west);
        (
            (at.first + west).to_whole(self.token),
            (at.first + east).to_whole(self.token),
        )
    }

    /// The pixels one pixel west and east on the pixel's own ring.
    #[inline(always)]
    fn next(&self, pixel: L, at: Place<L>) -> (L::Bits, L::Bits) {
        let turn = at.quarter * self.c(4.0);
        let index = (at.twice * self.half).floor();
        let first = index.eq(self.zero);
        let last = index.eq(turn - self.one);
        let west = L::select(first, pixel + turn, pixel) - self.one;
        let east = L::select(last, pixel - turn, pixel) + self.one;
        (west.to_whole(self.token), east.to_whole(self.token))
    }
}

#[inline(always)]
fn ring_body<L: Lanes>(
    token: L::Token,
    nside: Nside,
    pixels: &[u64],
    out: [&mut [u64]; 8],
) -> bool {
    let n = count(pixels.len());
    let pixels = Reads::new(pixels);
    if !all_exist::<L>(token, nside.npix(), &pixels, n) {
        return false;
    }
    let grid = Grid::<L>::new(token, nside);
    let mut out = out.map(Writes::new);
    for k in 0..n {
        let pixel = L::from_whole(token, L::Bits::load(token, pixels.get(k)));
        let place = grid.place_of_ring(pixel);
        let (around, border) = grid.around(place);
        let (sw, se) = grid.beside(grid.near(around, -1.0));
        let (w, e) = grid.next(pixel, place);
        let (nw, ne) = grid.beside(grid.near(around, 1.0));
        sw.store(out[0].get(k));
        w.store(out[1].get(k));
        nw.store(out[2].get(k));
        grid.same(grid.near(around, 2.0)).store(out[3].get(k));
        ne.store(out[4].get(k));
        e.store(out[5].get(k));
        se.store(out[6].get(k));
        grid.same(grid.near(around, -2.0)).store(out[7].get(k));
        if border.any() {
            one_by_one(nside, border.bits(), pixels.get(k), &mut out, k);
        }
    }
    for plane in out {
        plane.finish();
    }
    true
}

/// Neighbours of RING pixels; false, and nothing written, if one does not exist. All slices are equally long.
pub(in super::super) fn ring_neighbours(
    level: Level,
    nside: Nside,
    pixels: &[u64],
    out: [&mut [u64]; 8],
) -> bool {
    dispatch!(level, |token: L| ring_body::<L>(token, nside, pixels, out))
}
