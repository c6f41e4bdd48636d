//! The numbers of a grid, in all lanes.

use super::super::Nside;
use crate::simd::{Bits, Lanes};
use core::f64::consts::{FRAC_PI_4, PI};

/// √6, rounded.
pub(super) const SQRT_6: f64 = 2.449_489_742_783_178;
/// π/2 − its f64.
pub(super) const HALF_PI_LOW: f64 = 6.123_233_995_736_766e-17;

/// What the kernels need to know of a resolution.
#[derive(Clone, Copy)]
pub(super) struct Grid<L: Lanes> {
    pub(super) token: L::Token,
    pub(super) zero: L,
    pub(super) half: L,
    pub(super) one: L,
    pub(super) two: L,
    /// Nside.
    pub(super) n: L,
    /// 4 Nside: the length of a ring of the belt.
    pub(super) turn: L,
    /// 2 Nside (Nside − 1): the pixels of a cap.
    pub(super) cap: L,
    /// 12 Nside².
    pub(super) npix: L,
    /// Nside².
    pub(super) face: L,
    /// 2 Nside (Nside − 1) + 4 Nside²: where the belt would start if rings went on to the pole.
    pub(super) belt: L,
    /// Nside − 1.
    pub(super) last: L,
    pub(super) inverse_n: L,
    pub(super) half_inverse_n: L,
    pub(super) inverse_turn: L,
    pub(super) half_inverse_turn: L,
    pub(super) inverse_face: L,
    /// Nside² − 1: the bits of a NESTED pixel within its face.
    pub(super) within: L::Bits,
    /// π/4 / Nside: half a pixel of longitude in the belt.
    pub(super) belt_step: L,
    /// 2/(3 Nside): z from one ring of the belt to the next.
    pub(super) z_step: L,
    /// 1/(√6 Nside): sin(θ′/2) from one ring of a cap to the next.
    pub(super) sine_step: L,
    /// √6 Nside.
    pub(super) cap_scale: L,
}

impl<L: Lanes> Grid<L> {
    #[inline(always)]
    pub(super) fn new(token: L::Token, nside: Nside) -> Self {
        let n = nside.as_f64();
        Self {
            token,
            zero: L::splat(token, 0.0),
            half: L::splat(token, 0.5),
            one: L::splat(token, 1.0),
            two: L::splat(token, 2.0),
            n: L::splat(token, n),
            turn: L::splat(token, 4.0 * n),
            cap: L::splat(token, 2.0 * n * (n - 1.0)),
            npix: L::splat(token, 12.0 * n * n),
            face: L::splat(token, n * n),
            belt: L::splat(token, 2.0 * n * (n - 1.0) + 4.0 * n * n),
            last: L::splat(token, n - 1.0),
            inverse_n: L::splat(token, 1.0 / n),
            half_inverse_n: L::splat(token, 0.5 / n),
            inverse_turn: L::splat(token, 0.25 / n),
            half_inverse_turn: L::splat(token, 0.125 / n),
            inverse_face: L::splat(token, 1.0 / (n * n)),
            within: L::Bits::splat(token, nside.get() * nside.get() - 1),
            belt_step: L::splat(token, FRAC_PI_4 / n),
            z_step: L::splat(token, 2.0 / (3.0 * n)),
            sine_step: L::splat(token, 1.0 / (SQRT_6 * n)),
            cap_scale: L::splat(token, SQRT_6 * n),
        }
    }

    /// A constant in all lanes.
    #[inline(always)]
    pub(super) fn c(&self, value: f64) -> L {
        L::splat(self.token, value)
    }

    /// ⌊a/n⌋ for whole a below 2⁴⁸, given 1/n and 1/(2n): the half keeps the rounding away from whole quotients.
    #[inline(always)]
    pub(super) fn quotient(a: L, inverse: L, half_inverse: L) -> L {
        a.mul_add(inverse, half_inverse).floor()
    }

    /// a where the mask is set, else 0.
    #[inline(always)]
    pub(super) fn where_set(&self, mask: L::Mask, a: L) -> L {
        L::select(mask, a, self.zero)
    }

    /// π − 2a or 2a where `cap`, by `south`; π/2 − a elsewhere.
    #[inline(always)]
    pub(super) fn colatitude(&self, cap: L::Mask, south: L::Mask, a: L) -> L {
        let high = L::select(
            cap,
            L::select(south, self.c(PI), self.zero),
            self.c(0.5 * PI),
        );
        let low = L::select(
            cap,
            L::select(south, self.c(2.0 * HALF_PI_LOW), self.zero),
            self.c(HALF_PI_LOW),
        );
        let factor = L::select(cap, L::select(south, self.c(-2.0), self.two), self.c(-1.0));
        // The product is exact; the low part counts only where the sum cancels, but then it does.
        high + factor.mul_add(a, low)
    }
}
