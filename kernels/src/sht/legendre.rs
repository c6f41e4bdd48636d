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
use crate::error::Error;
use crate::simd::{Aligned, Lanes, Stores};

/// Coefficients of one step and channel: even part real, imaginary, odd part real, imaginary.
pub type Coefficient = [f64; 4];

/// F_m on eight ring pairs: north real, imaginary, south real, imaginary.
pub type PhaseBlock = Aligned<4>;

/// Where the Legendre stage finds or leaves F_m: block b of channel c at index `places[c · blocks + b] + offset` of the
/// phases, or at c · blocks + b where there are no places.
///
/// So the orders of a batch may lie in tiles, one after another, without being copied there or from there.
#[derive(Clone, Copy, Debug)]
pub struct PhaseIndex<'a> {
    /// (channels, blocks); not looked at for blocks beyond the polar limit.
    pub places: Option<&'a [usize]>,
    /// Added to every place.
    pub offset: usize,
    /// First channel whose sums are sin²θ times F_m, as those of spin 2: they are divided.
    pub divided: usize,
    /// How synthesis writes F_m; the adjoint only reads.
    pub stores: Stores,
}

impl Default for PhaseIndex<'_> {
    /// One order alone, nothing to be divided.
    fn default() -> Self {
        Self {
            places: None,
            offset: 0,
            divided: usize::MAX,
            stores: Stores::Cached,
        }
    }
}

impl PhaseIndex<'_> {
    /// Index of entry c · blocks + b.
    #[inline(always)]
    pub(super) fn at(&self, entry: usize) -> Option<usize> {
        match self.places {
            Some(places) => places.get(entry)?.checked_add(self.offset),
            None => Some(entry + self.offset),
        }
    }

    /// The places of the first `entries` = channels · blocks, and the others.
    #[must_use]
    pub fn split_at(self, entries: usize) -> [Self; 2] {
        match self.places {
            Some(places) => {
                let (first, second) = places.split_at(entries.min(places.len()));
                [first, second].map(|places| Self {
                    places: Some(places),
                    ..self
                })
            }
            None => [
                self,
                Self {
                    offset: self.offset.saturating_add(entries),
                    ..self
                },
            ],
        }
    }

    /// Are there places for all, and phases at those of active blocks?
    pub(super) fn check(
        &self,
        channels: usize,
        (blocks, first): (usize, usize),
        phases: usize,
    ) -> Result<(), Error> {
        let count = channels * blocks;
        let Some(places) = self.places else {
            return Error::check_scratch("phases", self.offset.saturating_add(count), phases);
        };
        Error::check_len("places", count, places.len())?;
        for channel in places.chunks_exact(blocks.max(1)) {
            for place in channel.iter().skip(first) {
                let end = place.saturating_add(self.offset).saturating_add(1);
                Error::check_scratch("phases", end, phases)?;
            }
        }
        Ok(())
    }
}

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
