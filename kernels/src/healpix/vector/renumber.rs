//! RING → NESTED, in whole numbers.
//!
//! ```text
//! belt: p → row, place on it → rising edges passed, falling ones more than those
//! caps: p from the nearer pole → ring, place on it → the same
//! → face, x, y → interleaved
//! ```
//!
//! The formulae are those of [`place`](super::place). Nside is a power of two here, so that quotients and remainders are
//! shifts and masks; only the ring of a cap needs a root, which is made from a rough inverse one, without dividers:
//!
//! * 2 i (i − 1) ≤ p < 2 i (i + 1) means (2i − 1)² ≤ 2p + 1 < (2i + 1)². The root of 2p + 1.5, at most 2 Nside ≤ 2²³, is at
//!   least ¼/2²³ = 3e-8 away from all odd numbers. Its half, which comes to 1e-9, is thus within ½ of i and no tie.
//! * Of a and b, the edges between faces among the rising and the falling ones passed, 0 … 4 and at most one apart, 2a + b
//!   tells both, and a table the face.

use super::super::Nside;
use super::estimate::roots;
use super::points::all_exist;
use super::slices::{Reads, Writes, count};
use crate::dispatch;
use crate::simd::{Bits, Lanes, Level, Mask};

/// 2^52: what is added to it is rounded to the nearest whole number, and stands in the low bits.
const TWO_52: f64 = 4_503_599_627_370_496.0;

/// Faces by 2a + b: the polar ones where b = a + 1, the southern ones where a = b + 1.
const FACES: [u64; 13] = [4, 0, 8, 5, 1, 9, 6, 2, 10, 7, 3, 11, 4];

/// Vectors at a time.
const SIDE_BY_SIDE: usize = 4;

/// What there is to know of a grid.
#[derive(Clone, Copy)]
struct Words<L: Lanes> {
    token: L::Token,
    one: L::Bits,
    /// Shifts: by Nside and 4 Nside.
    by_side: L::Bits,
    by_turn: L::Bits,
    /// By 2a + b: the face's first pixel.
    faces: [u64; 16],
    /// Nside, and its double.
    n: L::Bits,
    pair: L::Bits,
    /// Nside − 1, 4 Nside − 1, 5 Nside − 1.
    last: L::Bits,
    turn: L::Bits,
    all: L::Bits,
    /// 2 Nside (Nside − 1): the pixels of a cap.
    cap: L::Bits,
    /// The last pixel, and the one in the middle.
    last_pixel: L::Bits,
    middle: L::Bits,
    two_52: L::Bits,
}

impl<L: Lanes> Words<L> {
    #[inline(always)]
    fn new(token: L::Token, nside: Nside) -> Self {
        let n = nside.get();
        let order = u64::from(n.trailing_zeros());
        let c = L::Bits::splat;
        let mut faces = [0; 16];
        for (face, pixel) in FACES.iter().zip(&mut faces) {
            *pixel = face << (2 * order);
        }
        Self {
            token,
            one: c(token, 1),
            by_side: c(token, order),
            by_turn: c(token, order + 2),
            faces,
            n: c(token, n),
            pair: c(token, 2 * n),
            last: c(token, n - 1),
            turn: c(token, 4 * n - 1),
            all: c(token, 5 * n - 1),
            cap: c(token, 2 * n * (n - 1)),
            last_pixel: c(token, nside.npix() - 1),
            middle: c(token, nside.npix() / 2 - 1),
            two_52: c(token, TWO_52.to_bits()),
        }
    }

    /// The ring of pixels of a cap.
    #[inline(always)]
    fn ring_in_cap(&self, pixel: L::Bits) -> L::Bits {
        let c = |x: f64| L::splat(self.token, x);
        let square = L::from_whole(self.token, pixel).mul_add(c(0.5), c(0.375));
        let (root, _) = roots(self.token, square, true);
        (root + c(TWO_52)).to_bits() - self.two_52
    }

