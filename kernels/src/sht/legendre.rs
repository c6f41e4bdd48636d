//! The inner loops of the Legendre stage: Σ_n q_n(θ) · coefficients, and its transpose.
//!
//! ```text
//! synthesis, one order m, V · 8 ring pairs, C channels         adjoint
//!   q, before ← sin^m θ · norm, 0                                the same
//!   for n in 0 .. steps:                                         for n in 0 .. steps:
//!     for each channel: even += q · e_n; odd += q · o_n            for each channel: E_n += q · even; O_n += q · odd
//!     (q, before) ← ((a_n y + b_n) q − before, q)                  the same
//!   north, south ← even ± cos θ · odd                            even, odd were north + south, cos θ (north − south)
//! ```
//!
//! What makes it fast, and why it is right:
//! * *Both hemispheres* share q, an even function of cos θ; the odd part is multiplied by cos θ once, at the end.
//! * *Register blocking:* V vectors of eight ring pairs advance together, so that each coefficient is broadcast once for
//!   all and the latency of the recurrence is hidden; V · (3 + 4 C) vectors must fit the registers.
//! * *Channels:* C maps share one recurrence. Each accumulates as if alone, so a batch gives the bits of single maps.
//! * *Start phase:* while every lane is below 2^−100 only the recurrence runs (2 of the 2 + 4 C operations per step).
//! * *Masked phase:* while some lanes are, they contribute zero. Scales change only at multiples of
//!   [`CHECK`](super::start::CHECK) steps from the start, whatever the blocking, so the blocking leaves no trace in the bits.
//! * *Polar limit:* blocks of rings with m above [`RingBlock::m_limit`] are left out altogether.
//! * *Transpose:* the adjoint takes all rings through [`CHUNK`] steps before the next, so that its sums over rings stay
//!   in the first-level cache, eight lanes wide and in ring order; the lanes are added up once.

use super::recurrence::Step;
use super::rings::RingBlock;
use super::start::{CHECK, Scaled, power, rescale};
use crate::error::Error;
use crate::simd::{Lanes, Level, Mask};

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

/// Sums of one step and channel, eight lanes of each part of a [`Coefficient`].
pub type Sums = Aligned<4>;
/// F_m on eight ring pairs: north real, imaginary, south real, imaginary.
pub type PhaseBlock = Aligned<4>;

/// Number of leading blocks to skip for order m: those nearer to the pole than the polar limit.
pub(super) fn first_active(rings: &[RingBlock], m: usize) -> usize {
    rings.partition_point(|r| r.m_limit < m)
}

