//! Spin 2 near the poles, F_m of Q and U → coefficients: the transpose of [`super::wigner`].
//!
//! As [`mod@super::adjoint`], with cells of both functions w⁺, w⁻ and their eight parts: S steps of 4 sums stay in
//! registers over all cells of a panel.
//!
//! ```text
//! for each panel of ring blocks, each chunk of CHECK steps, each tile of S steps:
//!   acc[S][4] ← sums[step][4]
//!   for each cell with values that count:
//!     w⁺_0, w⁻_0 … w⁺_S, w⁻_S ← recurrence
//!     acc[i][k] += w± north[k] + (−1)^i w∓ south[k]
//!   sums ← acc
//! ```
//!
//! 12 S multiply-adds cost 13 loads and 4 stores.

use super::adjoint::{Cell, Line, PANEL_LINES, Places, Sum, Turn, whole};
use super::legendre::{Coefficient, PhaseBlock, PhaseIndex, first_active};
use super::rings::RingBlock;
use super::start::{CHECK, power, rescale};
use super::wigner::{WignerStep, first_sign, load_pair};
use crate::error::Error;
use crate::simd::{Lanes, Level};

/// Lines of a cell: y, both functions, their predecessors, their scales, parts of the phases.
const N: usize = 15;
const Y: usize = 0;
const Q: usize = 1;
const BEFORE: usize = 3;
const SCALE: usize = 5;
const PARTS: usize = 7;

/// Length of [`wigner_adjoint`]'s scratch.
#[must_use]
pub const fn wigner_adjoint_scratch_len(steps: usize) -> usize {
    PANEL_LINES + 4 * steps.next_multiple_of(CHECK)
}

/// The start of both functions on one block, and its phases.
#[inline(always)]
fn begin<L: Lanes>(
    token: L::Token,
    ring: &RingBlock,
    m: usize,
    norms: [f64; 2],
    phases: (Option<&PhaseBlock>, Option<&PhaseBlock>),
    cell: &mut Cell<N>,
) {
    let zero = L::splat(token, 0.0);
    let outer = (m.abs_diff(2) as f64, &ring.log_sin);
    let inner = (2 * m.min(2)) as f64;
    let starts = [
        power::<L>(token, norms[0], outer, (inner, &ring.log_sin_half)),
        power::<L>(token, norms[1], outer, (inner, &ring.log_cos_half)),
    ];
    cell[Y][0] = ring.minus_versine;
    for i in 0..2 {
        starts[i].q.store(&mut cell[Q + i][0]);
        zero.store(&mut cell[BEFORE + i][0]);
        starts[i].s.store(&mut cell[SCALE + i][0]);
    }
    let sign = L::splat(token, first_sign(m));
    let parts = load_pair::<L>(token, sign, phases.0, phases.1);
    for k in 0..8 {
        parts[k].store(&mut cell[PARTS + k][0]);
    }
}

/// One step of both functions.
#[inline(always)]
fn advance<L: Lanes>(
    token: L::Token,
    step: &WignerStep,
    y: L,
    q: &mut [L; 2],
    before: &mut [L; 2],
) {
    let a = L::splat(token, step[0]);
    // a + g for w⁺, a − g for w⁻
    let b = [L::splat(token, step[2]), L::splat(token, step[1])];
    for i in 0..2 {
        let next = y.mul_add(a, b[i]).mul_sub(q[i], before[i]);
        before[i] = q[i];
        q[i] = next;
    }
}

/// Moves grown lanes to the next scale.
#[inline(always)]
fn settle<L: Lanes>(token: L::Token, cell: &mut Cell<N>) {
    for i in 0..2 {
        let mut q = L::load(token, &cell[Q + i][0]);
        let mut before = L::load(token, &cell[BEFORE + i][0]);
        let mut s = L::load(token, &cell[SCALE + i][0]);
        rescale::<L>(token, &mut q, &mut before, &mut s);
        q.store(&mut cell[Q + i][0]);
        before.store(&mut cell[BEFORE + i][0]);
        s.store(&mut cell[SCALE + i][0]);
    }
}

