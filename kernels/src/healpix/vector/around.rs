//! The eight neighbours, for pixels that do not touch the border of their face; those go one by one.
//!
//! NESTED: a step in x or y is a sum within the even or the odd bits, the others set (or cleared) so that the carry passes
//! them; words are enough, at every Nside. RING: x + y counts rings and x − y places along them, so eight neighbours lie
//! on five rings.

use super::super::Nside;
use super::super::nested::Nested;
use super::super::points::Order;
use super::super::ring::Ringwise;
use super::grid::Grid;
use super::place::{FacePixels, Place};
use super::points::all_exist;
use super::slices::{Reads, Writes, count};
use crate::dispatch;
use crate::simd::{Bits, Lanes, Level, Mask};

/// Writes the neighbours of the lanes named by `border`, from the scalar kernel.
#[inline(never)]
fn one_by_one<O: Order>(
    order: O,
    nside: Nside,
    border: u8,
    pixels: &[u64; 8],
    out: &mut [Writes<'_, u64>; 8],
    k: usize,
) {
    for (lane, &pixel) in pixels.iter().enumerate() {
        if (border >> lane) & 1 == 0 {
            continue;
        }
        for (plane, neighbour) in out.iter_mut().zip(order.neighbours(nside, pixel)) {
            if let Some(place) = plane.get(k).get_mut(lane) {
                *place = neighbour;
            }
        }
    }
}

#[inline(always)]
fn nested_body<L: Lanes>(
    token: L::Token,
    nside: Nside,
    order: Nested,
    pixels: &[u64],
    out: [&mut [u64]; 8],
) -> bool {
    let n = count(pixels.len());
    let pixels = Reads::new(pixels);
    if !all_exist::<L>(token, nside.npix(), &pixels, n) {
        return false;
    }
    let within = nside.get() * nside.get() - 1;
    let even = L::Bits::splat(token, within & 0x5555_5555_5555_5555);
    let odd = L::Bits::splat(token, within & 0xaaaa_aaaa_aaaa_aaaa);
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
        let border = L::is_zero(x) | L::is_zero(y) | L::is_zero(x ^ even) | L::is_zero(y ^ odd);
        if border.any() {
            one_by_one(order, nside, border.bits(), pixels.get(k), &mut out, k);
        }
    }
    for plane in out {
        plane.finish();
    }
    true
}

/// Neighbours of NESTED pixels; false, and nothing written, if one does not exist. All slices are equally long.
pub(in super::super) fn nested_neighbours(
    level: Level,
    nside: Nside,
    order: Nested,
    pixels: &[u64],
    out: [&mut [u64]; 8],
) -> bool {
    dispatch!(level, |token: L| nested_body::<L>(
        token, nside, order, pixels, out
    ))
}

/// A pixel of a face, seen from its ring: what its neighbours are counted from.
struct Around<L: Lanes> {
    height: L,
    /// F₂ of the face: its centre, in eighths of a turn.
    centre: L,
    /// x − y.
    across: L,
}

impl<L: Lanes> Grid<L> {
    /// The RING number of the pixel of the same face `up` circles north and `east` half pixels east.
    #[inline(always)]
    fn neighbour(&self, from: &Around<L>, up: f64, east: f64) -> L::Bits {
        let height = from.height + self.c(up);
        let distance = height.abs();
        let cap = self.n.lt(distance);
        let quarter = L::select(cap, self.n + self.n - distance, self.n);
        let twice = from.centre * quarter + (from.across + self.c(east));
        // Face 4 reaches across φ = 0.
        let twice = twice + self.where_set(twice.lt(self.zero), self.c(8.0) * quarter);
        let place = Place {
            cap,
            south: height.lt(self.zero),
            height,
            quarter,
            twice,
        };
        self.ring_of_place(place).to_whole(self.token)
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
    let last = grid.n - grid.one;
    let mut out = out.map(Writes::new);
    for k in 0..n {
        let place = grid.place::<false>(L::Bits::load(token, pixels.get(k)));
        let FacePixels { face, x, y } = grid.face_of_edges(grid.edges_of_place(place));
        let row = (face * grid.c(0.25)).floor();
        let column = face - row * grid.c(4.0);
        let at = Around {
            height: place.height,
            centre: column + column + grid.one - grid.where_set(row.eq(grid.one), grid.one),
            across: x - y,
        };
        grid.neighbour(&at, -1.0, -1.0).store(out[0].get(k));
        grid.neighbour(&at, 0.0, -2.0).store(out[1].get(k));
        grid.neighbour(&at, 1.0, -1.0).store(out[2].get(k));
        grid.neighbour(&at, 2.0, 0.0).store(out[3].get(k));
        grid.neighbour(&at, 1.0, 1.0).store(out[4].get(k));
        grid.neighbour(&at, 0.0, 2.0).store(out[5].get(k));
        grid.neighbour(&at, -1.0, 1.0).store(out[6].get(k));
        grid.neighbour(&at, -2.0, 0.0).store(out[7].get(k));
        let border = x.eq(grid.zero) | y.eq(grid.zero) | x.eq(last) | y.eq(last);
        if border.any() {
            one_by_one(Ringwise, nside, border.bits(), pixels.get(k), &mut out, k);
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
