//! Pixel numbers ↔ places on rings ↔ edges passed.
//!
//! The scalar kernels ([`layout`](super::super::layout), [`faces`](super::super::faces)) explain the formulae; here the
//! two caps share theirs: south of the equator, pixels count back from the last.

use super::grid::Grid;
use crate::simd::{Bits, Lanes, Mask};

/// A pixel by its ring.
#[derive(Clone, Copy)]
pub(super) struct Place<L: Lanes> {
    /// On a ring of 4 i pixels, i < Nside?
    pub(super) cap: L::Mask,
    /// South of the equator? Means nothing on the equator.
    pub(super) south: L::Mask,
    /// 2 Nside − ring.
    pub(super) height: L,
    /// A quarter of the ring's length.
    pub(super) quarter: L,
    /// Twice the centre's longitude in pixels of the ring, whole.
    pub(super) twice: L,
}

/// A pixel by the number of pixel edges on its way; see `faces::Edges`.
#[derive(Clone, Copy)]
pub(super) struct Edges<L: Lanes> {
    pub(super) cap: L::Mask,
    pub(super) south: L::Mask,
    /// In the caps, the quarter of longitude.
    pub(super) quarter: L,
    /// Rising edges in the belt; in the caps, edges east of the quarter's western meridian.
    pub(super) west: L,
    /// Falling edges in the belt; in the caps, edges west of the quarter's eastern meridian.
    pub(super) east: L,
}

/// A pixel by its face.
#[derive(Clone, Copy)]
pub(super) struct FacePixels<L: Lanes> {
    pub(super) face: L,
    pub(super) x: L,
    pub(super) y: L,
}

impl<L: Lanes> Grid<L> {
    /// The place of a RING pixel.
    #[inline(always)]
    pub(super) fn place_of_ring(&self, pixel: L) -> Place<L> {
        let mirrored = (self.npix - self.one) - pixel;
        let south = mirrored.lt(pixel);
        let from_pole = L::select(south, mirrored, pixel);
        let cap = from_pole.lt(self.cap);
        // Belt.
        let in_belt = pixel - self.cap;
        let row = self.quotient(in_belt, self.inverse_turn);
        let index = row.neg_mul_add(self.turn, in_belt);
        let odd = row - self.two * (row * self.half).floor();
        let twice = (index + index) + (self.one - odd);
        let belt = Place {
            cap,
            south,
            height: self.n - row,
            quarter: self.n,
            twice,
        };
        if !cap.any() {
            return belt;
        }
        // 2 i (i − 1) ≤ p < 2 i (i + 1).
        let root = (from_pole + from_pole + self.one).sqrt();
        let ring = (root + self.one) * self.half;
        let ring = ring.floor();
        let index = from_pole - (ring + ring) * (ring - self.one);
        let twice = index + index + self.one;
        // Mirrored, the ring is read from its end.
        let twice = L::select(south, self.c(8.0) * ring - twice, twice);
        let height = self.two * self.n - ring;
        Place {
            cap,
            south,
            height: L::select(cap, L::select(south, -height, height), belt.height),
            quarter: L::select(cap, ring, self.n),
            twice: L::select(cap, twice, belt.twice),
        }
    }

    /// The face coordinates of a NESTED pixel.
    #[inline(always)]
    pub(super) fn face_of_nested(&self, pixel: L::Bits) -> FacePixels<L> {
        let token = self.token;
        let number = L::from_whole(token, pixel);
        // Nside² is a power of two: the product is exact.
        let face = (number * self.inverse_face).floor();
        let within = face.neg_mul_add(self.face, number).to_whole(token);
        let xy = within.deinterleave(token);
        FacePixels {
            face,
            x: L::from_whole(token, xy & L::Bits::splat(token, 0xffff_ffff)),
            y: L::from_whole(token, xy.shr::<32>()),
        }
    }

    /// The place of a pixel of a face.
    #[inline(always)]
    pub(super) fn place_of_face(&self, at: FacePixels<L>) -> Place<L> {
        let FacePixels { face, x, y } = at;
        let row = (face * self.c(0.25)).floor();
        let column = face - row * self.c(4.0);
        // F₂, 0 … 7.
        let centre = L::select(
            row.eq(self.one),
            column + column,
            column + column + self.one,
        );
        let height = (x + y + self.one) - row * self.n;
        let distance = height.abs();
        let cap = self.n.lt(distance);
        let quarter = L::select(cap, self.n + self.n - distance, self.n);
        let twice = centre * quarter + (x - y);
        let twice = twice + self.where_set(twice.lt(self.zero), self.c(8.0) * quarter);
        Place {
            cap,
            south: height.lt(self.zero),
            height,
            quarter,
            twice,
        }
    }

