//! F_m on rings → coefficients: the transpose of [`super::synthesis`].
//!
//! ```text
//! for each panel of ring blocks:
//!   cell[block] ← y, q, before, scale of the recurrence; even, odd = north + south, cos θ (north − south) of C channels
//!   for each chunk of CHECK steps:
//!     cells where all is negligible:  recurrence only
//!     for each tile of S steps:
//!       acc[S][C][4] ← sums[step][channel][4]            eight lanes each, in registers
//!       for each other cell:
//!         q_0 … q_S ← recurrence
//!         acc[i][c][k] += q_i · part[c][k]
//!       sums ← acc
//! coefficient ← the lanes of its sums added up
//! ```
//!
//! What makes it fast, and why it is right:
//! * *Tiles:* the 4 S C sums stay in registers over all blocks of a panel. One cell costs 2 S + 4 S C multiply-adds and
//!   only 3 + 4 C + 2 S loads and 2 stores: the arithmetic alone limits the speed. (Sums in memory, updated by every
//!   group of rings, take as many loads and stores as multiply-adds.)
//! * *Panels* are as long as the first-level cache holds their cells; sums meet memory once per panel.
//! * *Latency:* cells are independent of each other, and short enough for several to be under way at once.
//! * *Lanes* are added up once per coefficient and order, eight sums in one go.
//! * *Not a product of matrices:* for six channels at once the values q could go to memory, and tiles of nine steps by
//!   three vectors of columns (channel, part) take a ring at a time, one recurrence for all: 26 operations instead of
//!   28, no sums in memory and no lanes added up by shuffles. But its inner loop is no faster per operation (both keep
//!   the processor at the clock that such loops get), and values, more rows of phases and twice the tiles use up the
//!   rest: the Legendre stage alone 4 % faster at lmax 1024, transforms by 1 %, and nothing measurable at lmax 2048.
//! * The order of summation over rings is that of the rings, lane by lane, whatever the tiles and panels: all levels
//!   with fused multiply-add give the same bits, as do batches.

use super::legendre::{Coefficient, PhaseBlock, PhaseIndex, advance, first_active};
use super::recurrence::Step;
use super::rings::RingBlock;
use super::start::{CHECK, rescale, sine_power};
use crate::error::Error;
use crate::simd::{Aligned, Lanes, Level, Mask};
use core::array;
use core::hint::black_box;

/// A vector on its own cache line.
pub type Line = Aligned<1>;

/// Sums of one step and channel: eight lanes of each part of a [`Coefficient`].
pub(super) type Sum = [Line; 4];

/// A block in hand, N = 4 + 4 C vectors: state of the recurrence, then the parts of the phases.
pub(super) type Cell<const N: usize> = [Line; N];
const Y: usize = 0;
const Q: usize = 1;
const BEFORE: usize = 2;
const SCALE: usize = 3;
const PARTS: usize = 4;

/// Room for the cells of a panel: 40 KiB.
pub(super) const PANEL_LINES: usize = 640;

/// Length of [`adjoint`]'s scratch: the cells of a panel, and the sums, for whole chunks of steps.
#[must_use]
pub const fn adjoint_scratch_len(steps: usize, channels: usize) -> usize {
    PANEL_LINES + 4 * channels * steps.next_multiple_of(CHECK)
}

/// y, the start of the recurrence and the parts of one block.
#[inline(always)]
fn begin<L: Lanes, const C: usize, const N: usize>(
    token: L::Token,
    ring: &RingBlock,
    m: usize,
    norm: f64,
    (phases, divided): ([Option<&PhaseBlock>; C], usize),
    cell: &mut Cell<N>,
) {
    let start = sine_power::<L>(token, norm, m as f64, &ring.log_sin);
    cell[Y][0] = ring.y;
    start.q.store(&mut cell[Q][0]);
    L::splat(token, 0.0).store(&mut cell[BEFORE][0]);
    start.s.store(&mut cell[SCALE][0]);
    let cos = L::load(token, &ring.cos);
    for c in 0..C {
        let Some(phases) = phases[c] else { return };
        let mut parts = [cos; 4];
        for part in 0..4 {
            parts[part] = L::load(token, &phases[part]);
            if c >= divided {
                parts[part] *= L::load(token, &ring.inv_sin2);
            }
        }
        for part in 0..2 {
            let (north, south) = (parts[part], parts[part + 2]);
            (north + south).store(&mut cell[PARTS + 4 * c + part][0]);
            ((north - south) * cos).store(&mut cell[PARTS + 4 * c + part + 2][0]);
        }
    }
}