/// S steps of one cell, added to the sums in hand; the first step is an odd one if FLIPPED.
#[inline(always)]
fn cell_tile<L: Lanes, const S: usize, const MASKED: bool, const FLIPPED: bool>(
    token: L::Token,
    steps: &[WignerStep; S],
    cell: &mut Cell<N>,
    acc: &mut [[L; 4]; S],
) {
    let zero = L::splat(token, 0.0);
    let y = L::load(token, &cell[Y][0]);
    let (mut q, mut before, mut values) = ([zero; 2], [zero; 2], [[zero; 2]; S]);
    for i in 0..2 {
        q[i] = L::load(token, &cell[Q + i][0]);
        before[i] = L::load(token, &cell[BEFORE + i][0]);
    }
    for n in 0..S {
        for i in 0..2 {
            values[n][i] = if MASKED {
                let live = L::load(token, &cell[SCALE + i][0]).eq(zero);
                L::select(live, q[i], zero)
            } else {
                q[i]
            };
        }
        advance::<L>(token, &steps[n], y, &mut q, &mut before);
    }
    for i in 0..2 {
        q[i].store(&mut cell[Q + i][0]);
        before[i].store(&mut cell[BEFORE + i][0]);
    }
    for k in 0..4 {
        let north = L::load(token, &cell[PARTS + k][0]);
        let south = L::load(token, &cell[PARTS + 4 + k][0]);
        for n in 0..S {
            let [plus, minus] = values[n];
            let (over, under) = if k < 2 { (plus, minus) } else { (minus, plus) };
            let sum = over.mul_add(north, acc[n][k]);
            acc[n][k] = if (n % 2 == 1) != FLIPPED {
                under.neg_mul_add(south, sum)
            } else {
                under.mul_add(south, sum)
            };
        }
    }
}

/// One tile on all cells that count.
#[inline(always)]
fn tile<L: Lanes, const S: usize, const FLIPPED: bool>(
    token: L::Token,
    steps: &[WignerStep; S],
    (masked, plain): (&mut [Cell<N>], &mut [Cell<N>]),
    turn: Turn,
    sums: &mut [Sum; S],
    coefficients: &mut [Coefficient],
) {
    let mut acc = [[L::splat(token, 0.0); 4]; S];
    if !turn.first {
        for n in 0..S {
            for k in 0..4 {
                acc[n][k] = L::load(token, &sums[n][k][0]);
            }
        }
    }
    for cell in masked {
        cell_tile::<L, S, true, FLIPPED>(token, steps, cell, &mut acc);
    }
    for cell in plain {
        cell_tile::<L, S, false, FLIPPED>(token, steps, cell, &mut acc);
    }
    if turn.last {
        for n in 0..S {
            if let Some(to) = coefficients.get_mut(n) {
                *to = L::reduce_sums(acc[n]);
            }
        }
    } else {
        for n in 0..S {
            for k in 0..4 {
                acc[n][k].store(&mut sums[n][k][0]);
            }
        }
    }
}

