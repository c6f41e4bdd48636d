//! The first value of a recurrence, however small: mantissa and scale.
//!
//! sin^m θ underflows for m of a few hundred, yet the functions that start there grow back to order one. A value is
//! carried as q · 2^(800 s), s = 0, −1, −2 … per lane. Values with s = 0 are at least 2^−100 at first; those below are
//! left out of the sums. The recurrence multiplies q by less than 2^14 per step, so it is enough to look at q every
//! [`CHECK`] steps: beyond 2^700 it moves to the next scale.
//!
//! Until the next look a value that has passed the bound is still left out. It grows fastest near the poles: for lmax up
//! to 4096 it reaches 2^−45 by then, and would reach 2^−18 with a bound of 2^−64: with that, here and in the polar limit,
//! transforms were 2 to 4 % faster and 3e-9 wrong (measured).

use crate::simd::Lanes;

/// Steps between two looks at the scale: 2^700 · 2^(14 · 12) < 2^1023; a multiple of 2, 3 and 4, the steps the
/// adjoint takes at once.
pub(super) const CHECK: usize = 12;

/// log2 of the factor between two scales.
const SCALE: f64 = 800.0;
/// log2 of the least value worth summing.
const LEAST: f64 = -100.0;
/// 2^700: the next scale begins at 2^(700 − 800).
const BIG: f64 = f64::from_bits((1023 + 700) << 52);
/// 2^−800
const DOWN: f64 = f64::from_bits((1023 - 800) << 52);

/// A value q 2^(800 s).
#[derive(Clone, Copy)]
pub(super) struct Scaled<L> {
    pub(super) q: L,
    pub(super) s: L,
}

/// 2^f for |f| ≤ 0.51: Taylor series to f^13, remainder below 3e-18.
#[inline(always)]
fn exp2_fraction<L: Lanes>(token: L::Token, f: L) -> L {
    const C: [f64; 13] = [
        1.3691488853904128e-12,
        2.5678435993488206e-11,
        4.44553827187081e-10,
        7.054911620801123e-9,
        1.0178086009239699e-7,
        1.3215486790144309e-6,
        1.5252733804059841e-5,
        1.5403530393381609e-4,
        1.3333558146428443e-3,
        9.618129107628477e-3,
        5.5504108664821580e-2,
        2.4022650695910072e-1,
        core::f64::consts::LN_2,
    ];
    let mut sum = L::splat(token, C[0]);
    for &c in &C[1..] {
        sum = sum.mul_add(f, L::splat(token, c));
    }
    sum.mul_add(f, L::splat(token, 1.0))
}

/// norm · A^p · B^q from log2 A, log2 B in two parts each.
///
/// p · log2 is exact in its first part (p < 2^15), so the relative error is some 2e-16 for any p.
#[inline(always)]
pub(super) fn power<L: Lanes>(
    token: L::Token,
    norm: f64,
    (p, log_a): (f64, &[[f64; 8]; 2]),
    (q, log_b): (f64, &[[f64; 8]; 2]),
) -> Scaled<L> {
    let (p, q) = (L::splat(token, p), L::splat(token, q));
    let log = L::load(token, &log_a[0]) * p + L::load(token, &log_b[0]) * q;
    let rest = L::load(token, &log_a[1]) * p + L::load(token, &log_b[1]) * q;
    scaled::<L>(token, norm, log, rest)
}

/// norm · sin^m θ from log2 sin θ in two parts, as [`power`].
#[inline(always)]
pub(super) fn sine_power<L: Lanes>(
    token: L::Token,
    norm: f64,
    m: f64,
    log_sin: &[[f64; 8]; 2],
) -> Scaled<L> {
    let m = L::splat(token, m);
    let log = L::load(token, &log_sin[0]) * m;
    let rest = L::load(token, &log_sin[1]) * m;
    scaled::<L>(token, norm, log, rest)
}

/// norm · 2^(log + rest)
#[inline(always)]
fn scaled<L: Lanes>(token: L::Token, norm: f64, log: L, rest: L) -> Scaled<L> {
    let k = log.round();
    let fraction = exp2_fraction::<L>(token, (log - k) + rest) * L::splat(token, norm);
    // times the inverse: a division is slow, and where the scales meet either will do
    let s = ((k - L::splat(token, LEAST)) * L::splat(token, 1.0 / SCALE)).floor();
    let s = s.min(L::splat(token, 0.0));
    Scaled {
        q: fraction * (k - s * L::splat(token, SCALE)).exp2_int(),
        s,
    }
}

/// Moves lanes that have grown beyond 2^736 to the next scale, with their predecessor.
#[inline(always)]
pub(super) fn rescale<L: Lanes>(token: L::Token, q: &mut L, before: &mut L, s: &mut L) {
    let grown = q.abs().gt(L::splat(token, BIG));
    if crate::simd::Mask::any(grown) {
        let down = L::splat(token, DOWN);
        *q = L::select(grown, *q * down, *q);
        *before = L::select(grown, *before * down, *before);
        *s = L::select(grown, *s + L::splat(token, 1.0), *s);
    }
}