/// Is any, are all lanes of a cell worth summing? Its scales are lines FROM to TO − 1.
#[inline(always)]
fn started<L: Lanes, const N: usize, const FROM: usize, const TO: usize>(
    token: L::Token,
    cell: &Cell<N>,
) -> (bool, bool) {
    let (mut some, mut all) = (false, true);
    for line in FROM..TO {
        let live = L::load(token, &cell[line][0]).eq(L::splat(token, 0.0));
        some |= live.any();
        all &= live.all();
    }
    (some, all)
}

/// Steps of V cells without sums.
#[inline(always)]
fn walk<L: Lanes, const V: usize, const N: usize, const COLUMN: usize>(
    token: L::Token,
    steps: &[Step; CHECK],
    cells: &mut [Cell<N>; V],
) {
    let zero = L::splat(token, 0.0);
    let (mut y, mut q, mut before) = ([zero; V], [zero; V], [zero; V]);
    for v in 0..V {
        y[v] = L::load(token, &cells[v][Y][0]);
        q[v] = L::load(token, &cells[v][Q][0]);
        before[v] = L::load(token, &cells[v][BEFORE][0]);
    }
    for step in steps {
        advance::<L, V, COLUMN>(token, step, &y, &mut q, &mut before);
    }
    for v in 0..V {
        q[v].store(&mut cells[v][Q][0]);
        before[v].store(&mut cells[v][BEFORE][0]);
        settle::<L, N>(token, &mut cells[v]);
    }
}

/// Moves grown lanes to the next scale.
#[inline(always)]
fn settle<L: Lanes, const N: usize>(token: L::Token, cell: &mut Cell<N>) {
    let mut q = L::load(token, &cell[Q][0]);
    let mut before = L::load(token, &cell[BEFORE][0]);
    let mut s = L::load(token, &cell[SCALE][0]);
    rescale::<L>(token, &mut q, &mut before, &mut s);
    q.store(&mut cell[Q][0]);
    before.store(&mut cell[BEFORE][0]);
    s.store(&mut cell[SCALE][0]);
}

/// S steps of one cell, added to the sums in hand.
#[inline(always)]
fn cell_tile<
    L: Lanes,
    const S: usize,
    const C: usize,
    const N: usize,
    const COLUMN: usize,
    const MASKED: bool,
>(
    token: L::Token,
    steps: &[Step; S],
    cell: &mut Cell<N>,
    acc: &mut [[[L; 4]; C]; S],
) {
    let zero = L::splat(token, 0.0);
    // With 3 × 2 × 4 sums in hand there are no registers left for the factors of the steps, which the compiler would keep (and
    // write out and read back eight wide): it may not know that they are the same for all cells.
    let steps = if S == 3 { black_box(steps) } else { steps };
    let y = [L::load(token, &cell[Y][0])];
    let mut q = [L::load(token, &cell[Q][0])];
    let mut before = [L::load(token, &cell[BEFORE][0])];
    let mut values = [zero; S];
    for i in 0..S {
        values[i] = if MASKED {
            let live = L::load(token, &cell[SCALE][0]).eq(zero);
            L::select(live, q[0], zero)
        } else {
            q[0]
        };
        advance::<L, 1, COLUMN>(token, &steps[i], &y, &mut q, &mut before);
    }
    q[0].store(&mut cell[Q][0]);
    before[0].store(&mut cell[BEFORE][0]);
    for c in 0..C {
        for k in 0..4 {
            let part = L::load(token, &cell[PARTS + 4 * c + k][0]);
            for i in 0..S {
                acc[i][c][k] = values[i].mul_add(part, acc[i][c][k]);
            }
        }
    }
}

/// What a panel does with the sums.
#[derive(Clone, Copy)]
pub(super) struct Turn {
    /// Nothing is there yet.
    pub(super) first: bool,
    /// Nothing will be added.
    pub(super) last: bool,
}

/// How many leading cells of a panel …
pub(super) struct Places {
    /// … are nearer to the pole than 45°, with the recurrence in −sin²θ.
    pub(super) polar: usize,
    /// … have nothing that counts (rings nearer to the equator start first).
    pub(super) dead: usize,
    /// … have lanes that do not count.
    pub(super) partial: usize,
}

impl Places {
    /// Looks at the scales of the cells that may have started since.
    #[inline(always)]
    pub(super) fn update<L: Lanes, const N: usize, const FROM: usize, const TO: usize>(
        &mut self,
        token: L::Token,
        cells: &[Cell<N>],
    ) {
        while let Some(last) = self.partial.checked_sub(1)
            && cells
                .get(last)
                .is_some_and(|c| started::<L, N, FROM, TO>(token, c).1)
        {
            self.partial = last;
        }
        self.dead = self.dead.min(self.partial);
        while let Some(last) = self.dead.checked_sub(1)
            && cells
                .get(last)
                .is_some_and(|c| started::<L, N, FROM, TO>(token, c).0)
        {
            self.dead = last;
        }
    }
}

