//! Spin 2 near the poles: the spin-weighted functions themselves, degree by degree.
//!
//! w±_l = √((2l+1)/4π) d^l_{m,∓2}, combined as X1 = (w⁺ + w⁻)/2, X2 = (w⁺ − w⁻)/2 (the notation of
//! [`super::mixing`]). Each obeys, with η_l = ε_l √(l² − 4)/l,
//!
//! (x ± 2m/(l(l+1))) w±_l = η_{l+1} w±_{l+1} + η_l w±_{l−1},
//!
//! started at l₀ = max(m, 2) from powers of sin θ, sin θ/2, cos θ/2. As in [`super::recurrence`] w = α v with
//! α_{l+1} η_{l+1} = α_{l−1} η_l, so that v_{l+1} = (a_l x ± g_l) v_l − v_{l−1}; and x = 1 − (1 − x) is kept as
//! −(1 − x) with a_l ± g_l beside it, which loses nothing at the pole. The southern ring has
//! w±(π − θ) = (−1)^{l+m} w∓(θ).
//!
//! 4 FMA of recurrence and 8 of sums per degree: twice the work of two scalar sums, but without a division by sin²θ.
//! Few orders reach the rings near the poles, so little time is spent here.

use super::legendre::{Coefficient, PhaseBlock, PhaseIndex, first_active};
use super::rings::RingBlock;
use super::start::{CHECK, power, rescale};
use crate::error::Error;
use crate::scalar;
use crate::simd::{Lanes, Level, Mask, Writer};
use num_complex::Complex;

/// One step of the recurrence: a_l, a_l − g_l, a_l + g_l, α_l.
pub type WignerStep = [f64; 4];

/// Steps of order m: l = max(m, 2) … lmax.
#[must_use]
pub const fn wigner_step_count(lmax: usize, m: usize) -> usize {
    let first = if m < 2 { 2 } else { m };
    (lmax + 1).saturating_sub(first)
}

/// The steps of one order from its ε (l = m …).
pub fn wigner_step_table(m: usize, epsilon: &[f64], steps: &mut [WignerStep]) {
    let first = m.max(2);
    let eta = |n: usize| {
        let l = (first + n) as f64;
        epsilon.get(first + n - m).copied().unwrap_or(0.0) * scalar::sqrt((l - 2.0) * (l + 2.0)) / l
    };
    let (mut above, mut here) = (1.0, 1.0);
    let mut eta_above = eta(steps.len());
    for n in (0..steps.len()).rev() {
        let l = (first + n) as f64;
        let a = here / (above * eta_above);
        let ratio = 2.0 * m as f64 / (l * (l + 1.0));
        steps[n] = [a, a * (1.0 - ratio), a * (1.0 + ratio), here];
        if n > 0 {
            let eta_here = eta(n);
            let below = above * eta_above / eta_here;
            (above, here) = (here, below);
            eta_above = eta_here;
        }
    }
}

/// w⁺ and w⁻ at l₀ over sin^|m−2| θ · (sin θ/2 or cos θ/2)^(2 min(m, 2)), for m = 0, 1, …
///
/// To be divided by α of the order's first step.
pub fn wigner_norms(out: &mut [[f64; 2]]) {
    use super::double::Double;
    let mut product = Double {
        hi: 0.079_577_471_545_947_67,
        lo: -4.919_669_168_795_621_5e-18,
    };
    for (m, out) in out.iter_mut().enumerate() {
        let mf = m as f64;
        let d = Double::from;
        if m > 0 {
            product = product.mul(d(2.0 * mf - 1.0)).div(d(2.0 * mf));
        }
        *out = match m {
            // √(15/32π), √(5/4π)
            0 => {
                let n = product.mul(d(15.0)).div(d(8.0)).sqrt().value();
                [n, n]
            }
            1 => {
                let n = product.mul(d(10.0)).sqrt().value();
                [-n, n]
            }
            _ => {
                let n = product
                    .mul(d(16.0 * (2.0 * mf + 1.0)))
                    .mul(d(mf * (mf - 1.0)))
                    .div(d((mf + 1.0) * (mf + 2.0)))
                    .sqrt()
                    .value();
                let n = if m % 2 == 1 { -n } else { n };
                [n, n]
            }
        };
    }
}

