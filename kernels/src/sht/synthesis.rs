//! Coefficients → F_m on rings.
//!
//! ```text
//! for each group of V blocks of eight ring pairs, all in registers:
//!   q, before, even[C], odd[C] ← start, 0, 0, 0
//!   while nothing counts:     recurrence only, scales looked at every CHECK steps
//!   while something does not: its q is zero for the sums
//!   then two steps at a time:
//!     (q, before) ← (next, q)
//!     for each channel: even += before · e_n; odd += before · o_n
//!   north, south ← even ± cos θ · odd
//! ```
//!
//! What makes it fast, and why it is right:
//! * *Register blocking:* V vectors advance together, so that each coefficient is broadcast once for all and the latency
//!   of the recurrence is hidden; V · (3 + 4 C) vectors must fit the registers.
//! * *The recurrence goes ahead:* the next q is asked for before the sums take the present one, and is there when they
//!   are done. The other way round the processor, which serves the oldest instruction first, has nothing to do while it
//!   waits for q: 1.55 instead of 1.7 multiply-adds per cycle.
//! * *Two steps at a time,* so that q and its predecessor change roles without moves.
//! * *Starts* of many blocks are computed in one go ([`start_all`]); for one group alone they take as long as fifty
//!   steps.

use super::legendre::{Coefficient, PhaseBlock, PhaseIndex, advance, first_active};
use super::recurrence::Step;
use super::rings::RingBlock;
use super::start::{CHECK, rescale, sine_power};
use crate::error::Error;
use crate::simd::{Aligned, Lanes, Level, Mask, Writer};
use core::array;

/// First value of the recurrence and its scale.
type Start = Aligned<2>;

