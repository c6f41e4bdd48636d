//! Pixel numbers ↔ places on rings ↔ pixels of faces.
//!
//! The scalar kernels ([`layout`](super::super::layout), [`faces`](super::super::faces)) explain the formulae. What they
//! select case by case is arranged here so that little remains to select:
//!
//! * the southern half is the northern one read backwards, p → 12 N² − 1 − p;
//! * in the caps a quarter is worth N rising edges, and there are 2 N − i more falling ones, as in the belt;
//! * in row r of the belt a pixel at place j has passed j + ⌊r/2⌋ rising edges, and N − r more falling ones, whichever way
//!   the row is shifted;
//! * faces follow from the counts of edges in units of N, a rising and b falling: min(a, b) mod 4 + 4 (1 + a − b);
//! * ring q of either cap starts at ±2q² − 2q, from 0 or 12 N².

use super::grid::Grid;
use crate::simd::{Bits, Lanes, Mask};

/// A pixel by its ring.
#[derive(Clone, Copy)]
pub(super) struct Place<L: Lanes> {
    /// On a ring of 4 i pixels, i < Nside?
    pub(super) cap: L::Mask,
    /// South of the equator? Means something in the caps.
    pub(super) south: L::Mask,
    /// 2 Nside − ring.
    pub(super) height: L,
    /// A quarter of the ring's length.
    pub(super) quarter: L,
    /// Twice the centre's longitude in pixels of the ring, whole, 0 … 2 × the length.
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
    /// Ring and place of pixels of a cap, counted from its own pole.
    #[inline(always)]
    fn polar_place(&self, from_pole: L) -> (L, L) {
        // 2 i (i − 1) ≤ p < 2 i (i + 1) means (2i − 1)² ≤ 2p + 1 < (2i + 1)²; half a unit more, and the root is never at
        // an odd whole number, nor its half at a tie.
        let root = from_pole.mul_add(self.two, self.c(1.5)).sqrt();
        let ring = (root * self.half).round();
        let index = (ring + ring).neg_mul_add(ring - self.one, from_pole);
        (ring, index)
    }

    /// The place of a RING pixel.
    #[inline(always)]
    pub(super) fn place_of_ring(&self, pixel: L) -> Place<L> {
        let mirrored = (self.npix - self.one) - pixel;
        let from_pole = pixel.min(mirrored);
        let cap = from_pole.lt(self.cap);
        let south = mirrored.lt(pixel);
        let in_belt = pixel - self.cap;
        let row = Self::quotient(in_belt, self.inverse_turn, self.half_inverse_turn);
        let rising = row.neg_mul_add(self.turn, in_belt) + (row * self.half).floor();
        let height = self.n - row;
        let twice = rising.mul_add(self.two, self.one - row);
        if !cap.any() {
            return Place {
                cap,
                south,
                height,
                quarter: self.n,
                twice,
            };
        }
        let (ring, index) = self.polar_place(from_pole);
        let polar = index + index + self.one;
        let polar = L::select(south, self.c(8.0) * ring - polar, polar);
        let up = self.n + self.n - ring;
        Place {
            cap,
            south,
            height: L::select(cap, L::select(south, -up, up), height),
            quarter: L::select(cap, ring, self.n),
            twice: L::select(cap, polar, twice),
        }
    }

    /// Rising edges up to a place on a ring of the belt, `row` rings from the edge of the nearer cap.
    ///
    /// In the southern half places count from the ring's end. Where the ring is not shifted (odd rows), the mirror image
    /// of place j is the ring's length − j, not one less: one more edge.
    #[inline(always)]
    fn rising_in_belt(&self, south: L::Mask, row: L, index: L) -> L {
        index
            + row
                .mul_add(self.half, self.where_set(south, self.half))
                .floor()
    }

    /// The pixel of its face of a place on a ring, from its own pole: `ring` rings away, and in the southern half counted
    /// from the ring's end.
    #[inline(always)]
    pub(super) fn face_on_ring(
        &self,
        cap: L::Mask,
        south: L::Mask,
        ring: L,
        index: L,
    ) -> FacePixels<L> {
        let row = ring - self.n;
        if !cap.any() {
            return self.face_of_rising(south, row, self.rising_in_belt(south, row, index));
        }
        let rising = L::select(
            cap,
            self.rising_in_cap(ring, index),
            self.rising_in_belt(south, row, index),
        );
        self.face_of_rising(south, row, rising)
    }

    /// Rising edges up to a place in a cap: N a quarter, then one a pixel.
    #[inline(always)]
    fn rising_in_cap(&self, ring: L, index: L) -> L {
        let pair = ring + ring;
        let upper = pair.le(index);
        let index = L::select(upper, index - pair, index);
        let odd = ring.le(index);
        let west = L::select(odd, index - ring, index);
        let rising = L::select(upper, west + (self.n + self.n), west);
        L::select(odd, rising + self.n, rising)
    }

