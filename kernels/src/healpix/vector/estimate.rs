//! The arcs of a disc on eight rings, good enough to tell the pixels unless one of their centres is close to the rim.
//!
//! ```text
//! rough 1/√ → s and 1/s (third order) → q = sin²(Δφ/2) → rough 1/√ → √q (second order) → short arcsine → Δφ in pixels
//! at ∓ Δφ in fixed point: whole part → first pixel, last pixel; fraction near 0 → not certain
//! ```
//!
//! Roots and quotients of eight lanes take as long as thirty products, and the polynomial of a full arcsine is twice as
//! long. Here are the errors, for Nside up to 2²²:
//!
//! * Half widths up to a quarter turn come to 8e-12 of themselves, at most Nside pixels: 3.4e-5 pixels. Longer ones are
//!   half a ring minus those.
//! * s and 1/s come to 4 units in the last place, so 4 s s₀ q = c² − (z − z₀)² − (s − s₀)², c² the squared chord, is off by
//!   δ = 4e-15 c at most. That shifts the rim by at most 0.43 Nside δ/(√q s₀) pixels, below 3e-5 where √q exceeds u =
//!   1e-10 Nside c/s₀. The same goes for √(1 − q), where 1/s adds a little (and c/s₀ > ½). And the sign of q is certain
//!   beyond δ/(4 s s₀), which 1e-3 u exceeds, for s ≥ 0.8/Nside. All this holds where q and 1 − q are above u (u + 1e-3).
//!
//! So a rim farther than [`MARGIN`] = 1.2e-4 pixels from all centres, on a ring where q and 1 − q are that far from 0, is
//! on the side of them that it seems to be. The others, one vector in 250, are computed exactly.

use super::rim::Disc;
use super::zone::{Places, Rings, Zone};
use crate::simd::atan::rough_arcsine;
use crate::simd::{Bits, Lanes, Mask};

/// Fixed point: bits after the point. With 27 before it, places and their negatives fit the mantissa.
const FRACTION: u32 = 24;
/// Half of 2^53 units of 2^−24 and again half: what is added to it keeps its exponent, and its last bit is 2^−24.
const POINT: f64 = 1.5 * (1_u64 << (52 - FRACTION)) as f64;
/// Distance in pixels that counts as close, 2^−13.
const MARGIN: f64 = 1.0 / (1 << 13) as f64;
/// Bits of the fraction, plus the margin, that are zero where it is close to a whole number.
const CLOSE: u64 = (1 << FRACTION) - (2 << (FRACTION - 13));
/// The whole part of [`POINT`].
const OFFSET: u64 = POINT.to_bits() >> FRACTION;

/// What a disc's estimates are compared with.
#[derive(Clone, Copy)]
pub(super) struct Limits<L: Lanes> {
    /// 1/(4 s₀).
    inverse: L,
    /// The least q or 1 − q that is certain.
    least: L,
}

impl<L: Lanes> Limits<L> {
    #[inline(always)]
    pub(super) fn new(token: L::Token, disc: &Disc) -> Self {
        let sine = L::splat(token, disc.centre.sin_theta);
        let chord = L::splat(token, disc.chord2).sqrt();
        let u = L::splat(token, 1e-10 * disc.nside.as_f64()) * (chord / sine);
        Self {
            inverse: L::splat(token, 0.25) / sine,
            least: u * (u + L::splat(token, 1e-3)),
        }
    }
}

/// Estimated arcs.
#[derive(Clone, Copy)]
pub(super) struct Estimate<L: Lanes> {
    /// sin²(Δφ/2), and that or its complement, whichever is less.
    q: L,
    lesser: L,
    half_width: L,
    /// Ends of the arcs, in pixels from the first one's centre.
    from: L,
    to: L,
    /// ⌊from⌋ and ⌊to⌋, both plus [`OFFSET`].
    west: L::Bits,
    east: L::Bits,
    /// Is an end, if there is any, close to a centre?
    close: L::Mask,
}

/// √x and 1/√x, to a relative error of 5/16 e³ with e < 2^−12.9, or a few roundings if `fine`.
#[inline(always)]
pub(super) fn roots<L: Lanes>(token: L::Token, x: L, fine: bool) -> (L, L) {
    let rough = x.rough_inverse_sqrt();
    let root = x * rough;
    // (1 − e)^(−1/2) = 1 + e (1/2 + 3/8 e + 5/16 e² + …)
    let e = root.neg_mul_add(rough, L::splat(token, 1.0));
    let three_eighths = L::splat(token, 0.375);
    let series = if fine {
        e.mul_add(L::splat(token, 0.3125), three_eighths)
    } else {
        three_eighths
    };
    let rest = e * series.mul_add(e, L::splat(token, 0.5));
    (root.mul_add(rest, root), rough.mul_add(rest, rough))
}