/// −α(E + iB)/2, −α(E − iB)/2 for every step.
pub fn wigner_coefficients(
    m: usize,
    e: &[Complex<f64>],
    b: &[Complex<f64>],
    steps: &[WignerStep],
    out: &mut [Coefficient],
) {
    let skip = 2usize.saturating_sub(m);
    for (((out, step), e), b) in out
        .iter_mut()
        .zip(steps)
        .zip(e.iter().skip(skip))
        .zip(b.iter().skip(skip))
    {
        let h = -0.5 * step[3];
        *out = [
            h * (e.re - b.im),
            h * (e.im + b.re),
            h * (e.re + b.im),
            h * (e.im - b.re),
        ];
    }
}

/// The transpose of [`wigner_coefficients`]; *adds* to `e` and `b`.
pub fn wigner_from_sums(
    m: usize,
    sums: &[Coefficient],
    steps: &[WignerStep],
    e: &mut [Complex<f64>],
    b: &mut [Complex<f64>],
) {
    let skip = 2usize.saturating_sub(m);
    for (((sum, step), e), b) in sums
        .iter()
        .zip(steps)
        .zip(e.iter_mut().skip(skip))
        .zip(b.iter_mut().skip(skip))
    {
        let h = -0.5 * step[3];
        e.re += h * (sum[0] + sum[2]);
        e.im += h * (sum[1] + sum[3]);
        b.re += h * (sum[1] - sum[3]);
        b.im += h * (sum[2] - sum[0]);
    }
}

/// Both functions on V blocks: w⁺ and w⁻ with their predecessors and scales.
struct State<L, const V: usize> {
    y: [L; V],
    q: [[L; 2]; V],
    before: [[L; 2]; V],
    s: [[L; 2]; V],
}

impl<L: Lanes, const V: usize> State<L, V> {
    #[inline(always)]
    fn begin(token: L::Token, rings: &[RingBlock; V], m: usize, norms: [f64; 2]) -> Self {
        let zero = L::splat(token, 0.0);
        let outer = m.abs_diff(2) as f64;
        let inner = (2 * m.min(2)) as f64;
        let mut state = Self {
            y: [zero; V],
            q: [[zero; 2]; V],
            before: [[zero; 2]; V],
            s: [[zero; 2]; V],
        };
        for v in 0..V {
            let r = &rings[v];
            state.y[v] = L::load(token, &r.minus_versine);
            let outer = (outer, &r.log_sin);
            let plus = power::<L>(token, norms[0], outer, (inner, &r.log_sin_half));
            let minus = power::<L>(token, norms[1], outer, (inner, &r.log_cos_half));
            state.q[v] = [plus.q, minus.q];
            state.s[v] = [plus.s, minus.s];
        }
        state
    }

    #[inline(always)]
    fn advance(&mut self, token: L::Token, step: &WignerStep) {
        let a = L::splat(token, step[0]);
        let minus = L::splat(token, step[1]);
        let plus = L::splat(token, step[2]);
        for v in 0..V {
            let t = [self.y[v].mul_add(a, plus), self.y[v].mul_add(a, minus)];
            for i in 0..2 {
                let next = t[i].mul_sub(self.q[v][i], self.before[v][i]);
                self.before[v][i] = self.q[v][i];
                self.q[v][i] = next;
            }
        }
    }

    #[inline(always)]
    fn rescale(&mut self, token: L::Token) {
        for v in 0..V {
            for i in 0..2 {
                rescale::<L>(
                    token,
                    &mut self.q[v][i],
                    &mut self.before[v][i],
                    &mut self.s[v][i],
                );
            }
        }
    }

    #[inline(always)]
    fn live(&self, token: L::Token) -> [[L; 2]; V] {
        let zero = L::splat(token, 0.0);
        let mut live = [[zero; 2]; V];
        for v in 0..V {
            for i in 0..2 {
                live[v][i] = L::select(self.s[v][i].eq(zero), self.q[v][i], zero);
            }
        }
        live
    }

