//! Sharing of a pixel's polarisation residual among its layers (\[MKD18\], section 4.2, Eq. of F_i).
//!
//! v_i = ṽ_i + F_i R with ṽ_i = (Q̃, Ũ)^i the prediction, R = V − Σ_j ṽ_j, V the observation, and
//! F_i = P̃_i/Σ_j P̃_j, P̃_i = |ṽ_i|. Where all P̃ vanish F_i is proportional to I_i; where all I_i vanish too,
//! F_i = 1/N. Layers without intensity get no share unless all are empty.

use crate::scalar::{abs, hypot, sqrt};

/// √(x² + y²), by [`hypot`] where the squares would lose digits.
#[inline]
pub(super) fn norm(x: f64, y: f64) -> f64 {
    let square = x * x + y * y;
    if square > 1e-270 && square < 1e270 {
        sqrt(square)
    } else {
        hypot(x, y)
    }
}

/// 2^−e for the binary exponent e of a positive number, kept within 2^±1000; 1 for zero.
pub(super) fn unit_scale(largest: f64) -> f64 {
    if !(largest > 0.0) {
        return 1.0;
    }
    let exponent = (largest.to_bits() >> 52) as i64 - 1023;
    power_of_two(-exponent)
}

/// 2^n, n kept within ±1000.
pub(super) fn power_of_two(n: i64) -> f64 {
    f64::from_bits(((n.clamp(-1000, 1000) + 1023) as u64) << 52)
}

/// Fractions x_i/Σx_j of numbers not below zero, written to `out`; false if all are zero.
///
/// Numbers that are not above zero count as zero. The sum is formed relative to the largest: it neither overflows nor
/// vanishes.
pub(super) fn fractions(x: impl Iterator<Item = f64> + Clone, out: &mut [f64]) -> bool {
    let largest = x.clone().fold(0.0, f64::max);
    if !(largest > 0.0) {
        return false;
    }
    // A power of two: the quotients are those of the numbers themselves.
    let scale = unit_scale(largest);
    let mut sum = 0.0;
    for (o, x) in out.iter_mut().zip(x) {
        *o = x.max(0.0) * scale;
        sum += *o;
    }
    for o in out {
        *o /= sum;
    }
    true
}

/// Shares the residual of one pixel with N layers.
///
/// | argument | shape | what |
/// | --- | --- | --- |
/// | `intensity` | N | I_i ≥ 0 |
/// | `q`, `u` | N | in: the prediction (Q̃, Ũ)^i; out: the shared split v_i |
/// | `observed` | 2 | V = (Q, U) |
/// | `share` | N | written: F_i ≥ 0, Σ F_i = 1 |
///
/// Slices of different lengths are used up to the shortest. Numbers that are not finite spread.
///
/// # Accuracy
/// Σ v_i = V to 1e-13 Σ|v_i|: where the prediction is so much larger than the observation that rounding loses more, the
/// remainder is shared again.
///
/// ```
/// let (mut q, mut u, mut share) = ([3.0, 1.0], [0.0, 0.0], [0.0; 2]);
/// dust3d_kernels::split::residual::share(&[1.0, 1.0], &mut q, &mut u, [8.0, 4.0], &mut share);
/// assert_eq!((q, u, share), ([6.0, 2.0], [3.0, 1.0], [0.75, 0.25]));
/// ```
pub fn share(
    intensity: &[f64],
    q: &mut [f64],
    u: &mut [f64],
    observed: [f64; 2],
    share: &mut [f64],
) {
    let predicted = q.iter().zip(&*u).zip(intensity);
    let strength = predicted.map(|((&q, &u), &i)| if i > 0.0 { norm(q, u) } else { 0.0 });
    if !fractions(strength, share) && !fractions(intensity.iter().copied(), share) {
        let n = share.len() as f64;
        share.fill(1.0 / n);
    }
    let sum = |x: &[f64]| x.iter().fold(0.0, |sum, x| sum + x);
    let mut residual = [observed[0] - sum(q), observed[1] - sum(u)];
    // Once, unless predictions dwarf the observation so far that rounding left a part of it out.
    for _ in 0..60 {
        for ((q, u), f) in q.iter_mut().zip(&mut *u).zip(&*share) {
            *q += *f * residual[0];
            *u += *f * residual[1];
        }
        residual = [observed[0] - sum(q), observed[1] - sum(u)];
        let lengths = q
            .iter()
            .zip(&*u)
            .fold(0.0, |sum, (&q, &u)| sum + (abs(q) + abs(u)));
        if !(abs(residual[0]) + abs(residual[1]) > 1e-13 * lengths) {
            break;
        }
    }
}