    /// The pixel after so many rising edges, N − `row` more falling ones, or the mirror image of that.
    #[inline(always)]
    fn face_of_rising(&self, south: L::Mask, row: L, rising: L) -> FacePixels<L> {
        // Mirrored, both counts come from the other end of 5 N − 1.
        let all = self.c(5.0) * self.n - self.one;
        let more = self.n - row;
        let rising = L::select(south, all - rising, rising);
        let more = L::select(south, -more, more);
        self.face_in_belt(rising, rising + more)
    }

    /// The pixel after so many rising and falling edges of the belt.
    #[inline(always)]
    fn face_in_belt(&self, rising: L, falling: L) -> FacePixels<L> {
        let a = Self::quotient(rising, self.inverse_n, self.half_inverse_n);
        let b = Self::quotient(falling, self.inverse_n, self.half_inverse_n);
        let four = self.c(4.0);
        // Four of either is the first equatorial face again.
        let column = a.min(b);
        let column = L::select(column.eq(four), self.zero, column);
        FacePixels {
            face: (a - b).mul_add(four, column + four),
            x: b.neg_mul_add(self.n, falling),
            y: a.mul_add(self.n, self.last - rising),
        }
    }

    /// The pixel of its face of a NESTED pixel.
    #[inline(always)]
    pub(super) fn face_of_nested(&self, pixel: L::Bits) -> FacePixels<L> {
        let token = self.token;
        // Nside² is a power of two: the product is exact.
        let face = (L::from_whole(token, pixel) * self.inverse_face).floor();
        let xy = (pixel & self.within).deinterleave(token);
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
        let column = row.neg_mul_add(self.c(4.0), face);
        // F₂ = 2 column + 1 for the polar rows 0 and 2, 2 column for row 1.
        let from_equator = row - self.one;
        let centre = from_equator.mul_add(from_equator, column + column);
        let height = row.neg_mul_add(self.n, x + y + self.one);
        let (cap, quarter) = self.ring_at(height);
        let twice = centre.mul_add(quarter, x - y);
        // Face 4 reaches across φ = 0.
        let twice = L::select(
            twice.lt(self.zero),
            quarter.mul_add(self.c(8.0), twice),
            twice,
        );
        Place {
            cap,
            south: height.lt(self.zero),
            height,
            quarter,
            twice,
        }
    }

    /// Is the ring at 2 Nside − ring = `height` in a cap, and a quarter of its length.
    #[inline(always)]
    pub(super) fn ring_at(&self, height: L) -> (L::Mask, L) {
        let distance = height.abs();
        let cap = self.n.lt(distance);
        (cap, self.n.min(self.n + self.n - distance))
    }

    /// The first pixel of a ring.
    #[inline(always)]
    pub(super) fn first_pixel(&self, cap: L::Mask, south: L::Mask, height: L, quarter: L) -> L {
        let pair = quarter + quarter;
        let square = pair * quarter;
        let polar = L::select(south, self.npix - square, square) - pair;
        L::select(cap, polar, height.neg_mul_add(self.turn, self.belt))
    }

    /// The RING number of a place.
    #[inline(always)]
    pub(super) fn ring_of_place(&self, at: Place<L>) -> L {
        let first = self.first_pixel(at.cap, at.south, at.height, at.quarter);
        first + (at.twice * self.half).floor()
    }

    /// The pixel of its face after so many edges.
    #[inline(always)]
    pub(super) fn face_of_edges(&self, at: Edges<L>) -> FacePixels<L> {
        let Edges {
            cap,
            south,
            quarter,
            west,
            east,
        } = at;
        let belt = self.face_in_belt(west, east);
        if !cap.any() {
            return belt;
        }
        let x = L::select(south, west, self.last - east);
        let y = L::select(south, east, self.last - west);
        let face = L::select(south, quarter + self.c(8.0), quarter);
        FacePixels {
            face: L::select(cap, face, belt.face),
            x: L::select(cap, x, belt.x),
            y: L::select(cap, y, belt.y),
        }
    }

    /// The NESTED number of a pixel of a face.
    #[inline(always)]
    pub(super) fn nested_of_face(&self, at: FacePixels<L>) -> L::Bits {
        let token = self.token;
        let (x, y) = (at.x.to_whole(token), at.y.to_whole(token));
        let base = (at.face * self.face).to_whole(token);
        x.interleave(y) | base
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
        // Belt: 2 Nside − ring = falling − rising; rising + falling + 1 − Nside half pixels of longitude.
        let index = ((west + east + (self.one - self.n)) * self.half).floor();
        let index = L::select(index.lt(self.zero), index + self.turn, index);
        let index = L::select(self.turn.le(index), index - self.turn, index);
        let belt = (east - west).neg_mul_add(self.turn, self.belt) + index;
        if !cap.any() {
            return belt;
        }
        let ring = west + east + self.one;
        let pair = ring + ring;
        let square = pair * ring;
        let first = L::select(south, self.npix - square, square) - pair;
        L::select(cap, quarter.mul_add(ring, first + west), belt)
    }
}