/// All steps on one panel.
#[inline(always)]
fn panel<L: Lanes, const S: usize>(
    token: L::Token,
    steps: &[WignerStep],
    cells: &mut [Cell<N>],
    turn: Turn,
    sums: &mut [Sum],
    coefficients: &mut [Coefficient],
) {
    let mut places = Places {
        polar: cells.len(),
        dead: cells.len(),
        partial: cells.len(),
    };
    for ((steps, sums), coefficients) in steps
        .chunks(CHECK)
        .zip(sums.chunks_mut(CHECK))
        .zip(coefficients.chunks_mut(CHECK))
    {
        let mut filled = [[0.0; 4]; CHECK];
        let steps = whole(steps, &mut filled);
        places.update::<L, N, SCALE, PARTS>(token, cells);
        let (waiting, rest) = cells.split_at_mut(places.dead.min(cells.len()));
        for cell in waiting {
            let y = L::load(token, &cell[Y][0]);
            let mut q = [L::load(token, &cell[Q][0]), L::load(token, &cell[Q + 1][0])];
            let mut before = [
                L::load(token, &cell[BEFORE][0]),
                L::load(token, &cell[BEFORE + 1][0]),
            ];
            for step in steps {
                advance::<L>(token, step, y, &mut q, &mut before);
            }
            for i in 0..2 {
                q[i].store(&mut cell[Q + i][0]);
                before[i].store(&mut cell[BEFORE + i][0]);
            }
            settle::<L>(token, cell);
        }
        let (masked, plain) = rest.split_at_mut((places.partial - places.dead).min(rest.len()));
        // CHECK is even: the parity of l − l₀ is that of the position in any chunk
        let tiles = steps.as_chunks::<S>().0.iter();
        for (n, ((steps, sums), coefficients)) in tiles
            .zip(sums.as_chunks_mut::<S>().0)
            .zip(coefficients.chunks_mut(S))
            .enumerate()
        {
            let cells = (&mut *masked, &mut *plain);
            if S % 2 == 1 && n % 2 == 1 {
                tile::<L, S, true>(token, steps, cells, turn, sums, coefficients);
            } else {
                tile::<L, S, false>(token, steps, cells, turn, sums, coefficients);
            }
        }
        for cell in masked {
            settle::<L>(token, cell);
        }
    }
}

#[inline(always)]
fn adjoint_body<L: Lanes, const S: usize>(
    token: L::Token,
    rings: &[RingBlock],
    m: usize,
    norms: [f64; 2],
    steps: &[WignerStep],
    (index, phases): (PhaseIndex<'_>, &[PhaseBlock]),
    coefficients: &mut [Coefficient],
    scratch: &mut [Line],
) {
    let count = rings.len();
    let mut at = first_active(rings, m);
    if at == count {
        coefficients.fill([0.0; 4]);
        return;
    }
    let Some((cells, sums)) = scratch.split_at_mut_checked(PANEL_LINES) else {
        return;
    };
    let (cells, _) = cells.as_chunks_mut::<N>();
    let (sums, _) = sums.as_chunks_mut::<4>();
    let mut first = true;
    while let Some(rest) = rings.get(at..)
        && !rest.is_empty()
    {
        let size = rest.len().min(cells.len());
        for (b, (ring, cell)) in rest.iter().zip(cells.iter_mut()).enumerate() {
            let mut pair = (None, None);
            if let Some(place) = index.at(at + b) {
                pair.0 = phases.get(place);
            }
            if let Some(place) = index.at(count + at + b) {
                pair.1 = phases.get(place);
            }
            begin::<L>(token, ring, m, norms, pair, cell);
        }
        let last = at + size == count;
        let turn = Turn { first, last };
        let (cells, _) = cells.split_at_mut(size);
        panel::<L, S>(token, steps, cells, turn, sums, coefficients);
        first = false;
        at += size;
    }
}

/// The transpose of [`wigner_synthesis`](super::wigner_synthesis); `scratch`: [`wigner_adjoint_scratch_len`] lines,
/// contents of no consequence.
///
/// # Errors
/// [`Error::Length`] as there, and if `scratch` is too short.
pub fn wigner_adjoint(
    level: Level,
    rings: &[RingBlock],
    m: usize,
    norms: [f64; 2],
    steps: &[WignerStep],
    index: PhaseIndex<'_>,
    phases: &[PhaseBlock],
    coefficients: &mut [Coefficient],
    scratch: &mut [Line],
) -> Result<(), Error> {
    Error::check_len("coefficients", steps.len(), coefficients.len())?;
    Error::check_scratch(
        "scratch",
        wigner_adjoint_scratch_len(steps.len()),
        scratch.len(),
    )?;
    index.check(2, (rings.len(), first_active(rings, m)), phases.len())?;
    macro_rules! enter {
        ($s:literal) => {
            crate::dispatch!(level, |token: L| adjoint_body::<L, $s>(
                token,
                rings,
                m,
                norms,
                steps,
                (index, phases),
                coefficients,
                scratch
            ))
        };
    }
    // 16 sums of 32 registers, or 4 double ones of 16
    if level.name() == "avx512" {
        enter!(4);
    } else {
        enter!(1);
    }
    Ok(())
}
