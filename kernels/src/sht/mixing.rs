//! a_lm ↔ coefficients of the basis q_n.
//!
//! Spin 0: e_n = α_n (ε_{l+1} a_l + ε_{l+2} a_{l+2}), o_n = α_n a_{l+1} with l = m + 2n (see [`super::recurrence`]).
//!
//! Spin 2: with N_l = 2/√((l+2)(l+1)l(l−1)) and h = l(l−1)/2 the polarisation harmonics are
//! sin²θ X1 = N_l {−[(l − m²) + h sin²θ] λ_l + (2l+1) ε_l x λ_{l−1}} and
//! sin²θ X2 = N_l m {−(l−1) x λ_l + (2l+1) ε_l λ_{l−1}}. Multiplications by x and x² only mix neighbouring degrees:
//!
//! sin²θ X1 = W⁺ λ_{l+2} + W⁰ λ_l + W⁻ λ_{l−2},   sin²θ X2 = V⁺ λ_{l+1} + V⁻ λ_{l−1},
//! W⁺ = N h ε_{l+1} ε_{l+2},   W⁻ = N (l+1)(l+2)/2 ε_l ε_{l−1},
//! W⁰ = N [m² − l − h + h ε²_{l+1} + (l+1)(l+2)/2 ε²_l],   V⁺ = −N m (l−1) ε_{l+1},   V⁻ = N m (l+2) ε_l.
//!
//! So Q sin²θ and U sin²θ are two scalar-like sums over λ_lm up to l = lmax + 2, with coefficients
//! −(W E + i V B) and −(W B − i V E): one recurrence serves both. Dividing by sin²θ magnifies rounding errors, so rings
//! near the poles go through [`super::wigner`] instead.

use super::legendre::Coefficient;
use super::recurrence::Step;
use crate::simd::{Lanes, Level};
use num_complex::Complex;

/// Rows of [`spin_factor_table`].
const FACTORS: usize = 6;
/// Zeros before the first degree of a row, and after the last.
const BEFORE: usize = 2;
const AFTER: usize = 10;

/// Length of [`spin_factor_table`] up to `lmax`.
#[must_use]
pub const fn spin_factor_len(lmax: usize) -> usize {
    FACTORS * (BEFORE + lmax + 1 + AFTER)
}

/// What spin 2 needs of the degrees up to lmax: rows of N, N(−l−h), N h, N (l+1)(l+2)/2, N (l−1), N (l+2), zero below
/// l = 2 and between the rows. `out` of [`spin_factor_len`].
pub fn spin_factor_table(out: &mut [f64]) {
    let len = out.len() / FACTORS;
    out.fill(0.0);
    for degree in 2..len.saturating_sub(BEFORE + AFTER) {
        let l = degree as f64;
        let n = 2.0 / crate::scalar::sqrt((l + 2.0) * (l + 1.0) * l * (l - 1.0));
        let h = 0.5 * l * (l - 1.0);
        let values = [
            n,
            -n * (l + h),
            n * h,
            n * (0.5 * (l + 1.0) * (l + 2.0)),
            n * (l - 1.0),
            n * (l + 2.0),
        ];
        for (row, value) in out.chunks_exact_mut(len).zip(values) {
            row[BEFORE + degree] = value;
        }
    }
}

/// Coefficients of one scalar channel.
///
/// `alm` holds l = m … of order m (missing degrees are zero), `out` (steps, channels), of which channel `channel` is
/// written. Steps beyond `steps` or `epsilon` are left as they are.
pub fn scalar_coefficients(
    level: Level,
    alm: &[Complex<f64>],
    epsilon: &[f64],
    steps: &[Step],
    channels: usize,
    channel: usize,
    out: &mut [Coefficient],
) {
    let place = (channels, channel);
    crate::dispatch!(level, |token: L| scalar_body::<L>(
        token, alm, epsilon, steps, place, out
    ));
}

