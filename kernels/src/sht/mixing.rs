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
    let triples = pairs.iter().zip(above).map(|(&[a, b], &[c, _])| (a, b, c));
    let mut places = out
        .chunks_exact_mut(channels.max(1))
        .filter_map(|slot| slot.get_mut(channel))
        .zip(steps)
        .zip(eps);
    for (x, ((out, step), e)) in triples.zip(places.by_ref()) {
        *out = scalar_step(step, e, x);
    }
    let rest = ends
        .into_iter()
        .chain(core::iter::repeat((zero, zero, zero)));
    for (x, ((out, step), e)) in rest.zip(places) {
        *out = scalar_step(step, e, x);
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

/// The transpose of [`scalar_coefficients`]; `alm` is overwritten.
pub fn scalar_from_sums(
    sums: &[Coefficient],
    epsilon: &[f64],
    steps: &[Step],
    channels: usize,
    channel: usize,
    alm: &mut [Complex<f64>],
) {
    let (eps, _) = epsilon.get(1..).unwrap_or(&[]).as_chunks::<2>();
    let (pairs, last) = alm.as_chunks_mut::<2>();
    let mut places = sums
        .chunks_exact(channels.max(1))
        .filter_map(|slot| slot.get(channel))
        .zip(steps)
        .zip(eps);
    // what step n gives to a_{l+2}
    let mut carried = Complex::default();
    let mut pairs = pairs.iter_mut();
    let count = (sums.len() / channels.max(1))
        .min(steps.len())
        .min(eps.len());
    for ([a, b], ((sum, step), e)) in pairs.by_ref().take(count).zip(places.by_ref()) {
        let alpha = step[3];
        let even = Complex::new(sum[0], sum[1]) * alpha;
        *a = even * e[0] + carried;
        *b = Complex::new(sum[2], sum[3]) * alpha;
        carried = even * e[1];
    }
    let rest = pairs.flatten().chain(last);
    for (n, a) in rest.enumerate() {
        *a = if n == 0 { carried } else { Complex::default() };
        if n == 0
            && let Some(((sum, step), e)) = places.next()
        {
            *a += Complex::new(sum[0], sum[1]) * step[3] * e[0];
        }
    }
}

/// W⁺, W⁰, W⁻, V⁺, V⁻ of one degree, from the ε of its neighbours l − 1 … l + 2.
#[inline(always)]
fn weights(m: f64, f: &SpinFactors, [below, here, above, above2]: [f64; 4]) -> [f64; 5] {
    [
        f.up * above * above2,
        f.n * (m * m) + f.constant + f.up * (above * above) + f.down * (here * here),
        f.down * here * below,
        -m * f.odd_up * above,
        m * f.odd_down * here,
    ]
}

/// ε_{l−1} … ε_{l+2} for l = m, m + 1, …
fn neighbours(epsilon: &[f64]) -> impl Iterator<Item = [f64; 4]> {
    let first = [0.0, epsilon.first().copied().unwrap_or(0.0)];
    let mut window = [
        0.0,
        first[0],
        first[1],
        epsilon.get(1).copied().unwrap_or(0.0),
    ];
    let rest = epsilon.iter().copied().skip(2).chain([0.0; 2]);
    rest.map(move |next| {
        window = [window[1], window[2], window[3], next];
        window
    })
}

/// i z
#[inline(always)]
const fn turned(z: Complex<f64>) -> Complex<f64> {
    Complex::new(-z.im, z.re)
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
    let factors = factors.get(m..).unwrap_or(&[]);
    let mut places = q.iter_mut().zip(u.iter_mut());
    // what l gives to l − 2 … l + 2, of (q, u), passes through registers; the first of them is complete
    let mut window = [[Complex::<f64>::default(); 2]; 5];
    let degrees = e.iter().zip(b).zip(factors).zip(neighbours(epsilon));
    for (k, (((&e, &b), f), eps)) in degrees.enumerate() {
        let [up, mid, down, odd_up, odd_down] = weights(m as f64, f, eps);
        let (ie, ib) = (turned(e), turned(b));
        let [down2, down1, here, up1, _] = window;
        let [q, u] = [down2[0] - e * down, down2[1] - b * down];
        window = [
            [down1[0] - ib * odd_down, down1[1] + ie * odd_down],
            [here[0] - e * mid, here[1] - b * mid],
            [up1[0] - ib * odd_up, up1[1] + ie * odd_up],
            [-(e * up), -(b * up)],
            [Complex::default(); 2],
        ];
        // below l = m there is nothing
        if k >= 2
            && let Some(place) = places.next()
        {
            (*place.0, *place.1) = (q, u);
        }
    }
    // fewer than two degrees have left more than nothing below l = m
    let below = 2usize.saturating_sub(e.len());
    for ((q, u), [x, y]) in places.zip(window.into_iter().skip(below)) {
        (*q, *u) = (x, y);
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
    let mut pairs = q.iter().copied().zip(u.iter().copied());
    let zero = Complex::default();
    let mut next = || pairs.next().map_or([zero; 2], |(q, u)| [q, u]);
    // (q, u) of l − 2 … l + 2
    let mut window = [[zero; 2], [zero; 2], [zero; 2], next(), next()];
    let degrees = e.iter_mut().zip(b).zip(factors).zip(neighbours(epsilon));
    for (((e, b), f), eps) in degrees {
        window = [window[1], window[2], window[3], window[4], next()];
        let [up, mid, down, odd_up, odd_down] = weights(m as f64, f, eps);
        let [down2, down1, here, up1, up2] = window;
        let even = |i: usize| here[i] * mid + up2[i] * up + down2[i] * down;
        let odd = |i: usize| up1[i] * odd_up + down1[i] * odd_down;
        let (even_q, even_u, odd_q, odd_u) = (even(0), even(1), odd(0), odd(1));
        // E takes −W q − i V u, B takes −W u + i V q
        *e += Complex::new(odd_u.im - even_q.re, -odd_u.re - even_q.im);
        *b += Complex::new(-odd_q.im - even_u.re, odd_q.re - even_u.im);
    }
}
