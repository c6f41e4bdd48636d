//! Planck function, its derivative, the Rayleigh–Jeans factor and ratios between frequencies.
//!
//! B_ν(T) = (2hν³/c²) / (eˣ − 1) with x = hν/kT, in MJy/sr.
//!
//! # Method
//! x is carried as the sum of two f64 where multiplication can be fused, because e^−x multiplies the rounding of x by
//! x. With e^−x = (1 + p)·2^k, where p keeps its digits for small x, 1 − e^−x = −(p·2^k + (2^k − 1)) costs two more
//! operations, so one exponential serves numerator and denominator, nothing overflows however large x is, and
//! B → 0 gradually. Ratios use e^(x₀ − x), never a quotient of two vanishing numbers.
//!
//! # Accuracy
//! Relative to 50-digit arithmetic, see `tests/support/tolerance.rs`, rows `planck…`: below 1e-15 for x < 30 on the
//! fused levels; the portable level without FMA, and the scalars beyond, lose x·2^−52.
//!
//! # Cost
//! One division and one exponential per pixel, and one more division for the quotient.
//!
//! # Domain
//! 1e-30 ≤ ν ≤ 1e30 GHz, 0 < T < ∞; any other temperature, NaN among them, gives NaN.

use crate::simd::math::{exp_split, exp_sum, one_minus_exp2};
use crate::simd::{Lanes, Level};
use crate::units::{H_OVER_K_GHZ, H_OVER_K_GHZ_LOW, TWO_H_OVER_C2, TWO_K_OVER_C2};
use crate::{Error, dispatch, scalar};

/// Beyond this x every result is 0: e^−1400 < 1e-607.
const X_MAX: f64 = 1400.0;

/// Is the frequency one these kernels can take?
///
/// # Errors
/// [`Error::Domain`] unless 1e-30 ≤ `nu_ghz` ≤ 1e30.
pub fn check_frequency(nu_ghz: f64) -> Result<(), Error> {
    if (1e-30..=1e30).contains(&nu_ghz) {
        Ok(())
    } else {
        Err(Error::Domain {
            what: "frequency in GHz (1e-30 to 1e30)",
            value: nu_ghz,
        })
    }
}

/// hν/k in K as a sum of two f64.
pub(crate) fn x_kelvin(nu_ghz: f64) -> (f64, f64) {
    let hi = H_OVER_K_GHZ * nu_ghz;
    let low = scalar::fma(H_OVER_K_GHZ, nu_ghz, -hi) + H_OVER_K_GHZ_LOW * nu_ghz;
    (hi, low)
}

/// −hν/k log₂ e in K: e^−x = 2^(`decay`/T).
pub(crate) fn decay(nu_ghz: f64) -> f64 {
    -x_kelvin(nu_ghz).0 * core::f64::consts::LOG2_E
}

/// x = hν/kT as a sum of two f64; (∞, 0) where it overflows.
fn x_scalar(nu_ghz: f64, t_kelvin: f64) -> (f64, f64) {
    let (a, a_low) = x_kelvin(nu_ghz);
    let x = a / t_kelvin;
    if x < 1e6 {
        (x, (scalar::fma(-x, t_kelvin, a) + a_low) / t_kelvin)
    } else {
        (x, 0.0)
    }
}

/// Does the scalar domain hold these?
fn in_domain(nu_ghz: f64, t_kelvin: f64) -> bool {
    check_frequency(nu_ghz).is_ok() && t_kelvin > 0.0 && t_kelvin < f64::INFINITY
}

/// 1 − e^−(x + low).
fn one_minus_exp_neg_scalar(x: f64, low: f64) -> f64 {
    let e = scalar::expm1(-x);
    -(e - low * (e + 1.0))
}

/// e^−(x + low)/2: half the exponent, so that its square underflows no sooner than it must.
fn exp_neg_half_scalar(x: f64, low: f64) -> f64 {
    let e = scalar::exp(-0.5 * x);
    e - e * 0.5 * low
}

/// B_ν(T) in MJy/sr; NaN outside the domain of the module.
///
/// Accuracy: 1e-15 relative for x < 30 (tolerance table, row `planck_scalar`).
///
/// ```
/// use dust3d_kernels::planck::spectrum::planck_scalar;
/// // The CMB at its maximum, 160.2 GHz: 384 MJy/sr.
/// assert!((planck_scalar(160.2, 2.7255) - 384.0).abs() < 0.5);
/// ```
#[must_use]
pub fn planck_scalar(nu_ghz: f64, t_kelvin: f64) -> f64 {
    if !in_domain(nu_ghz, t_kelvin) {
        return f64::NAN;
    }
    let (x, low) = x_scalar(nu_ghz, t_kelvin);
    let half = exp_neg_half_scalar(x, low);
    let front = TWO_H_OVER_C2 * nu_ghz * nu_ghz * nu_ghz;
    front * half / one_minus_exp_neg_scalar(x, low) * half
}

