//! The inner loops of the Legendre stage, Σ_n q_n(θ) · coefficients and its transpose: what both have in common.
//!
//! ```text
//! synthesis, one order m, C channels                           adjoint
//!   q, before ← sin^m θ · norm, 0                                the same
//!   for n in 0 .. steps:                                         for n in 0 .. steps:
//!     for each channel: even += q · e_n; odd += q · o_n            for each channel: E_n += q · even; O_n += q · odd
//!     (q, before) ← ((a_n y + b_n) q − before, q)                  the same
//!   north, south ← even ± cos θ · odd                            even, odd were north + south, cos θ (north − south)
//! ```
//!
//! What makes it fast, and why it is right (see [`super::synthesis`] and [`super::adjoint`] for each loop):
//! * *Both hemispheres* share q, an even function of cos θ; the odd part is multiplied by cos θ once.
//! * *Channels:* C maps share one recurrence. Each accumulates as if alone, so a batch gives the bits of single maps.
//! * *Start phase:* while every lane is below 2^−100 only the recurrence runs (2 of the 2 + 4 C operations per step).
//! * *Masked phase:* while some lanes are, they contribute zero. Scales change only at multiples of
//!   [`CHECK`](super::start::CHECK) steps from the start, whatever the blocking, so the blocking leaves no trace in the
//!   bits.
//! * *Polar limit:* blocks of rings with m above [`RingBlock::m_limit`] are left out altogether.
//!
//! # The limit
//! 2 + 4 C multiply-adds per step, eight ring pairs and C channels; two 512-bit ones per cycle at best. On the machine
//! these loops were tuned on (Sapphire Rapids) dense ones with 512-bit loads beside them lower the clock by 9 % for one
//! load per three, 15 % for one per two; broadcast loads cost half of that, and stores as much as a multiply-add. So
//! both loops keep loads and stores few, beyond what the ports would allow.

use super::recurrence::Step;
use super::rings::RingBlock;
use crate::simd::Lanes;

/// Coefficients of one step and channel: even part real, imaginary, odd part real, imaginary.
pub type Coefficient = [f64; 4];
/// Vectors of eight, each on its own cache line: unaligned ones would straddle two, at half the speed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Aligned<const N: usize>(pub [[f64; 8]; N]);

impl<const N: usize> Default for Aligned<N> {
    fn default() -> Self {
        Self([[0.0; 8]; N])
    }
}

impl<const N: usize> core::ops::Deref for Aligned<N> {
    type Target = [[f64; 8]; N];
    #[inline(always)]
    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl<const N: usize> core::ops::DerefMut for Aligned<N> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}

/// F_m on eight ring pairs: north real, imaginary, south real, imaginary.
pub type PhaseBlock = Aligned<4>;

/// Number of leading blocks to skip for order m: those nearer to the pole than the polar limit.
pub(super) fn first_active(rings: &[RingBlock], m: usize) -> usize {
    rings.partition_point(|r| r.m_limit < m)
}

/// One step: q_{n+1} = (a y + b) q_n − q_{n−1}.
#[inline(always)]
pub(super) fn advance<L: Lanes, const V: usize, const COLUMN: usize>(
    token: L::Token,
    step: &Step,
    y: &[L; V],
    q: &mut [L; V],
    before: &mut [L; V],
) {
    let a = L::splat(token, step[0]);
    let b = L::splat(token, step[COLUMN]);
    for v in 0..V {
        let t = y[v].mul_add(a, b);
        let next = t.mul_sub(q[v], before[v]);
        before[v] = q[v];
        q[v] = next;
    }
}