/// Plain arithmetic, which the compiler turns into vectors of the level.
#[inline(always)]
fn scalar_body<L: Lanes>(
    _token: L::Token,
    alm: &[Complex<f64>],
    epsilon: &[f64],
    steps: &[Step],
    (channels, channel): (usize, usize),
    out: &mut [Coefficient],
) {
    let (eps, _) = epsilon.get(1..).unwrap_or(&[]).as_chunks::<2>();
    let (pairs, last) = alm.as_chunks::<2>();
    let above = pairs.get(1..).unwrap_or(&[]);
    let zero = Complex::default();
    // all steps but the last two have their three coefficients
    let ends = match (pairs.last(), last.first()) {
        (Some(&[a, b]), Some(&c)) => [(a, b, c), (c, zero, zero)],
        (Some(&[a, b]), None) => [(a, b, zero), (zero, zero, zero)],
        (None, Some(&c)) => [(c, zero, zero), (zero, zero, zero)],
        (None, None) => [(zero, zero, zero); 2],
    };
    let count = above.len();
    let slots = out.chunks_exact_mut(channels.max(1));
    for ((((slot, step), e), [a, b]), [c, _]) in slots.zip(steps).zip(eps).zip(pairs).zip(above) {
        if let Some(out) = slot.get_mut(channel) {
            *out = scalar_step(step, e, (*a, *b, *c));
        }
    }
    let slots = out.chunks_exact_mut(channels.max(1)).skip(count);
    let rest = steps.iter().zip(eps).skip(count);
    for (n, (slot, (step, e))) in slots.zip(rest).enumerate() {
        let x = ends.get(n).copied().unwrap_or((zero, zero, zero));
        if let Some(out) = slot.get_mut(channel) {
            *out = scalar_step(step, e, x);
        }
    }
}

/// α (ε_{l+1} a_l + ε_{l+2} a_{l+2}), α a_{l+1}.
#[inline(always)]
fn scalar_step(
    step: &Step,
    e: &[f64; 2],
    (here, odd, above): (Complex<f64>, Complex<f64>, Complex<f64>),
) -> Coefficient {
    let alpha = step[3];
    let (e0, e1) = (e[0] * alpha, e[1] * alpha);
    [
        here.re * e0 + above.re * e1,
        here.im * e0 + above.im * e1,
        odd.re * alpha,
        odd.im * alpha,
    ]
}

/// The transpose of [`scalar_coefficients`]; *adds* to `alm` or, unless `add`, overwrites it.
pub fn scalar_from_sums(
    level: Level,
    sums: &[Coefficient],
    epsilon: &[f64],
    steps: &[Step],
    channels: usize,
    channel: usize,
    add: bool,
    alm: &mut [Complex<f64>],
) {
    let place = (channels, channel);
    if add {
        degrees_from_sums::<_, true>(level, sums, epsilon, steps, place, alm);
    } else {
        degrees_from_sums::<_, false>(level, sums, epsilon, steps, place, alm);
    }
}

/// A complex number or what is laid out as one.
trait Pair {
    fn put<const ADD: bool>(&mut self, z: Complex<f64>);
}

impl Pair for Complex<f64> {
    #[inline(always)]
    fn put<const ADD: bool>(&mut self, z: Self) {
        *self = if ADD { *self + z } else { z };
    }
}

impl Pair for [f64; 2] {
    #[inline(always)]
    fn put<const ADD: bool>(&mut self, z: Complex<f64>) {
        let [re, im] = *self;
        *self = if ADD {
            [re + z.re, im + z.im]
        } else {
            [z.re, z.im]
        };
    }
}

fn degrees_from_sums<P: Pair, const ADD: bool>(
    level: Level,
    sums: &[Coefficient],
    epsilon: &[f64],
    steps: &[Step],
    place: (usize, usize),
    out: &mut [P],
) {
    crate::dispatch!(level, |token: L| degrees_body::<L, P, ADD>(
        token, sums, epsilon, steps, place, out
    ));
}