/// Steps of some cells without sums.
#[inline(always)]
fn walk_all<L: Lanes, const N: usize, const COLUMN: usize>(
    token: L::Token,
    steps: &[Step; CHECK],
    cells: &mut [Cell<N>],
) {
    let (fours, single) = cells.as_chunks_mut::<4>();
    for four in fours {
        walk::<L, 4, N, COLUMN>(token, steps, four);
    }
    for cell in single {
        walk::<L, 1, N, COLUMN>(token, steps, array::from_mut(cell));
    }
}

/// The lanes of each sum added up, those of two coefficients at once.
#[inline(always)]
fn lane_sums<L: Lanes, const S: usize, const C: usize>(
    acc: &[[[L; 4]; C]; S],
) -> [[Coefficient; C]; S] {
    let mut out = [[[0.0; 4]; C]; S];
    let (pairs, last) = acc.as_flattened().as_chunks::<2>();
    let (pairs_out, last_out) = out.as_flattened_mut().as_chunks_mut::<2>();
    for (to, &[[a, b, c, d], [e, f, g, h]]) in pairs_out.iter_mut().zip(pairs) {
        let [a, b, c, d, e, f, g, h] = L::reduce_eight([a, b, c, d, e, f, g, h]);
        *to = [[a, b, c, d], [e, f, g, h]];
    }
    for (to, &sums) in last_out.iter_mut().zip(last) {
        *to = L::reduce_sums(sums);
    }
    out
}

/// One chunk of steps on the cells of a panel.
#[inline(always)]
fn chunk<L: Lanes, const S: usize, const C: usize, const N: usize>(
    token: L::Token,
    steps: &[Step; CHECK],
    cells: &mut [Cell<N>],
    places: &mut Places,
    turn: Turn,
    sums: &mut [[Sum; C]],
    coefficients: &mut [[Coefficient; C]],
) {
    places.update::<L, N, SCALE, PARTS>(token, cells);
    let Places {
        polar,
        dead,
        partial,
    } = *places;
    let (waiting, rest) = cells.split_at_mut(dead.min(cells.len()));
    let (pole, equator) = waiting.split_at_mut(polar.min(dead));
    walk_all::<L, N, 2>(token, steps, pole);
    walk_all::<L, N, 1>(token, steps, equator);
    if rest.is_empty() && !turn.last {
        if turn.first {
            sums.fill([[Line::default(); 4]; C]);
        }
        return;
    }
    let (masked, plain) = rest.split_at_mut((partial - dead).min(rest.len()));
    let (masked_pole, masked_equator) = masked.split_at_mut(polar.clamp(dead, partial) - dead);
    let (pole, equator) = plain.split_at_mut(polar.saturating_sub(partial).min(plain.len()));
    let zero = L::splat(token, 0.0);
    for ((steps, sums), coefficients) in steps
        .as_chunks::<S>()
        .0
        .iter()
        .zip(sums.as_chunks_mut::<S>().0)
        .zip(coefficients.chunks_mut(S))
    {
        let mut acc = [[[zero; 4]; C]; S];
        if !turn.first {
            for i in 0..S {
                for c in 0..C {
                    for k in 0..4 {
                        acc[i][c][k] = L::load(token, &sums[i][c][k][0]);
                    }
                }
            }
        }
        for cell in masked_pole.iter_mut() {
            cell_tile::<L, S, C, N, 2, true>(token, steps, cell, &mut acc);
        }
        for cell in masked_equator.iter_mut() {
            cell_tile::<L, S, C, N, 1, true>(token, steps, cell, &mut acc);
        }
        for cell in pole.iter_mut() {
            cell_tile::<L, S, C, N, 2, false>(token, steps, cell, &mut acc);
        }
        for cell in equator.iter_mut() {
            cell_tile::<L, S, C, N, 1, false>(token, steps, cell, &mut acc);
        }
        if turn.last {
            let values = lane_sums::<L, S, C>(&acc);
            for (to, from) in coefficients.iter_mut().zip(values) {
                *to = from;
            }
        } else {
            for i in 0..S {
                for c in 0..C {
                    for k in 0..4 {
                        acc[i][c][k].store(&mut sums[i][c][k][0]);
                    }
                }
            }
        }
    }
    for cell in masked_pole.iter_mut().chain(masked_equator) {
        settle::<L, N>(token, cell);
    }
}

/// A chunk of steps, filled up with zeros if it is the last.
#[inline(always)]
pub(super) fn whole<'a>(
    steps: &'a [[f64; 4]],
    filled: &'a mut [[f64; 4]; CHECK],
) -> &'a [[f64; 4]; CHECK] {
    match steps.first_chunk() {
        Some(steps) => steps,
        None => {
            for (to, from) in filled.iter_mut().zip(steps) {
                *to = *from;
            }
            filled
        }
    }
}