/// [`planck_scalar`] for callers that want an error and not a NaN.
///
/// # Errors
/// [`Error::Domain`] unless 1e-30 ≤ `nu_ghz` ≤ 1e30 and 0 < `t_kelvin` < ∞.
pub fn planck_mjysr(nu_ghz: f64, t_kelvin: f64) -> Result<f64, Error> {
    check_frequency(nu_ghz)?;
    if in_domain(nu_ghz, t_kelvin) {
        Ok(planck_scalar(nu_ghz, t_kelvin))
    } else {
        Err(Error::Domain {
            what: "temperature in K (above 0, finite)",
            value: t_kelvin,
        })
    }
}

/// ∂B_ν/∂T in MJy sr⁻¹ K⁻¹; NaN outside the domain of the module.
///
/// (2kν²/c²)·x²eˣ/(eˣ − 1)²: at T_CMB the factor between MJy/sr and K_CMB. Accuracy as [`planck_scalar`].
#[must_use]
pub fn planck_derivative_scalar(nu_ghz: f64, t_kelvin: f64) -> f64 {
    if !in_domain(nu_ghz, t_kelvin) {
        return f64::NAN;
    }
    let (x, low) = x_scalar(nu_ghz, t_kelvin);
    if x > 2.0 * X_MAX {
        return 0.0;
    }
    let quotient = x / one_minus_exp_neg_scalar(x, low);
    let root = quotient * exp_neg_half_scalar(x, low);
    TWO_K_OVER_C2 * nu_ghz * nu_ghz * root * root
}

/// 2kν²/c² in MJy sr⁻¹ K⁻¹: the factor between MJy/sr and K_RJ. NaN outside the domain of the module.
#[must_use]
pub fn rayleigh_jeans_scalar(nu_ghz: f64) -> f64 {
    if check_frequency(nu_ghz).is_ok() {
        TWO_K_OVER_C2 * nu_ghz * nu_ghz
    } else {
        f64::NAN
    }
}

/// B_ν(T)/B_ν₀(T); NaN outside the domain of the module, 1 exactly for ν = ν₀.
///
/// (ν/ν₀)³ e^(x₀−x) (1 − e^−x₀)/(1 − e^−x): defined where both functions underflow. Accuracy: a few 1e-16 plus
/// |x₀ − x|·1e-16.
#[must_use]
pub fn planck_ratio_scalar(nu_ghz: f64, nu0_ghz: f64, t_kelvin: f64) -> f64 {
    if !(in_domain(nu_ghz, t_kelvin) && in_domain(nu0_ghz, t_kelvin)) {
        return f64::NAN;
    }
    let (x, low) = x_scalar(nu_ghz, t_kelvin);
    let (x0, low0) = x_scalar(nu0_ghz, t_kelvin);
    if x == x0 {
        return 1.0;
    }
    let (d, d_low) = x_difference(nu_ghz, nu0_ghz);
    let dx = d / t_kelvin;
    let correction = if dx.abs() < 1e6 {
        (scalar::fma(-dx, t_kelvin, d) + d_low) / t_kelvin
    } else {
        0.0
    };
    let e = scalar::exp(dx);
    let e = if e < f64::INFINITY {
        e + e * correction
    } else {
        e
    };
    let r = nu_ghz / nu0_ghz;
    r * r * r * e * (one_minus_exp_neg_scalar(x0, low0) / one_minus_exp_neg_scalar(x, low))
}

/// h(ν₀ − ν)/k in K as a sum of two f64.
pub(crate) fn x_difference(nu_ghz: f64, nu0_ghz: f64) -> (f64, f64) {
    let ((a, a_low), (b, b_low)) = (x_kelvin(nu_ghz), x_kelvin(nu0_ghz));
    let sum = b - a;
    let t = sum - b;
    let rounding = (b - (sum - t)) - (a + t);
    (sum, rounding + (b_low - a_low))
}

/// B_ν(T) of every pixel.
///
/// | argument | shape | unit | domain |
/// | --- | --- | --- | --- |
/// | `nu_ghz` | | GHz | 1e-30 … 1e30 |
/// | `t` | n | K | 0 < T < ∞, else NaN |
/// | `out` | n | MJy/sr | overwritten |
///
/// # Errors
/// [`Error::Domain`] for the frequency, [`Error::Length`] for unequal lengths.
///
/// # Example
/// ```
/// use dust3d_kernels::{planck::spectrum, simd::Level};
/// let mut b = [0.0; 3];
/// spectrum::planck_into(Level::detect(), 353.0, &[18.0, 19.4, f64::NAN], &mut b)?;
/// assert!((b[1] / spectrum::planck_scalar(353.0, 19.4) - 1.0).abs() < 1e-14 && b[2].is_nan());
/// # Ok::<(), dust3d_kernels::Error>(())
/// ```
pub fn planck_into(level: Level, nu_ghz: f64, t: &[f64], out: &mut [f64]) -> Result<(), Error> {
    check_frequency(nu_ghz)?;
    Error::check_len("out", t.len(), out.len())?;
    let front = TWO_H_OVER_C2 * nu_ghz * nu_ghz * nu_ghz;
    let a = x_kelvin(nu_ghz);
    dispatch!(level, |token: L| for_each::<L>(
        token,
        t,
        out,
        #[inline(always)]
        |t| {
            let (x, low) = x_lanes(token, a, t);
            let (p, k) = exp_split(token, -x, -low);
            let one = L::splat(token, 1.0);
            let quotient = L::splat(token, front) * (p + one) / denominator(token, p, k);
            quotient.scale_exp2(k)
        }
    ));
    Ok(())
}

