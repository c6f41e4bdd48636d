//! RING → NESTED, in whole numbers.
//!
//! ```text
//! p → the same from the nearer pole → ring, place on it → edges passed, rising and falling → face, x, y → interleaved
//! ```
//!
//! The formulae are those of [`place`](super::place). Nside is a power of two here, so that quotients and remainders are
//! shifts and masks; only the ring of a cap needs a root, which is made from a rough inverse one, without dividers:
//!
//! * 2 i (i − 1) ≤ p < 2 i (i + 1) means (2i − 1)² ≤ 2p + 1 < (2i + 1)². The root of 2p + 1.5, at most 2 Nside ≤ 2²³, is at
//!   least ¼/2²³ = 3e-8 away from all odd numbers, where its half would be a tie, and comes to 2e-9: the nearest whole number
//!   to its half is i.
//! * The lesser of two counts of faces that differ by one at most is half their sum, and its remainder mod 4 the column.

use super::super::Nside;
use super::estimate::roots;
use super::points::all_exist;
use super::slices::{Reads, Writes, count};
use crate::dispatch;
use crate::simd::{Bits, Lanes, Level, Mask};

/// 2^52: what is added to it is rounded to the nearest whole number, and stands in the low bits.
const TWO_52: f64 = 4_503_599_627_370_496.0;

/// What there is to know of a grid.
#[derive(Clone, Copy)]
struct Words<L: Lanes> {
    token: L::Token,
    order: u32,
    one: L::Bits,
    three: L::Bits,
    four: L::Bits,
    /// Nside, and its double.
    n: L::Bits,
    pair: L::Bits,
    /// Nside − 1, 4 Nside − 1, 5 Nside − 1.
    last: L::Bits,
    turn: L::Bits,
    all: L::Bits,
    /// 2 Nside (Nside − 1): the pixels of a cap.
    cap: L::Bits,
    /// 12 Nside² − 1.
    last_pixel: L::Bits,
    two_52: L::Bits,
}

impl<L: Lanes> Words<L> {
    #[inline(always)]
    fn new(token: L::Token, nside: Nside) -> Self {
        let n = nside.get();
        let c = L::Bits::splat;
        Self {
            token,
            order: n.trailing_zeros(),
            one: c(token, 1),
            three: c(token, 3),
            four: c(token, 4),
            n: c(token, n),
            pair: c(token, 2 * n),
            last: c(token, n - 1),
            turn: c(token, 4 * n - 1),
            all: c(token, 5 * n - 1),
            cap: c(token, 2 * n * (n - 1)),
            last_pixel: c(token, nside.npix() - 1),
            two_52: c(token, TWO_52.to_bits()),
        }
    }

    /// The ring of pixels of a cap.
    #[inline(always)]
    fn ring_in_cap(&self, pixel: L::Bits) -> L::Bits {
        let c = |x: f64| L::splat(self.token, x);
        let square = L::from_whole(self.token, pixel).mul_add(c(2.0), c(1.5));
        let (root, _) = roots(self.token, square, true);
        root.mul_add(c(0.5), c(TWO_52)).to_bits() - self.two_52
    }

    #[inline(always)]
    fn nested(&self, pixel: L::Bits) -> L::Bits {
        // Both halves of the sky as the northern one.
        let mirrored = self.last_pixel - pixel;
        let south = L::words_lt(mirrored, pixel);
        let pixel = L::select_words(south, mirrored, pixel);
        let cap = L::words_lt(pixel, self.cap);
        let in_belt = pixel - self.cap;
        let mut row = in_belt.shr_by(self.order + 2);
        // Mirrored, places count from the ring's end: one more edge where the ring is not shifted.
        let half = L::select_words(south, row + self.one, row).shr::<1>();
        let mut rising = (in_belt & self.turn) + half;
        if cap.any() {
            let ring = self.ring_in_cap(pixel);
            let before = ring.mul_low(ring - self.one);
            let place = pixel - (before + before);
            let pair = ring + ring;
            // Quarters: Nside rising edges each.
            let lower = L::words_lt(place, pair);
            let place = L::select_words(lower, place, place - pair);
            let even = L::words_lt(place, ring);
            let place = L::select_words(even, place, place - ring);
            let polar = L::select_words(lower, place, place + self.pair);
            let polar = L::select_words(even, polar, polar + self.n);
            rising = L::select_words(cap, polar, rising);
            row = L::select_words(cap, ring - self.n, row);
        }
        // Nside − row more falling edges; mirrored, both counts come from the other end of 5 Nside − 1.
        let more = self.n - row;
        let rising = L::select_words(south, self.all - rising, rising);
        let falling = L::select_words(south, rising - more, rising + more);
        let (a, b) = (rising.shr_by(self.order), falling.shr_by(self.order));
        let column = (a + b).shr::<1>() & self.three;
        let face = (a - b).shl::<2>() + column + self.four;
        let (x, y) = (falling & self.last, (rising & self.last) ^ self.last);
        x.interleave(y) | face.shl_by(2 * self.order)
    }
}

#[inline(always)]
fn body<L: Lanes>(token: L::Token, nside: Nside, ring: &[u64], nested: &mut [u64]) -> bool {
    let n = count(ring.len());
    let ring = Reads::new(ring);
    if !all_exist::<L>(token, nside.npix(), &ring, n) {
        return false;
    }
    let words = Words::<L>::new(token, nside);
    let mut nested = Writes::new(nested);
    for k in 0..n {
        let pixel = L::Bits::load(token, ring.get(k));
        words.nested(pixel).store(nested.get(k));
    }
    nested.finish();
    true
}

/// NESTED numbers of RING pixels; false, and nothing written, if one does not exist. Both slices are equally long, and
/// Nside is a power of two.
pub(in super::super) fn ring2nest(
    level: Level,
    nside: Nside,
    ring: &[u64],
    nested: &mut [u64],
) -> bool {
    dispatch!(level, |token: L| body::<L>(token, nside, ring, nested))
}
