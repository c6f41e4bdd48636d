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
use num_complex::Complex;

/// What spin 2 needs of one degree: N, N(−l−h), N h, N (l+1)(l+2)/2, N (l−1), N (l+2).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpinFactors {
    n: f64,
    constant: f64,
    up: f64,
    down: f64,
    odd_up: f64,
    odd_down: f64,
}

/// The factors of l = 0, 1, …; zero below l = 2.
pub fn spin_factor_table(out: &mut [SpinFactors]) {
    for (l, f) in out.iter_mut().enumerate() {
        let l = l as f64;
        *f = if l < 2.0 {
            SpinFactors::default()
        } else {
            let n = 2.0 / crate::scalar::sqrt((l + 2.0) * (l + 1.0) * l * (l - 1.0));
            let h = 0.5 * l * (l - 1.0);
            SpinFactors {
                n,
                constant: -n * (l + h),
                up: n * h,
                down: n * (0.5 * (l + 1.0) * (l + 2.0)),
                odd_up: n * (l - 1.0),
                odd_down: n * (l + 2.0),
            }
        };
    }
}

/// Coefficients of one scalar channel.
///
/// `alm` holds l = m … of order m (missing degrees are zero), `out` (steps, channels), of which channel `channel` is
/// written. Steps beyond `steps` or `epsilon` are left as they are.
pub fn scalar_coefficients(
    alm: &[Complex<f64>],
    epsilon: &[f64],
    steps: &[Step],
    channels: usize,
    channel: usize,
    out: &mut [Coefficient],
) {
    let eps = epsilon.get(1..).unwrap_or(&[]).as_chunks::<2>().0;
    let slots = out.chunks_exact_mut(channels.max(1));
    let (pairs, last) = alm.as_chunks::<2>();
    // a_{l+2} of every step: the first of the pairs but the first, then the single one
    let after = if pairs.is_empty() { &[] } else { last };
    let mut next = pairs
        .iter()
        .skip(1)
        .map(|p| p[0])
        .chain(after.iter().copied());
    let mut pairs = pairs.iter().copied();
    let mut last = last.iter().copied();
    let zero = Complex::default();
    for ((slot, step), e) in slots.zip(steps).zip(eps) {
        let [here, odd] = pairs
            .next()
            .unwrap_or_else(|| [last.next().unwrap_or(zero), zero]);
        let above = next.next().unwrap_or(zero);
        let alpha = step[3];
        let (e0, e1) = (e[0] * alpha, e[1] * alpha);
        if let Some(out) = slot.get_mut(channel) {
            *out = [
                here.re * e0 + above.re * e1,
                here.im * e0 + above.im * e1,
                odd.re * alpha,
                odd.im * alpha,
            ];
        }
    }
}

/// The transpose of [`scalar_coefficients`]; `alm` is overwritten.
pub fn scalar_from_sums(
    sums: &[Coefficient],
    epsilon: &[f64],
    steps: &[Step],
    channels: usize,
    channel: usize,
    alm: &mut [Complex<f64>],
) {
    let slots = sums.iter().skip(channel).step_by(channels.max(1));
    let eps = epsilon.get(1..).unwrap_or(&[]).as_chunks::<2>().0;
    let mut carried = Complex::default();
    let mut pairs = alm.chunks_mut(2);
    for ((sum, step), e) in slots.zip(steps).zip(eps) {
        let alpha = step[3];
        let even = Complex::new(sum[0], sum[1]) * alpha;
        let Some(pair) = pairs.next() else {
            return;
        };
        if let Some(a) = pair.first_mut() {
            *a = even * e[0] + carried;
        }
        if let Some(a) = pair.get_mut(1) {
            *a = Complex::new(sum[2], sum[3]) * alpha;
        }
        carried = even * e[1];
    }
    for pair in pairs {
        for a in pair {
            *a = carried;
            carried = Complex::default();
        }
    }
}