/// ∂B_ν/∂T of every pixel, MJy sr⁻¹ K⁻¹. Arguments and errors as [`planck_into`].
///
/// # Errors
/// [`Error::Domain`] for the frequency, [`Error::Length`] for unequal lengths.
pub fn planck_derivative_into(
    level: Level,
    nu_ghz: f64,
    t: &[f64],
    out: &mut [f64],
) -> Result<(), Error> {
    check_frequency(nu_ghz)?;
    Error::check_len("out", t.len(), out.len())?;
    let front = TWO_K_OVER_C2 * nu_ghz * nu_ghz;
    let a = x_kelvin(nu_ghz);
    dispatch!(level, |token: L| for_each::<L>(
        token,
        t,
        out,
        #[inline(always)]
        |t| {
            let (x, low) = x_lanes(token, a, t);
            let (p, k) = exp_split(token, -x, -low);
            let one = L::splat(token, 1.0);
            let quotient = x / denominator(token, p, k);
            (L::splat(token, front) * (p + one) * quotient * quotient).scale_exp2(k)
        }
    ));
    Ok(())
}

/// B_ν(T)/B_ν₀(T) of every pixel; 1 exactly for ν = ν₀. Arguments as [`planck_into`].
///
/// # Errors
/// [`Error::Domain`] for the frequencies, [`Error::Length`] for unequal lengths.
pub fn planck_ratio_into(
    level: Level,
    nu_ghz: f64,
    nu0_ghz: f64,
    t: &[f64],
    out: &mut [f64],
) -> Result<(), Error> {
    check_frequency(nu_ghz)?;
    check_frequency(nu0_ghz)?;
    Error::check_len("out", t.len(), out.len())?;
    let r = nu_ghz / nu0_ghz;
    let cube = r * r * r;
    let (a, a0) = (decay(nu_ghz), decay(nu0_ghz));
    let (d, d_low) = x_difference(nu_ghz, nu0_ghz);
    dispatch!(level, |token: L| for_each::<L>(
        token,
        t,
        out,
        #[inline(always)]
        |t| {
            let c = |v: f64| L::splat(token, v);
            let inverse = c(1.0) / t;
            let dx = c(d) * inverse;
            let low = (dx.neg_mul_add(t, c(d)) + c(d_low)) * inverse;
            let low = L::select(dx.abs().lt(c(1e6)), low, c(0.0));
            let d0 = one_minus_exp2(token, c(a0), inverse);
            let dn = one_minus_exp2(token, c(a), inverse);
            c(cube) * exp_sum(token, dx, low) * (d0 / dn)
        }
    ));
    Ok(())
}

/// x = hν/kT, at most [`X_MAX`], and what it could not hold.
#[inline(always)]
fn x_lanes<L: Lanes>(token: L::Token, (a, a_low): (f64, f64), t: L) -> (L, L) {
    let limit = L::splat(token, X_MAX);
    let a = L::splat(token, a);
    let inverse = L::splat(token, 1.0) / t;
    let x = a * inverse;
    // Without fusing the remainder is noise of the size of x's own rounding.
    let low = if L::FUSED {
        (x.neg_mul_add(t, a) + L::splat(token, a_low)) * inverse
    } else {
        L::splat(token, 0.0)
    };
    (
        limit.min(x),
        L::select(x.lt(limit), low, L::splat(token, 0.0)),
    )
}

/// 1 − (1 + p)·2^k.
#[inline(always)]
fn denominator<L: Lanes>(token: L::Token, p: L, k: L) -> L {
    let scale = k.max(L::splat(token, -1022.0)).exp2_int();
    p.neg_mul_add(scale, L::splat(token, 1.0) - scale)
}

/// `out = f(t)`, NaN where t is not a temperature.
#[inline(always)]
fn for_each<L: Lanes>(token: L::Token, t: &[f64], out: &mut [f64], f: impl Fn(L) -> L) {
    let (zero, inf) = (L::splat(token, 0.0), L::splat(token, f64::INFINITY));
    let nan = L::splat(token, f64::NAN);
    for (t, out) in t.chunks(8).zip(out.chunks_mut(8)) {
        let t = L::load_padded(token, t, 1.0);
        let good = t.gt(zero) & t.lt(inf);
        L::select(good, f(t), nan).store_padded(out);
    }
}