    #[inline(always)]
    fn started(&self, token: L::Token) -> (bool, bool) {
        let zero = L::splat(token, 0.0);
        let first = self.s[0][0].eq(zero);
        let (mut some, mut all) = (first, first);
        for s in &self.s {
            for s in s {
                some = some | s.eq(zero);
                all = all & s.eq(zero);
            }
        }
        (some.any(), all.all())
    }

    /// Start phase; returns the step reached.
    #[inline(always)]
    fn start(&mut self, token: L::Token, steps: &[WignerStep]) -> usize {
        let mut n = 0;
        for chunk in steps.chunks(CHECK) {
            if self.started(token).0 {
                break;
            }
            for step in chunk {
                self.advance(token, step);
            }
            self.rescale(token);
            n += chunk.len();
        }
        n
    }
}

/// Sums of one block: north w⁺ C⁺, w⁻ C⁻, south w⁻ C⁺, w⁺ C⁻, each real and imaginary.
type Parts<L, const V: usize> = [[L; 8]; V];

#[inline(always)]
fn gather<L: Lanes, const V: usize, const ODD: bool>(
    token: L::Token,
    c: &Coefficient,
    q: &[[L; 2]; V],
    sums: &mut Parts<L, V>,
) {
    for k in 0..4 {
        let x = L::splat(token, c[k]);
        for v in 0..V {
            let (north, south) = if k < 2 {
                (q[v][0], q[v][1])
            } else {
                (q[v][1], q[v][0])
            };
            sums[v][k] = north.mul_add(x, sums[v][k]);
            sums[v][k + 4] = if ODD {
                south.neg_mul_add(x, sums[v][k + 4])
            } else {
                south.mul_add(x, sums[v][k + 4])
            };
        }
    }
}

#[inline(always)]
fn synthesis_group<L: Lanes, const V: usize>(
    token: L::Token,
    rings: &[RingBlock; V],
    m: usize,
    norms: [f64; 2],
    steps: &[WignerStep],
    coefficients: &[Coefficient],
) -> Parts<L, V> {
    let mut state = State::<L, V>::begin(token, rings, m, norms);
    let mut sums = [[L::splat(token, 0.0); 8]; V];
    // CHECK is even: the parity of l − l₀ is that of the position in any chunk.
    let n = state.start(token, steps);
    let mut rest = steps.get(n..).unwrap_or(&[]);
    let mut rest_c = coefficients.get(n..).unwrap_or(&[]);
    while !rest.is_empty() && !state.started(token).1 {
        let chunk = rest.len().min(CHECK);
        for (n, (step, c)) in rest.iter().zip(rest_c).take(chunk).enumerate() {
            let live = state.live(token);
            if n % 2 == 0 {
                gather::<L, V, false>(token, c, &live, &mut sums);
            } else {
                gather::<L, V, true>(token, c, &live, &mut sums);
            }
            state.advance(token, step);
        }
        state.rescale(token);
        rest = rest.get(chunk..).unwrap_or(&[]);
        rest_c = rest_c.get(chunk..).unwrap_or(&[]);
    }
    let (pairs, _) = rest.as_chunks::<2>();
    let (pairs_c, last_c) = rest_c.as_chunks::<2>();
    for (step, c) in pairs.iter().zip(pairs_c) {
        gather::<L, V, false>(token, &c[0], &state.q, &mut sums);
        state.advance(token, &step[0]);
        gather::<L, V, true>(token, &c[1], &state.q, &mut sums);
        state.advance(token, &step[1]);
    }
    if let [c] = last_c {
        gather::<L, V, false>(token, c, &state.q, &mut sums);
    }
    sums
}

/// Sums of one block → Q = S⁺ + S⁻, U = i (S⁻ − S⁺), the southern ones with their sign.
#[inline(always)]
fn store_pair<L: Lanes>(
    sums: &[L; 8],
    sign: L,
    index: PhaseIndex<'_>,
    (q, u): (usize, usize),
    out: &mut Writer<'_, L, [PhaseBlock]>,
) -> Option<()> {
    let [pr, pi, mr, mi, south @ ..] = *sums;
    let [spr, spi, smr, smi] = south;
    let (south_re, south_im) = ((spr + smr) * sign, (spi + smi) * sign);
    out.put(index.at(q)?, [pr + mr, pi + mi, south_re, south_im])?;
    let (south_re, south_im) = ((spi - smi) * sign, (smr - spr) * sign);
    out.put(index.at(u)?, [pi - mi, mr - pr, south_re, south_im])
}