/// y and the start of the recurrence on V blocks.
#[inline(always)]
fn begin<L: Lanes, const V: usize>(
    token: L::Token,
    rings: &[RingBlock; V],
    m: usize,
    norm: f64,
) -> ([L; V], [Scaled<L>; V]) {
    let zero = L::splat(token, 0.0);
    let mut y = [zero; V];
    let mut start = [Scaled { q: zero, s: zero }; V];
    for v in 0..V {
        let r = &rings[v];
        y[v] = L::load(token, &r.y);
        start[v] = power::<L>(token, norm, (m as f64, &r.log_sin), (0.0, &r.log_sin));
    }
    (y, start)
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

/// Start phase: recurrence only, until some lane is worth summing. Returns the step reached.
#[inline(always)]
fn start_phase<L: Lanes, const V: usize, const COLUMN: usize>(
    token: L::Token,
    steps: &[Step],
    y: &[L; V],
    q: &mut [L; V],
    before: &mut [L; V],
    s: &mut [L; V],
) -> usize {
    let zero = L::splat(token, 0.0);
    let mut n = 0;
    for chunk in steps.chunks(CHECK) {
        let mut least = s[0].eq(zero);
        for s in &s[1..] {
            least = least | s.eq(zero);
        }
        if least.any() {
            break;
        }
        for step in chunk {
            advance::<L, V, COLUMN>(token, step, y, q, before);
        }
        for v in 0..V {
            rescale::<L>(token, &mut q[v], &mut before[v], &mut s[v]);
        }
        n += chunk.len();
    }
    n
}

/// Are all lanes worth summing?
#[inline(always)]
fn all_started<L: Lanes, const V: usize>(token: L::Token, s: &[L; V]) -> bool {
    let zero = L::splat(token, 0.0);
    let mut all = s[0].eq(zero);
    for s in &s[1..] {
        all = all & s.eq(zero);
    }
    all.all()
}

/// q where the lane is worth summing, else zero.
#[inline(always)]
fn masked<L: Lanes, const V: usize>(token: L::Token, q: &[L; V], s: &[L; V]) -> [L; V] {
    let zero = L::splat(token, 0.0);
    let mut live = [zero; V];
    for v in 0..V {
        live[v] = L::select(s[v].eq(zero), q[v], zero);
    }
    live
}

type Accumulators<L, const V: usize, const C: usize> = [[[L; 4]; C]; V];

#[inline(always)]
fn gather<L: Lanes, const V: usize, const C: usize>(
    token: L::Token,
    coefficient: &[Coefficient; C],
    q: &[L; V],
    sums: &mut Accumulators<L, V, C>,
) {
    for c in 0..C {
        for k in 0..4 {
            let x = L::splat(token, coefficient[c][k]);
            for v in 0..V {
                sums[v][c][k] = q[v].mul_add(x, sums[v][c][k]);
            }
        }
    }
}

#[inline(always)]
fn synthesis_group<L: Lanes, const V: usize, const C: usize, const COLUMN: usize>(
    token: L::Token,
    rings: &[RingBlock; V],
    m: usize,
    norm: f64,
    steps: &[Step],
    coefficients: &[[Coefficient; C]],
    (count, at): (usize, usize),
    out: &mut [PhaseBlock],
) {
    let (y, start) = begin::<L, V>(token, rings, m, norm);
    let zero = L::splat(token, 0.0);
    let (mut q, mut s, mut before) = ([zero; V], [zero; V], [zero; V]);
    for v in 0..V {
        (q[v], s[v]) = (start[v].q, start[v].s);
    }
    let mut sums: Accumulators<L, V, C> = [[[zero; 4]; C]; V];

    let n = start_phase::<L, V, COLUMN>(token, steps, &y, &mut q, &mut before, &mut s);
    let steps = steps.get(n..).unwrap_or(&[]);
    let coefficients = coefficients.get(n..).unwrap_or(&[]);

    // masked phase
    let mut n = 0;
    for (chunk, chunk_c) in steps.chunks(CHECK).zip(coefficients.chunks(CHECK)) {
        if all_started(token, &s) {
            break;
        }
        for (step, c) in chunk.iter().zip(chunk_c) {
            let live = masked(token, &q, &s);
            gather::<L, V, C>(token, c, &live, &mut sums);
            advance::<L, V, COLUMN>(token, step, &y, &mut q, &mut before);
        }
        for v in 0..V {
            rescale::<L>(token, &mut q[v], &mut before[v], &mut s[v]);
        }
        n += chunk.len();
    }
    let steps = steps.get(n..).unwrap_or(&[]);
    let coefficients = coefficients.get(n..).unwrap_or(&[]);

    // plain phase, two steps at a time so that q and before change roles without moves
    let (pairs, last) = steps.as_chunks::<2>();
    let (pairs_c, last_c) = coefficients.as_chunks::<2>();
    for (step, c) in pairs.iter().zip(pairs_c) {
        advance::<L, V, COLUMN>(token, &step[0], &y, &mut q, &mut before);
        gather::<L, V, C>(token, &c[0], &before, &mut sums);
        advance::<L, V, COLUMN>(token, &step[1], &y, &mut q, &mut before);
        gather::<L, V, C>(token, &c[1], &before, &mut sums);
    }
    if let ([_], [c]) = (last, last_c) {
        gather::<L, V, C>(token, c, &q, &mut sums);
    }

    for (c, channel) in out.chunks_exact_mut(count).take(C).enumerate() {
        let Some(to) = channel.get_mut(at..at + V) else {
            return;
        };
        for v in 0..V {
            let cos = L::load(token, &rings[v].cos);
            for part in 0..2 {
                let (even, odd) = (sums[v][c][part], sums[v][c][part + 2] * cos);
                (even + odd).store(&mut to[v][part]);
                (even - odd).store(&mut to[v][part + 2]);
            }
        }
    }
}

/// The pairs of rings of one order, group by group.
#[inline(always)]
fn synthesis_body<L: Lanes, const V: usize, const C: usize>(
    token: L::Token,
    rings: &[RingBlock],
    m: usize,
    norm: f64,
    steps: &[Step],
    coefficients: &[[Coefficient; C]],
    out: &mut [PhaseBlock],
) {
    let count = rings.len();
    let mut at = first_active(rings, m);
    while let Some(rest) = rings.get(at..)
        && let Some(first) = rest.first()
    {
        match rest.first_chunk::<V>() {
            Some(group) if group[V - 1].polar == first.polar => {
                let place = (count, at);
                if first.polar {
                    synthesis_group::<L, V, C, 2>(
                        token,
                        group,
                        m,
                        norm,
                        steps,
                        coefficients,
                        place,
                        out,
                    );
                } else {
                    synthesis_group::<L, V, C, 1>(
                        token,
                        group,
                        m,
                        norm,
                        steps,
                        coefficients,
                        place,
                        out,
                    );
                }
                at += V;
            }
            _ => {
                let group = core::array::from_ref(first);
                let place = (count, at);
                if first.polar {
                    synthesis_group::<L, 1, C, 2>(
                        token,
                        group,
                        m,
                        norm,
                        steps,
                        coefficients,
                        place,
                        out,
                    );
                } else {
                    synthesis_group::<L, 1, C, 1>(
                        token,
                        group,
                        m,
                        norm,
                        steps,
                        coefficients,
                        place,
                        out,
                    );
                }
                at += 1;
            }
        }
    }
}

/// Coefficients → F_m on rings, for one order and up to any number of channels.
///
/// | argument | shape | what |
/// | --- | --- | --- |
/// | `rings` | blocks | ring pairs, towards the equator |
/// | `norm` | | r_0/(α_0 sin^m θ), from [`super::start_norms`] and [`super::step_table`] |
/// | `steps` | steps | from [`super::step_table`]; may be longer |
/// | `coefficients` | (steps, channels) | from [`super::scalar_coefficients`] or [`super::spin2_coefficients`] |
/// | `out` | (channels, blocks) | F_m; blocks beyond the polar limit (`m_limit < m`) are left as they are |
///
/// # Errors
/// [`Error::Length`] unless `coefficients` is a multiple of `channels`, `steps` at least as long as one channel of it,
/// and `out` = channels · blocks.
pub fn synthesis(
    level: Level,
    rings: &[RingBlock],
    m: usize,
    norm: f64,
    steps: &[Step],
    channels: usize,
    coefficients: &[Coefficient],
    out: &mut [PhaseBlock],
) -> Result<(), Error> {
    let count = coefficients.len() / channels.max(1);
    Error::check_len("coefficients", count * channels, coefficients.len())?;
    Error::check_scratch("steps", count, steps.len())?;
    Error::check_len("phases", channels * rings.len(), out.len())?;
    if rings.is_empty() {
        return Ok(());
    }
    let steps = steps.get(..count).unwrap_or(&[]);
    macro_rules! enter {
        ($channels:literal, $wide:literal, $narrow:literal) => {{
            let coefficients = coefficients.as_chunks::<$channels>().0;
            if level.name() == "avx512" {
                $crate::dispatch!(level, |token: L| synthesis_body::<L, $wide, $channels>(
                    token,
                    rings,
                    m,
                    norm,
                    steps,
                    coefficients,
                    out
                ));
            } else {
                $crate::dispatch!(level, |token: L| synthesis_body::<L, $narrow, $channels>(
                    token,
                    rings,
                    m,
                    norm,
                    steps,
                    coefficients,
                    out
                ));
            }
        }};
    }
    match channels {
        0 => {}
        1 => enter!(1, 3, 1),
        2 => enter!(2, 2, 1),
        3 => enter!(3, 2, 1),
        _ => {
            return Err(Error::Domain {
                what: "channels, at most 3",
                value: channels as f64,
            });
        }
    }
    Ok(())
}