/// All steps on one panel.
#[inline(always)]
fn panel<L: Lanes, const S: usize, const C: usize, const N: usize>(
    token: L::Token,
    steps: &[Step],
    cells: &mut [Cell<N>],
    polar: usize,
    turn: Turn,
    sums: &mut [[Sum; C]],
    coefficients: &mut [[Coefficient; C]],
) {
    let mut places = Places {
        polar,
        dead: cells.len(),
        partial: cells.len(),
    };
    for ((steps, sums), coefficients) in steps
        .chunks(CHECK)
        .zip(sums.chunks_mut(CHECK))
        .zip(coefficients.chunks_mut(CHECK))
    {
        // the last chunk is filled up; what it gives beyond the coefficients is not kept
        let mut filled = [[0.0; 4]; CHECK];
        let steps = whole(steps, &mut filled);
        chunk::<L, S, C, N>(token, steps, cells, &mut places, turn, sums, coefficients);
    }
}

#[inline(always)]
fn adjoint_body<L: Lanes, const S: usize, const C: usize, const N: usize>(
    token: L::Token,
    rings: &[RingBlock],
    m: usize,
    norm: f64,
    steps: &[Step],
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
    let sums = sums.as_chunks_mut::<4>().0.as_chunks_mut::<C>().0;
    let coefficients = coefficients.as_chunks_mut::<C>().0;
    // equal panels
    let panels = (count - at).div_ceil(cells.len().max(1));
    let size = (count - at).div_ceil(panels);
    let mut first = true;
    while let Some(rest) = rings.get(at..)
        && !rest.is_empty()
    {
        let size = size.min(rest.len()).min(cells.len());
        let mut polar = 0;
        for (b, (ring, cell)) in rest.iter().zip(cells.iter_mut()).take(size).enumerate() {
            let mut phase = [None; C];
            for c in 0..C {
                if let Some(place) = index.at(c * count + at + b) {
                    phase[c] = phases.get(place);
                }
            }
            begin::<L, C, N>(token, ring, m, norm, (phase, index.divided), cell);
            polar += usize::from(ring.polar);
        }
        let last = at + size == count;
        let (cells, _) = cells.split_at_mut(size);
        let turn = Turn { first, last };
        panel::<L, S, C, N>(token, steps, cells, polar, turn, sums, coefficients);
        first = false;
        at += size;
    }
}

/// The transpose of [`synthesis`](super::synthesis()): F_m on rings → coefficients.
///
/// `index` and `phases` as `index` and `out` there (blocks beyond the polar limit are not read; repeated rings at the
/// end must be zero). `coefficients` are written as laid out there; `scratch`: [`adjoint_scratch_len`] lines, of no
/// consequence.
///
/// # Errors
/// [`Error::Length`] as in [`synthesis`](super::synthesis()), and if `scratch` is too short.
pub fn adjoint(
    level: Level,
    rings: &[RingBlock],
    m: usize,
    norm: f64,
    steps: &[Step],
    channels: usize,
    index: PhaseIndex<'_>,
    phases: &[PhaseBlock],
    coefficients: &mut [Coefficient],
    scratch: &mut [Line],
) -> Result<(), Error> {
    let count = coefficients.len() / channels.max(1);
    Error::check_len("coefficients", count * channels, coefficients.len())?;
    Error::check_scratch("steps", count, steps.len())?;
    Error::check_scratch(
        "scratch",
        adjoint_scratch_len(count, channels),
        scratch.len(),
    )?;
    index.check(
        channels,
        (rings.len(), first_active(rings, m)),
        phases.len(),
    )?;
    if rings.is_empty() || channels == 0 {
        coefficients.fill([0.0; 4]);
        return Ok(());
    }
    let steps = steps.get(..count).unwrap_or(&[]);
    macro_rules! enter {
        ($s:literal, $c:literal, $n:literal) => {
            crate::dispatch!(level, |token: L| adjoint_body::<L, $s, $c, $n>(
                token,
                rings,
                m,
                norm,
                steps,
                (index, phases),
                coefficients,
                scratch
            ))
        };
    }
    match (channels, level.name() == "avx512") {
        (1, true) => enter!(4, 1, 9),
        (1, false) => enter!(1, 1, 9),
        (2, true) => enter!(3, 2, 13),
        (2, false) => enter!(1, 2, 13),
        (3, true) => enter!(2, 3, 17),
        (3, false) => enter!(1, 3, 17),
        _ => {
            return Err(Error::Domain {
                what: "channels, at most 3",
                value: channels as f64,
            });
        }
    }
    Ok(())
}