/// Plain arithmetic, as [`scalar_body`].
#[inline(always)]
fn degrees_body<L: Lanes, P: Pair, const ADD: bool>(
    _token: L::Token,
    sums: &[Coefficient],
    epsilon: &[f64],
    steps: &[Step],
    (channels, channel): (usize, usize),
    out: &mut [P],
) {
    let (eps, _) = epsilon.get(1..).unwrap_or(&[]).as_chunks::<2>();
    let mut slots = sums.chunks_exact(channels.max(1));
    let count = slots.len().min(steps.len()).min(eps.len());
    let (pairs, last) = out.as_chunks_mut::<2>();
    let whole = count.min(pairs.len());
    let (pairs, others) = pairs.split_at_mut(whole);
    // what step n gives to a_{l+2}
    let mut carried = Complex::default();
    for (((pair, slot), step), e) in pairs.iter_mut().zip(slots.clone()).zip(steps).zip(eps) {
        let [a, b] = pair;
        let sum = slot.get(channel).copied().unwrap_or_default();
        let alpha = step[3];
        let even = Complex::new(sum[0], sum[1]) * alpha;
        a.put::<ADD>(even * e[0] + carried);
        b.put::<ADD>(Complex::new(sum[2], sum[3]) * alpha);
        carried = even * e[1];
    }
    // one degree may be left to a last step; others have none
    if let Some(slot) = slots.nth(whole)
        && let (Some(sum), Some(step), Some(e)) =
            (slot.get(channel), steps.get(whole), eps.get(whole))
    {
        carried += Complex::new(sum[0], sum[1]) * step[3] * e[0];
    }
    for a in others.as_flattened_mut().iter_mut().chain(last) {
        a.put::<ADD>(carried);
        carried = Complex::default();
    }
}

/// Degrees of a vector: real and imaginary part of each.
const WIDE: usize = 4;

/// Vectors for q and u of `degrees` = lmax − m + 1 degrees of E and B.
const fn vectors(degrees: usize) -> usize {
    (degrees + 2).div_ceil(WIDE)
}

/// Complex values of a padded set, and f64 of a padded ε, of so many vectors.
const fn padded_lens(vectors: usize) -> (usize, usize) {
    (WIDE * vectors + 2 * BEFORE, WIDE * (vectors + 1))
}

/// Lengths of the scratches of [`spin2_coefficients`] (both) and [`spin2_from_sums`] (the second), `degrees` = lmax − m + 1.
#[must_use]
pub const fn mixing_scratch_len(degrees: usize) -> (usize, usize) {
    let vectors = vectors(degrees);
    let (set, epsilon) = padded_lens(vectors);
    (2 * WIDE * vectors, 4 * set + epsilon)
}

/// E and B, or q and u, and ε with zeros around them.
struct Padded<'a> {
    vectors: usize,
    /// Those of degree m begin at [`BEFORE`].
    sets: [&'a mut [[f64; 2]]; 2],
    /// ε_{m−1} …
    epsilon: &'a [f64],
}

impl<'a> Padded<'a> {
    /// Room for sets of `count` values, which are still to be written.
    fn new(vectors: usize, count: usize, epsilon: &[f64], scratch: &'a mut [f64]) -> Option<Self> {
        let (set_len, epsilon_len) = padded_lens(vectors);
        let (first, rest) = scratch.split_at_mut_checked(2 * set_len)?;
        let (second, rest) = rest.split_at_mut_checked(2 * set_len)?;
        let (padded_epsilon, _) = rest.split_at_mut_checked(epsilon_len)?;
        let (before, rest) = padded_epsilon.split_at_mut_checked(1)?;
        let (values, after) = rest.split_at_mut(rest.len().min(epsilon.len()));
        before.fill(0.0);
        values.copy_from_slice(epsilon.get(..values.len())?);
        after.fill(0.0);
        let sets = [first.as_chunks_mut().0, second.as_chunks_mut().0];
        let mut padded = Self {
            vectors,
            sets,
            epsilon: padded_epsilon,
        };
        for set in &mut padded.sets {
            set.get_mut(..BEFORE)?.fill([0.0; 2]);
            set.get_mut(BEFORE + count..)?.fill([0.0; 2]);
        }
        Some(padded)
    }

    /// The values of a set.
    fn values(&mut self, set: usize, count: usize) -> &mut [[f64; 2]] {
        self.sets[set & 1]
            .get_mut(BEFORE..BEFORE + count)
            .unwrap_or(&mut [])
    }
}

/// Consecutive pieces of a table from `first` on.
#[inline(always)]
fn pieces<const N: usize>(table: &[f64], first: usize, count: usize) -> Option<&[[f64; N]]> {
    table.get(first..)?.as_chunks::<N>().0.get(..count)
}

/// Signs that turn an exchange of real and imaginary parts into −i z.
const TURN: [f64; 8] = [1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0];