/// Blocks whose starts are computed in one go.
const STARTS: usize = 24;

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
fn group<L: Lanes, const V: usize, const C: usize, const COLUMN: usize>(
    token: L::Token,
    rings: &[RingBlock; V],
    starts: &[Start; V],
    steps: &[Step],
    coefficients: &[[Coefficient; C]],
    (count, at): (usize, usize),
    (index, out): (PhaseIndex<'_>, &mut Writer<'_, L, [PhaseBlock]>),
) {
    let zero = L::splat(token, 0.0);
    let (mut y, mut before) = ([zero; V], [zero; V]);
    let (mut q, mut s) = ([zero; V], [zero; V]);
    for v in 0..V {
        y[v] = L::load(token, &rings[v].y);
        q[v] = L::load(token, &starts[v][0]);
        s[v] = L::load(token, &starts[v][1]);
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

    // by way of memory: indexed by what is not a constant, the sums would lie there through all of the above
    let mut parts = [[PhaseBlock::default(); C]; V];
    for c in 0..C {
        for k in 0..4 {
            for v in 0..V {
                sums[v][c][k].store(&mut parts[v][c][k]);
            }
        }
    }
    for c in 0..C {
        let divided = c >= index.divided;
        for v in 0..V {
            let to = index.at(c * count + at + v).unwrap_or(usize::MAX);
            out.put(to, finish::<L>(token, &parts[v][c], &rings[v], divided));
        }
    }
}

/// north, south ← even ± cos θ · odd, over sin²θ where that is asked for.
#[inline(always)]
fn finish<L: Lanes>(token: L::Token, sums: &PhaseBlock, ring: &RingBlock, divided: bool) -> [L; 4] {
    let mut factor = L::splat(token, 1.0);
    if divided {
        factor = L::load(token, &ring.inv_sin2);
    }
    let cos = L::load(token, &ring.cos) * factor;
    let mut values = [cos; 4];
    for part in 0..2 {
        let even = L::load(token, &sums[part]) * factor;
        let odd = L::load(token, &sums[part + 2]) * cos;
        values[part] = even + odd;
        values[part + 2] = even - odd;
    }
    values
}

/// The start of the recurrence on some blocks. In one go, because each alone waits for a chain of twenty operations.
#[inline(always)]
fn start_all<L: Lanes>(
    token: L::Token,
    rings: &[RingBlock],
    m: usize,
    norm: f64,
    starts: &mut [Start],
) {
    for (ring, start) in rings.iter().zip(starts) {
        let value = sine_power::<L>(token, norm, m as f64, &ring.log_sin);
        value.q.store(&mut start[0]);
        value.s.store(&mut start[1]);
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
    (index, out): (PhaseIndex<'_>, &mut Writer<'_, L, [PhaseBlock]>),
) {
    let count = rings.len();
    let mut at = first_active(rings, m);
    let mut batch = [Start::default(); STARTS];
    while let Some(rest) = rings.get(at..)
        && !rest.is_empty()
    {
        start_all::<L>(token, rest, m, norm, &mut batch);
        // groups that begin in the batch and end in it
        let end = if rest.len() > STARTS {
            STARTS - (V - 1)
        } else {
            rest.len()
        };
        let mut k = 0;
        while k < end
            && let (Some(rings), Some(starts)) = (rest.get(k..), batch.get(k..))
            && let (Some(ring), Some(start)) = (rings.first(), starts.first())
        {
            let place = (count, at + k);
            match (rings.first_chunk::<V>(), starts.first_chunk::<V>()) {
                (Some(group), Some(starts)) if group[V - 1].polar == ring.polar => {
                    let to = (index, &mut *out);
                    either::<L, V, C>(token, group, starts, steps, coefficients, place, to);
                    k += V;
                }
                _ => {
                    let (group, starts) = (array::from_ref(ring), array::from_ref(start));
                    let to = (index, &mut *out);
                    either::<L, 1, C>(token, group, starts, steps, coefficients, place, to);
                    k += 1;
                }
            }
        }
        at += k;
    }
}

/// In −sin²θ or cos²θ.
#[inline(always)]
fn either<L: Lanes, const V: usize, const C: usize>(
    token: L::Token,
    rings: &[RingBlock; V],
    starts: &[Start; V],
    steps: &[Step],
    coefficients: &[[Coefficient; C]],
    place: (usize, usize),
    out: (PhaseIndex<'_>, &mut Writer<'_, L, [PhaseBlock]>),
) {
    if rings[0].polar {
        group::<L, V, C, 2>(token, rings, starts, steps, coefficients, place, out);
    } else {
        group::<L, V, C, 1>(token, rings, starts, steps, coefficients, place, out);
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
/// | `index`, `out` | (channels, blocks) | F_m; blocks beyond the polar limit (`m_limit < m`) are left as they are |
///
/// # Errors
/// [`Error::Length`] unless `coefficients` is a multiple of `channels`, `steps` at least as long as one channel of it,
/// and `out` has the places of `index`.
pub fn synthesis(
    level: Level,
    rings: &[RingBlock],
    m: usize,
    norm: f64,
    steps: &[Step],
    channels: usize,
    coefficients: &[Coefficient],
    index: PhaseIndex<'_>,
    out: &mut [PhaseBlock],
) -> Result<(), Error> {
    let count = coefficients.len() / channels.max(1);
    Error::check_len("coefficients", count * channels, coefficients.len())?;
    Error::check_scratch("steps", count, steps.len())?;
    index.check(channels, (rings.len(), first_active(rings, m)), out.len())?;
    if rings.is_empty() {
        return Ok(());
    }
    let steps = steps.get(..count).unwrap_or(&[]);
    macro_rules! enter {
        ($channels:literal, $blocks:literal) => {{
            let coefficients = coefficients.as_chunks::<$channels>().0;
            crate::dispatch!(level, |token: L| synthesis_body::<L, $blocks, $channels>(
                token,
                rings,
                m,
                norm,
                steps,
                coefficients,
                (index, &mut Writer::new(token, out, index.stores))
            ));
        }};
    }
    match (channels, level.name() == "avx512") {
        (0, _) => {}
        (1, true) => enter!(1, 3),
        (1, false) => enter!(1, 1),
        (2, true) => enter!(2, 2),
        (2, false) => enter!(2, 1),
        (3, true) => enter!(3, 2),
        (3, false) => enter!(3, 1),
        _ => {
            return Err(Error::Domain {
                what: "channels, at most 3",
                value: channels as f64,
            });
        }
    }
    Ok(())
}