/// W⁺, W⁰, W⁻, V⁺, V⁻ of degree l = m + k.
#[inline(always)]
fn weights(m: f64, k: usize, f: &SpinFactors, epsilon: &[f64]) -> [f64; 5] {
    let e = |k: usize| epsilon.get(k).copied().unwrap_or(0.0);
    let below = if k == 0 { 0.0 } else { e(k - 1) };
    let (here, above, above2) = (e(k), e(k + 1), e(k + 2));
    [
        f.up * above * above2,
        f.n * (m * m) + f.constant + f.up * (above * above) + f.down * (here * here),
        f.down * here * below,
        -m * f.odd_up * above,
        m * f.odd_down * here,
    ]
}

/// Coefficients of the two channels Q sin²θ, U sin²θ (`channel`, `channel + 1`) of one spin-2 pair.
///
/// `e`, `b`: l = m … lmax of order m; `factors` from l = 0; `scratch` at least 2 (lmax − m + 3) long, contents of no
/// consequence.
pub fn spin2_coefficients(
    m: usize,
    e: &[Complex<f64>],
    b: &[Complex<f64>],
    factors: &[SpinFactors],
    epsilon: &[f64],
    steps: &[Step],
    channels: usize,
    channel: usize,
    out: &mut [Coefficient],
    scratch: &mut [Complex<f64>],
) {
    let count = e.len() + 2;
    let Some((q, rest)) = scratch.split_at_mut_checked(count) else {
        return;
    };
    let Some(u) = rest.get_mut(..count) else {
        return;
    };
    q.fill(Complex::default());
    u.fill(Complex::default());
    let factors = factors.get(m..).unwrap_or(&[]);
    for (k, ((&e, &b), f)) in e.iter().zip(b).zip(factors).enumerate() {
        let [up, mid, down, odd_up, odd_down] = weights(m as f64, k, f, epsilon);
        let (ie, ib) = (Complex::new(-e.im, e.re), Complex::new(-b.im, b.re));
        q[k] -= e * mid;
        u[k] -= b * mid;
        q[k + 2] -= e * up;
        u[k + 2] -= b * up;
        q[k + 1] -= ib * odd_up;
        u[k + 1] += ie * odd_up;
        if k >= 1 {
            q[k - 1] -= ib * odd_down;
            u[k - 1] += ie * odd_down;
        }
        if k >= 2 {
            q[k - 2] -= e * down;
            u[k - 2] -= b * down;
        }
    }
    scalar_coefficients(q, epsilon, steps, channels, channel, out);
    scalar_coefficients(u, epsilon, steps, channels, channel + 1, out);
}

/// The transpose of [`spin2_coefficients`]; *adds* to `e` and `b`.
pub fn spin2_from_sums(
    m: usize,
    sums: &[Coefficient],
    factors: &[SpinFactors],
    epsilon: &[f64],
    steps: &[Step],
    channels: usize,
    channel: usize,
    e: &mut [Complex<f64>],
    b: &mut [Complex<f64>],
    scratch: &mut [Complex<f64>],
) {
    let count = e.len() + 2;
    let Some((q, rest)) = scratch.split_at_mut_checked(count) else {
        return;
    };
    let Some(u) = rest.get_mut(..count) else {
        return;
    };
    scalar_from_sums(sums, epsilon, steps, channels, channel, q);
    scalar_from_sums(sums, epsilon, steps, channels, channel + 1, u);
    let factors = factors.get(m..).unwrap_or(&[]);
    for (k, ((e, b), f)) in e.iter_mut().zip(b).zip(factors).enumerate() {
        let [up, mid, down, odd_up, odd_down] = weights(m as f64, k, f, epsilon);
        let mut even_q = q[k] * mid + q[k + 2] * up;
        let mut even_u = u[k] * mid + u[k + 2] * up;
        let mut odd_q = q[k + 1] * odd_up;
        let mut odd_u = u[k + 1] * odd_up;
        if k >= 1 {
            odd_q += q[k - 1] * odd_down;
            odd_u += u[k - 1] * odd_down;
        }
        if k >= 2 {
            even_q += q[k - 2] * down;
            even_u += u[k - 2] * down;
        }
        // E takes −W q − i V u, B takes −W u + i V q
        *e += Complex::new(odd_u.im - even_q.re, -odd_u.re - even_q.im);
        *b += Complex::new(-odd_q.im - even_u.re, odd_q.re - even_u.im);
    }
}