/// q and u of l = m … from x = E and y = B, or (`BACK`) what the transpose gives to E and B, added there if `ADD`, from x = q and y = u:
///
/// ```text
/// q_l = −(W⁺_{l−2} x_{l−2} + W⁰_l x_l + W⁻_{l+2} x_{l+2}) − i (V⁺_{l−1} y_{l−1} + V⁻_{l+1} y_{l+1})
/// u_l = −(the same of y) + i (the same of x)
/// E_l = −(W⁻_l x_{l−2} + W⁰_l x_l + W⁺_l x_{l+2}) − i (V⁻_l y_{l−1} + V⁺_l y_{l+1}), …
/// ```
///
/// A vector holds four consecutive degrees, and its neighbours are four others one or two degrees further; weights are
/// loaded twice each, for real and imaginary parts.
#[inline(always)]
fn mix_body<L: Lanes, const BACK: bool, const ADD: bool>(
    token: L::Token,
    m: usize,
    factors: &[f64],
    padded: &Padded<'_>,
    [first, second]: [&mut [[Complex<f64>; WIDE]]; 2],
    [first_end, second_end]: [&mut [Complex<f64>]; 2],
) -> Option<()> {
    let n = padded.vectors;
    let row = factors.len() / FACTORS;
    // the rows, from a degree shifted by so many
    let two_below = if BACK { 3 * row + 2 } else { 2 * row };
    let two_above = if BACK { 2 * row + 2 } else { 3 * row + 4 };
    let one_below = if BACK { 5 * row + 2 } else { 4 * row + 1 };
    let one_above = if BACK { 4 * row + 2 } else { 5 * row + 3 };
    let two_below = pieces::<4>(factors, two_below + m, n)?;
    let two_above = pieces::<4>(factors, two_above + m, n)?;
    let one_below = pieces::<4>(factors, one_below + m, n)?;
    let one_above = pieces::<4>(factors, one_above + m, n)?;
    let plain = pieces::<4>(factors, BEFORE + m, n)?;
    let constant = pieces::<4>(factors, row + BEFORE + m, n)?;
    let up = pieces::<4>(factors, 2 * row + BEFORE + m, n)?;
    let down = pieces::<4>(factors, 3 * row + BEFORE + m, n)?;
    let epsilon = padded.epsilon;
    let e_below = pieces::<4>(epsilon, 0, n)?;
    let e_here = pieces::<4>(epsilon, 1, n)?;
    let e_above = pieces::<4>(epsilon, 2, n)?;
    let e_above2 = pieces::<4>(epsilon, 3, n)?;
    let mut x: [[&[[f64; 8]]; 5]; 2] = [[&[]; 5]; 2];
    for i in 0..2 {
        for k in 0..5 {
            x[i][k] = pieces::<8>(padded.sets[i].as_flattened(), 2 * k, n)?;
        }
    }
    // what does not fill a vector
    let mut ends = [[[Complex::default(); WIDE]; 2]; 2];
    let whole = first.len().min(second.len());
    let turn = L::load(token, &TURN);
    let turn = if BACK { -turn } else { turn };
    let order = m as f64;
    let (m, m2) = (L::splat(token, order), L::splat(token, order * order));
    for j in 0..n {
        let below = L::load_twice(token, &e_below[j]);
        let here = L::load_twice(token, &e_here[j]);
        let above = L::load_twice(token, &e_above[j]);
        let above2 = L::load_twice(token, &e_above2[j]);
        let sum = L::load_twice(token, &plain[j]).mul_add(m2, L::load_twice(token, &constant[j]));
        let sum = (above * above).mul_add(L::load_twice(token, &up[j]), sum);
        let w0 = (here * here).mul_add(L::load_twice(token, &down[j]), sum);
        let w_below = L::load_twice(token, &two_below[j]) * (below * here);
        let w_above = L::load_twice(token, &two_above[j]) * (above2 * above);
        // V, its sign left out: that of V⁺ is minus
        let v_below = L::load_twice(token, &one_below[j]) * (here * m);
        let v_above = L::load_twice(token, &one_above[j]) * (above * m);
        let (mut even, mut odd) = ([w0; 2], [w0; 2]);
        for i in 0..2 {
            let sum = L::load(token, &x[i][2][j]) * w0;
            let sum = L::load(token, &x[i][0][j]).mul_add(w_below, sum);
            even[i] = L::load(token, &x[i][4][j]).mul_add(w_above, sum);
            let above = L::load(token, &x[i][3][j]) * v_above;
            let difference = L::load(token, &x[i][1][j]).neg_mul_add(v_below, above);
            odd[i] = difference.swap_pairs() * turn;
        }
        let (to_first, to_second) = if j < whole {
            (&mut first[j], &mut second[j])
        } else {
            let [a, b] = &mut ends;
            (a.get_mut(j - whole)?, b.get_mut(j - whole)?)
        };
        put::<L, ADD>(odd[1] - even[0], to_first);
        put::<L, ADD>(-(odd[0] + even[1]), to_second);
    }
    for (to, from) in [first_end, second_end].into_iter().zip(&ends) {
        for (to, from) in to.iter_mut().zip(from.as_flattened()) {
            *to = if ADD { *to + *from } else { *from };
        }
    }
    Some(())
}