    /// Rising edges of pixels on a ring of a cap, and how many more falling ones.
    #[inline(always)]
    fn edges_in_cap(&self, south: L::Mask, pixel: L::Bits, ring: L::Bits) -> (L::Bits, L::Bits) {
        let inner = ring.mul_low(ring - self.one);
        let place = pixel - (inner + inner);
        // Quarters: Nside rising edges each.
        let pair = ring + ring;
        let upper = !L::words_lt(place, pair);
        let place = L::select_words(upper, place - pair, place);
        let odd = !L::words_lt(place, ring);
        let rising = L::select_words(odd, place - ring, place);
        let rising = L::select_words(upper, rising + self.pair, rising);
        let rising = L::select_words(odd, rising + self.n, rising);
        // Mirrored, both counts come from the other end of 5 Nside − 1.
        let more = self.pair - ring;
        (
            L::select_words(south, self.all - rising, rising),
            L::select_words(south, ring - self.pair, more),
        )
    }

    /// Rising edges of pixels of the belt, and how many more falling ones.
    #[inline(always)]
    fn edges_in_belt(&self, pixel: L::Bits) -> (L::Bits, L::Bits) {
        let in_belt = pixel - self.cap;
        let row = in_belt.shr_by(self.by_turn);
        ((in_belt & self.turn) + row.shr::<1>(), self.n - row)
    }

    /// The number of the pixel after so many rising edges, and so many more falling ones.
    #[inline(always)]
    fn number(&self, (rising, more): (L::Bits, L::Bits)) -> L::Bits {
        let falling = rising + more;
        let (a, b) = (rising.shr_by(self.by_side), falling.shr_by(self.by_side));
        let face = (a + a + b).lookup(&self.faces);
        let (x, y) = (falling & self.last, (rising & self.last) ^ self.last);
        x.interleave(y) | face
    }

    /// NESTED numbers of several vectors of pixels, stage by stage side by side: what follows from one another in one
    /// takes as long as that.
    #[inline(always)]
    fn nested(&self, pixels: &mut [L::Bits; SIDE_BY_SIDE]) {
        let nothing = self.one;
        let never = L::words_lt(nothing, nothing);
        let (mut poles, mut rings) = ([nothing; SIDE_BY_SIDE], [nothing; SIDE_BY_SIDE]);
        let mut edges = [(nothing, nothing); SIDE_BY_SIDE];
        let (mut souths, mut caps) = ([never; SIDE_BY_SIDE], [never; SIDE_BY_SIDE]);
        let mut any = never;
        for k in 0..SIDE_BY_SIDE {
            let pixel = pixels[k];
            souths[k] = L::words_lt(self.middle, pixel);
            poles[k] = L::select_words(souths[k], self.last_pixel - pixel, pixel);
            caps[k] = L::words_lt(poles[k], self.cap);
            any = any | caps[k];
            edges[k] = self.edges_in_belt(pixel);
        }
        if any.any() {
            for k in 0..SIDE_BY_SIDE {
                rings[k] = self.ring_in_cap(poles[k]);
            }
            for k in 0..SIDE_BY_SIDE {
                let (rising, more) = self.edges_in_cap(souths[k], poles[k], rings[k]);
                edges[k] = (
                    L::select_words(caps[k], rising, edges[k].0),
                    L::select_words(caps[k], more, edges[k].1),
                );
            }
        }
        for k in 0..SIDE_BY_SIDE {
            pixels[k] = self.number(edges[k]);
        }
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
    let mut from = 0;
    while from < n {
        let mut pixels = [words.one; SIDE_BY_SIDE];
        for k in 0..SIDE_BY_SIDE {
            pixels[k] = L::Bits::load(token, ring.get(from + k));
        }
        words.nested(&mut pixels);
        for k in 0..SIDE_BY_SIDE {
            if from + k < n {
                pixels[k].store(nested.get(from + k));
            }
        }
        from += SIDE_BY_SIDE;
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