impl<L: Lanes> Zone<L> {
    #[inline(always)]
    pub(super) fn estimate(&self, rings: Rings<L>) -> Estimate<L> {
        let Self { grid, .. } = self;
        let token = grid.token;
        let Rings {
            quarter,
            z,
            square,
            at,
            ..
        } = rings;
        let (s, inverse) = roots(token, square, true);
        let q = self.room(z, s) * (inverse * self.limits.inverse);
        let wide = grid.half.lt(q);
        let lesser = L::select(wide, grid.one - q, q);
        let (root, _) = roots(token, lesser, false);
        let eighth = rough_arcsine(token, root, lesser);
        let half_width = self.half_width(quarter, eighth, wide);
        let (from, to) = (at - half_width, at + half_width);
        let point = grid.c(POINT + MARGIN);
        let (west, east) = ((from + point).to_bits(), (to + point).to_bits());
        let close = L::Bits::splat(token, CLOSE);
        Estimate {
            q,
            lesser,
            half_width,
            from,
            to,
            west: west.shr::<FRACTION>(),
            east: east.shr::<FRACTION>(),
            close: L::is_zero(west & close) | L::is_zero(east & close),
        }
    }

    /// Where there is a certain arc that ends inside the ring. NaN is in no order.
    #[inline(always)]
    fn cut(&self, at: Estimate<L>) -> L::Mask {
        self.limits.least.lt(at.lesser) & !at.close
    }

    /// The pixel at place 1 − [`OFFSET`].
    #[inline(always)]
    fn next(&self, rings: Rings<L>) -> L::Bits {
        let next = L::Bits::splat(self.grid.token, 1_u64.wrapping_sub(OFFSET));
        rings.first.to_whole(self.grid.token) + next
    }

    /// Start and end of arcs of which each holds a pixel, but not the first or the last of its ring.
    #[inline(always)]
    pub(super) fn apart(&self, rings: Rings<L>, at: Estimate<L>) -> Option<(L::Bits, L::Bits)> {
        let grid = &self.grid;
        // What is wider than a pixel holds one.
        let some = self.cut(at) & grid.half.lt(at.half_width);
        let last = rings.quarter.mul_sub(grid.c(4.0), grid.one);
        let all = (some & grid.zero.lt(at.from) & at.to.lt(last)).all();
        let next = self.next(rings);
        all.then_some((next + at.west, next + at.east))
    }

    /// End of the western and start of the eastern part of arcs of which each holds the last pixel of its ring and the
    /// first, but not all.
    #[inline(always)]
    pub(super) fn around(&self, rings: Rings<L>, at: Estimate<L>) -> Option<(L::Bits, L::Bits)> {
        let grid = &self.grid;
        let token = grid.token;
        let pair = rings.quarter + rings.quarter;
        let turn = pair + pair;
        let before = at.from.le(-grid.one);
        let beyond = turn.le(at.to);
        // A hole wider than two pixels remains one.
        let hole = at.half_width.lt(pair - grid.one);
        let all = (self.cut(at) & hole & (before | beyond)).all();
        let next = self.next(rings);
        let start = next + at.west + grid.where_set(before, turn).to_whole(token);
        let end = next + at.east - grid.where_set(beyond, turn).to_whole(token);
        all.then_some((start, end))
    }

    /// Are all rings wholly inside?
    #[inline(always)]
    pub(super) fn is_whole(&self, at: Estimate<L>) -> bool {
        (self.grid.half.lt(at.q) & at.lesser.lt(-self.limits.least)).all()
    }

    /// The places of estimated arcs, if they are certain.
    #[inline(always)]
    pub(super) fn estimated_places(&self, at: Estimate<L>) -> Option<Places<L>> {
        let Self { grid, limits, .. } = self;
        let outside = at.lesser.lt(-limits.least);
        let offset = grid.c(OFFSET as f64);
        (self.cut(at) | outside).all().then_some(Places {
            some: grid.zero.lt(at.q),
            cut: at.q.lt(grid.one),
            west: L::from_whole(grid.token, at.west) - offset + grid.one,
            east: L::from_whole(grid.token, at.east) - offset,
        })
    }
}