/// The transpose of [`store_pair`].
#[inline(always)]
pub(super) fn load_pair<L: Lanes>(
    token: L::Token,
    sign: L,
    q: Option<&PhaseBlock>,
    u: Option<&PhaseBlock>,
) -> [L; 8] {
    let (Some(q), Some(u)) = (q, u) else {
        return [L::splat(token, 0.0); 8];
    };
    let (qr, qi) = (L::load(token, &q[0]), L::load(token, &q[1]));
    let (ur, ui) = (L::load(token, &u[0]), L::load(token, &u[1]));
    let (sqr, sqi) = (L::load(token, &q[2]) * sign, L::load(token, &q[3]) * sign);
    let (sur, sui) = (L::load(token, &u[2]) * sign, L::load(token, &u[3]) * sign);
    [
        qr - ui,
        qi + ur,
        qr + ui,
        qi - ur,
        sqr - sui,
        sqi + sur,
        sqr + sui,
        sqi - sur,
    ]
}

/// (−1)^(l₀ + m)
pub(super) const fn first_sign(m: usize) -> f64 {
    if m == 1 { -1.0 } else { 1.0 }
}

#[inline(always)]
fn synthesis_body<L: Lanes, const V: usize>(
    token: L::Token,
    rings: &[RingBlock],
    m: usize,
    norms: [f64; 2],
    steps: &[WignerStep],
    coefficients: &[Coefficient],
    index: PhaseIndex<'_>,
    out: &mut [PhaseBlock],
) {
    let sign = L::splat(token, first_sign(m));
    let count = rings.len();
    let out = &mut Writer::new(token, out, index.stores);
    let mut at = first_active(rings, m);
    while let Some(rest) = rings.get(at..)
        && let Some(first) = rest.first()
    {
        if let Some(group) = rest.first_chunk::<V>() {
            let sums = synthesis_group::<L, V>(token, group, m, norms, steps, coefficients);
            for (v, sums) in sums.iter().enumerate() {
                store_pair::<L>(sums, sign, index, (at + v, count + at + v), out);
            }
            at += V;
        } else {
            let group = core::array::from_ref(first);
            let sums = synthesis_group::<L, 1>(token, group, m, norms, steps, coefficients);
            store_pair::<L>(&sums[0], sign, index, (at, count + at), out);
            at += 1;
        }
    }
}

/// Coefficients ([`wigner_coefficients`]) → F_m of Q and U on rings near the poles, for one order.
///
/// `norms`: of [`wigner_norms`], divided by α of the first step; `index`, `out`: (Q and U, blocks), as of
/// [`synthesis`](super::synthesis()); blocks beyond the polar limit are left as they are.
///
/// # Errors
/// [`Error::Length`] unless `steps` and `coefficients` are equally long and `out` has the places of `index`.
pub fn wigner_synthesis(
    level: Level,
    rings: &[RingBlock],
    m: usize,
    norms: [f64; 2],
    steps: &[WignerStep],
    coefficients: &[Coefficient],
    index: PhaseIndex<'_>,
    out: &mut [PhaseBlock],
) -> Result<(), Error> {
    Error::check_len("coefficients", steps.len(), coefficients.len())?;
    index.check(2, (rings.len(), first_active(rings, m)), out.len())?;
    if level.name() == "avx512" {
        crate::dispatch!(level, |token: L| synthesis_body::<L, 2>(
            token,
            rings,
            m,
            norms,
            steps,
            coefficients,
            index,
            out
        ));
    } else {
        crate::dispatch!(level, |token: L| synthesis_body::<L, 1>(
            token,
            rings,
            m,
            norms,
            steps,
            coefficients,
            index,
            out
        ));
    }
    Ok(())
}