/// Four values to their places, or added there.
#[inline(always)]
fn put<L: Lanes, const ADD: bool>(value: L, to: &mut [Complex<f64>; WIDE]) {
    let value = value.to_array();
    for (to, &[re, im]) in to.iter_mut().zip(value.as_chunks::<2>().0) {
        let z = Complex::new(re, im);
        *to = if ADD { *to + z } else { z };
    }
}

/// The first vectors of both halves of `degrees`.
fn halves(degrees: &mut [Complex<f64>], vectors: usize) -> Option<[&mut [Complex<f64>]; 2]> {
    let (first, rest) = degrees.split_at_mut_checked(WIDE * vectors)?;
    Some([first, rest.get_mut(..WIDE * vectors)?])
}

/// Coefficients of the two channels Q sin²θ, U sin²θ (`channel`, `channel + 1`) of one spin-2 pair.
///
/// `e`, `b`: l = m … lmax of order m; `factors` of [`spin_factor_table`]; `degrees` and `scratch` of
/// [`mixing_scratch_len`], contents of no consequence. Nothing is done where these are too short.
pub fn spin2_coefficients(
    level: Level,
    m: usize,
    e: &[Complex<f64>],
    b: &[Complex<f64>],
    factors: &[f64],
    epsilon: &[f64],
    steps: &[Step],
    channels: usize,
    channel: usize,
    out: &mut [Coefficient],
    degrees: &mut [Complex<f64>],
    scratch: &mut [f64],
) {
    let n = vectors(e.len());
    let (Some([q, u]), Some(mut padded)) = (
        halves(degrees, n),
        Padded::new(n, e.len(), epsilon, scratch),
    ) else {
        return;
    };
    for (set, from) in [e, b].into_iter().enumerate() {
        for (to, z) in padded.values(set, from.len()).iter_mut().zip(from) {
            *to = [z.re, z.im];
        }
    }
    let to = [q.as_chunks_mut().0, u.as_chunks_mut().0];
    crate::dispatch!(level, |token: L| mix_body::<L, false, false>(
        token,
        m,
        factors,
        &padded,
        to,
        [&mut [], &mut []]
    ));
    for (degrees, channel) in [(q, channel), (u, channel + 1)] {
        let degrees = degrees.get(..e.len() + 2).unwrap_or(&[]);
        scalar_coefficients(level, degrees, epsilon, steps, channels, channel, out);
    }
}

/// The transpose of [`spin2_coefficients`]; *adds* to `e` and `b` or, unless `add`, overwrites them.
pub fn spin2_from_sums(
    level: Level,
    m: usize,
    sums: &[Coefficient],
    factors: &[f64],
    epsilon: &[f64],
    steps: &[Step],
    channels: usize,
    channel: usize,
    add: bool,
    e: &mut [Complex<f64>],
    b: &mut [Complex<f64>],
    scratch: &mut [f64],
) {
    let count = e.len() + 2;
    let Some(mut padded) = Padded::new(vectors(e.len()), count, epsilon, scratch) else {
        return;
    };
    for set in 0..2 {
        let (place, to) = ((channels, channel + set), padded.values(set, count));
        degrees_from_sums::<_, false>(level, sums, epsilon, steps, place, to);
    }
    let (e, e_end) = e.as_chunks_mut();
    let (b, b_end) = b.as_chunks_mut();
    let (to, ends) = ([e, b], [e_end, b_end]);
    if add {
        crate::dispatch!(level, |token: L| mix_body::<L, true, true>(
            token, m, factors, &padded, to, ends
        ));
    } else {
        crate::dispatch!(level, |token: L| mix_body::<L, true, false>(
            token, m, factors, &padded, to, ends
        ));
    }
}