    /// The RING number of a place.
    #[inline(always)]
    pub(super) fn ring_of_place(&self, at: Place<L>) -> L {
        let Place {
            cap,
            south,
            height,
            quarter,
            twice,
        } = at;
        let index = (twice * self.half).floor();
        let belt = self.cap + self.turn * (self.n - height);
        let pair = quarter + quarter;
        let first = L::select(
            cap,
            L::select(
                south,
                self.npix - pair * (quarter + self.one),
                pair * (quarter - self.one),
            ),
            belt,
        );
        first + index
    }

    /// The edges passed on the way to a place.
    #[inline(always)]
    pub(super) fn edges_of_place(&self, at: Place<L>) -> Edges<L> {
        let Place {
            cap,
            south,
            height,
            quarter,
            twice,
        } = at;
        // Belt: rising − falling = −height, rising + falling = twice + Nside − 1.
        let sum = twice + (self.n - self.one);
        let (rising, falling) = ((sum - height) * self.half, (sum + height) * self.half);
        if !cap.any() {
            return Edges {
                cap,
                south,
                quarter: self.zero,
                west: rising,
                east: falling,
            };
        }
        let index = (twice * self.half).floor();
        let (second, third) = (quarter + quarter, quarter + quarter + quarter);
        let count = self.where_set(quarter.le(index), self.one)
            + self.where_set(second.le(index), self.one)
            + self.where_set(third.le(index), self.one);
        let west = count.neg_mul_add(quarter, index);
        Edges {
            cap,
            south,
            quarter: count,
            west: L::select(cap, west, rising),
            east: L::select(cap, quarter - self.one - west, falling),
        }
    }

    /// The face coordinates after so many edges.
    #[inline(always)]
    pub(super) fn face_of_edges(&self, at: Edges<L>) -> FacePixels<L> {
        let Edges {
            cap,
            south,
            quarter,
            west,
            east,
        } = at;
        let (row_west, row_east) = (
            self.quotient(west, self.inverse_n),
            self.quotient(east, self.inverse_n),
        );
        let last = self.n - self.one;
        // Belt.
        let four = self.c(4.0);
        let equator = L::select(row_west.eq(four), four, row_west + four);
        let face = L::select(
            row_west.lt(row_east),
            row_west,
            L::select(row_east.lt(row_west), row_east + self.c(8.0), equator),
        );
        let x = row_east.neg_mul_add(self.n, east);
        let y = last - row_west.neg_mul_add(self.n, west);
        if !cap.any() {
            return FacePixels { face, x, y };
        }
        let cap_x = L::select(south, west, last - east);
        let cap_y = L::select(south, east, last - west);
        let cap_face = L::select(south, quarter + self.c(8.0), quarter);
        FacePixels {
            face: L::select(cap, cap_face, face),
            x: L::select(cap, cap_x, x),
            y: L::select(cap, cap_y, y),
        }
    }

    /// The NESTED number of a pixel of a face.
    #[inline(always)]
    pub(super) fn nested_of_face(&self, at: FacePixels<L>) -> L::Bits {
        let token = self.token;
        let (x, y) = (at.x.to_whole(token), at.y.to_whole(token));
        let base = (at.face * self.face).to_whole(token);
        (x | y.shl::<32>()).interleave(token) | base
    }

    /// The RING number of the pixel after so many edges.
    #[inline(always)]
    pub(super) fn ring_of_edges(&self, at: Edges<L>) -> L {
        let Edges {
            cap,
            south,
            quarter,
            west,
            east,
        } = at;
        // Belt: ring 2 Nside + rising − falling; rising + falling + 1 − Nside half pixels of longitude.
        let index = ((west + east + (self.one - self.n)) * self.half).floor();
        let index = index + self.where_set(index.lt(self.zero), self.turn);
        let index = index - self.where_set(self.turn.le(index), self.turn);
        let belt = self.cap + self.turn * (self.n + west - east) + index;
        if !cap.any() {
            return belt;
        }
        let ring = west + east + self.one;
        let pair = ring + ring;
        let first = L::select(
            south,
            self.npix - pair * (ring + self.one),
            pair * (ring - self.one),
        );
        L::select(cap, first + quarter * ring + west, belt)
    }
}
