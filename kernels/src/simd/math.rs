//! Elementary functions of eight lanes: exp, expm1, ln, sin and cos, pow.
//!
//! Written once over [`Lanes`], without tables or branches on the lanes, so AVX2 and AVX-512 give the same bits; the
//! portable level differs in the last place where the target has no fused multiply-add. Each function reduces its
//! argument to a short interval by Cody & Waite's split constants, whose products with the (small) integer are exact
//! with or without fusing, and evaluates there a minimax polynomial.
//!
//! | function | reduced to | polynomial | its error | whole error, ulp |
//! | --- | --- | --- | --- | --- |
//! | [`exp`], [`expm1`] | \|r\| ≤ ln 2 / 2 | (eʳ − 1 − r)/r², degree 9 | 3.4e-17 of eʳ − 1 | see below |
//! | [`ln`] | 1/√2 … √2, s = (m − 1)/(m + 1) | degree 6 in s² | 1.8e-18 | |
//! | [`pow`] | the same | degree 7 in s², the first terms in two f64 | 8.4e-21 | |
//! | [`sin_cos`] | \|r\| ≤ π/4 | sine and cosine, degree 5 in r² | 1.1e-17 | |
//!
//! The polynomials come from Remez' exchange in 60-digit arithmetic (`tests/data/math/polynomials.py`), the errors stated
//! are those of the rounded coefficients. Whole errors are measured against 200-bit arithmetic
//! (`tests/data/math/vectors.py`) and held by the tolerance table, rows `exp` … `pow`.

use super::{Lanes, Mask};
use crate::scalar;

const LOG2_E: f64 = core::f64::consts::LOG2_E;
/// ln 2 to 32 bits: its product with an integer below 2^21 is exact.
const LN2_HI: f64 = 0.693_147_180_369_123_8;
/// The rest of ln 2.
const LN2_LO: f64 = 1.908_214_929_270_587_7e-10;

/// (eʳ − 1 − r)/r² for |r| ≤ ln 2 / 2.
const EXP: [f64; 10] = [
    0.500_000_000_000_000_6,
    0.166_666_666_666_665_88,
    0.041_666_666_666_576_625,
    0.008_333_333_333_389_573,
    0.001_388_888_893_160_411,
    0.000_198_412_697_190_162_48,
    2.480_150_523_027_103e-5,
    2.755_740_748_818_543_6e-6,
    2.762_605_397_859_040_7e-7,
    2.505_380_524_126_441_6e-8,
];

/// (2ʳ − 1 − r ln 2)/r² for |r| ≤ ½.
const EXP2: [f64; 10] = [
    0.240_226_506_959_100_97,
    0.055_504_108_664_821_32,
    0.009_618_129_107_607_691,
    0.001_333_355_814_651_843,
    0.000_154_035_304_407_551_04,
    1.525_273_371_007_888_4e-5,
    1.321_544_305_857_250_1e-6,
    1.017_811_860_894_967_9e-7,
    7.072_508_311_359_843e-9,
    4.445_839_381_756_877_5e-10,
];

/// (ln((1 + s)/(1 − s)) − 2s)/s³ in s².
const LN: [f64; 7] = [
    0.666_666_666_666_673_4,
    0.399_999_999_994_143_54,
    0.285_714_287_424_672_64,
    0.222_221_985_643_250_6,
    0.181_835_648_203_832_4,
    0.153_140_370_838_082_16,
    0.147_960_923_334_320_95,
];

/// (ln((1 + s)/(1 − s)) − 2s − ⅔s³)/s⁵ in s².
const LN_LONG: [f64; 8] = [
    0.399_999_999_999_999_86,
    0.285_714_285_714_419_76,
    0.222_222_222_181_652_6,
    0.181_818_188_047_298_1,
    0.153_845_607_616_933_8,
    0.133_361_849_941_462_02,
    0.116_772_291_319_315_4,
    0.119_708_116_832_198_8,
];

/// (sin r − r)/r³ in r².
pub(super) const SIN: [f64; 6] = [
    -0.166_666_666_666_666_3,
    0.008_333_333_333_322_113,
    -0.000_198_412_698_295_851_88,
    2.755_731_361_984_914_5e-6,
    -2.505_074_751_686_618_7e-8,
    1.589_621_554_393_220_8e-10,
];

/// (cos r − 1 + r²/2)/r⁴ in r².
pub(super) const COS: [f64; 6] = [
    0.041_666_666_666_666_595,
    -0.001_388_888_888_887_305,
    2.480_158_728_884_698e-5,
    -2.755_731_417_788_583_7e-7,
    2.087_570_064_469_953_3e-9,
    -1.135_852_604_885_992_4e-11,
];

/// π/2 in 33 + 33 + 33 bits and the rest: products with integers below 2^20 are exact.
const HALF_PI: [f64; 4] = [
    1.570_796_326_734_125_6,
    6.077_100_506_303_966e-11,
    2.022_266_248_711_166_5e-21,
    8.478_427_660_368_9e-32,
];

/// Beyond this [`sin_cos`] goes lane by lane through [`crate::scalar`].
const SIN_COS_LIMIT: f64 = 1.6e6;

/// Polynomial with the constant term first, even and odd terms apart: half the latency at no more operations than
/// Horner's rule, `z2` being z².
#[inline(always)]
fn polynomial<L: Lanes, const N: usize>(token: L::Token, c: &[f64; N], z: L, z2: L) -> L {
    let chain = |from: usize| {
        let mut k = from + (N - 1 - from) / 2 * 2;
        let mut sum = L::splat(token, c[k]);
        while k > from {
            k -= 2;
            sum = sum.mul_add(z2, L::splat(token, c[k]));
        }
        sum
    };
    chain(1).mul_add(z, chain(0))
}

/// Adding this to |x| < 2^51 rounds x to an integer: one unit of its last place is 1.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// x within lo … hi; NaN stays.
#[inline(always)]
fn clamp<L: Lanes>(token: L::Token, x: L, lo: f64, hi: f64) -> L {
    // `min` and `max` return their argument where either is NaN.
    L::splat(token, lo).max(L::splat(token, hi).min(x))
}

/// e^(x + low) = (1 + p)·2^k as (p, k): |p| < 0.4143, k an integer.
///
/// For |x| ≤ 2000 and |low| ≤ 1e-3 |ln 2|, where `low` is what x itself could not hold. p keeps its relative accuracy
/// when x → 0.
#[inline(always)]
pub(crate) fn exp_split<L: Lanes>(token: L::Token, x: L, low: L) -> (L, L) {
    let (r, k) = reduce(token, x);
    (expm1_reduced(token, r + low), k)
}

/// x = k ln 2 + r as (r, k).
#[inline(always)]
fn reduce<L: Lanes>(token: L::Token, x: L) -> (L, L) {
    let magic = L::splat(token, ROUND);
    let k = x.mul_add(L::splat(token, LOG2_E), magic) - magic;
    let r = k.neg_mul_add(L::splat(token, LN2_HI), x);
    (k.neg_mul_add(L::splat(token, LN2_LO), r), k)
}

/// eʳ − 1 for |r| ≤ ln 2 / 2.
#[inline(always)]
fn expm1_reduced<L: Lanes>(token: L::Token, r: L) -> L {
    let r2 = r * r;
    polynomial(token, &EXP, r, r2).mul_add(r2, r)
}

/// eˣ.
///
/// Overflows to infinity above 709.78, underflows gradually below −708.4 and to zero below −745.13; e^−∞ = 0; NaN stays.
#[inline(always)]
#[must_use]
pub fn exp<L: Lanes>(token: L::Token, x: L) -> L {
    let (r, k) = reduce(token, clamp(token, x, -746.0, 710.0));
    (expm1_reduced(token, r) + L::splat(token, 1.0)).scale_exp2(k)
}

/// e^(x + low), with the range of [`exp`]; `low` is what x itself could not hold, and must be finite.
#[inline(always)]
pub(crate) fn exp_sum<L: Lanes>(token: L::Token, x: L, low: L) -> L {
    let (r, k) = reduce(token, clamp(token, x, -746.0, 710.0));
    (expm1_reduced(token, r + low) + L::splat(token, 1.0)).scale_exp2(k)
}

/// (2ʳ − 1)/r for |r| ≤ ½.
#[inline(always)]
fn exp2m1_over_r<L: Lanes>(token: L::Token, r: L) -> L {
    let linear = L::splat(token, core::f64::consts::LN_2);
    polynomial(token, &EXP2, r, r * r).mul_add(r, linear)
}

/// 2ʸ: cheaper than [`exp`] where the factor log₂ e can be put into a constant. NaN for y = ±∞.
#[inline(always)]
pub(crate) fn exp2<L: Lanes>(token: L::Token, y: L) -> L {
    let magic = L::splat(token, ROUND);
    let k = (y + magic) - magic;
    // Exact, so that no range of y needs care.
    let r = y - k;
    exp2m1_over_r(token, r)
        .mul_add(r, L::splat(token, 1.0))
        .scale_exp2(k)
}

/// 1 − 2^(a·b) for a·b ≤ 0, accurate for small a·b; the product is not rounded where it can be fused. NaN where it
/// overflows.
#[inline(always)]
pub(crate) fn one_minus_exp2<L: Lanes>(token: L::Token, a: L, b: L) -> L {
    let (one, magic) = (L::splat(token, 1.0), L::splat(token, ROUND));
    let k = a.mul_add(b, magic) - magic;
    let r = a.mul_sub(b, k);
    let scale = k.exp2_int();
    // (1 − 2^k) − 2^k (2ʳ − 1); for k = 0 the first is 0 and the second keeps its digits.
    exp2m1_over_r(token, r).neg_mul_add(r * scale, one - scale)
}

/// eˣ − 1, accurate for small x.
///
/// Overflows to infinity above 709.78; −1 towards −∞; NaN stays.
#[inline(always)]
#[must_use]
pub fn expm1<L: Lanes>(token: L::Token, x: L) -> L {
    let one = L::splat(token, 1.0);
    let (r, k) = reduce(token, clamp(token, x, -64.0, 710.0));
    // (p + 1)·2^k − 1 = (p + (1 − 2^−k))·2^k: for k = 0 exactly p, and 2^−k never overflows. Beyond k = 1022 the term
    // is far below the rounding of 1.
    let inverse = (-k).max(L::splat(token, -1022.0)).exp2_int();
    (expm1_reduced(token, r) + (one - inverse)).scale_exp2(k)
}

/// x = m·2^e with 1/√2 ≤ m < √2, for positive x (subnormal too), as (m − 1, e).
#[inline(always)]
fn split_near_one<L: Lanes>(token: L::Token, x: L) -> (L, L) {
    let one = L::splat(token, 1.0);
    let tiny = x.lt(L::splat(token, f64::MIN_POSITIVE));
    let x = L::select(tiny, x * L::splat(token, 18_014_398_509_481_984.0), x);
    let (m, e) = x.split_exponent();
    let e = L::select(tiny, e - L::splat(token, 54.0), e);
    let big = m.gt(L::splat(token, core::f64::consts::SQRT_2));
    let m = L::select(big, m * L::splat(token, 0.5), m);
    (m - one, L::select(big, e + one, e))
}

/// ln x where it is finite, and the special values: ln 0 = −∞, ln ∞ = ∞, NaN for negative x and NaN.
#[inline(always)]
fn ln_special<L: Lanes>(token: L::Token, x: L, finite: L) -> L {
    let inf = L::splat(token, f64::INFINITY);
    let zero = L::splat(token, 0.0);
    let y = L::select(x.eq(inf), inf, finite);
    let y = L::select(x.eq(zero), -inf, y);
    L::select(x.ge(zero), y, L::splat(token, f64::NAN))
}

/// ln x.
///
/// ln ±0 = −∞, ln ∞ = ∞, NaN for negative x; subnormal x are exact inputs like any other.
#[inline(always)]
#[must_use]
pub fn ln<L: Lanes>(token: L::Token, x: L) -> L {
    let (f, e) = split_near_one(token, x);
    // ln(1 + f) = 2s + s³P(s²) with s = f/(2 + f), written so that the large terms f − f²/2 lose nothing.
    let s = f / (f + L::splat(token, 2.0));
    let z = s * s;
    let tail = polynomial(token, &LN, z, z * z) * z;
    let half_square = f * f * L::splat(token, 0.5);
    let low = s.mul_add(half_square + tail, e * L::splat(token, LN2_LO));
    let y = e.mul_add(L::splat(token, LN2_HI), f - (half_square - low));
    ln_special(token, x, y)
}

/// a + b as (rounded sum, rounding error).
#[inline(always)]
fn two_sum<L: Lanes>(a: L, b: L) -> (L, L) {
    let sum = a + b;
    let t = sum - a;
    (sum, (a - (sum - t)) + (b - t))
}

/// a·b as (rounded product, rounding error).
#[inline(always)]
fn two_product<L: Lanes>(token: L::Token, a: L, b: L) -> (L, L) {
    let product = a * b;
    if L::FUSED {
        return (product, a.mul_sub(b, product));
    }
    // Dekker: halves of 26 bits, whose products are exact.
    let split = |x: L| {
        let t = x * L::splat(token, 134_217_729.0);
        let hi = t - (t - x);
        (hi, x - hi)
    };
    let ((ah, al), (bh, bl)) = (split(a), split(b));
    (product, ((ah * bh - product) + ah * bl + al * bh) + al * bl)
}

/// ln x for positive finite x as an unevaluated sum, accurate to about 2^−64.
#[inline(always)]
fn ln_long<L: Lanes>(token: L::Token, x: L) -> (L, L) {
    let c = |v: f64| L::splat(token, v);
    let (f, e) = split_near_one(token, x);
    // s = f/(2 + f) in two parts.
    let (d, d_low) = two_sum(f, c(2.0));
    let s = f / d;
    let (p, p_low) = two_product(token, s, d);
    let s_low = (((f - p) - p_low) - s * d_low) / d;
    let (z, z_low) = two_product(token, s, s);
    let z_low = z_low + (s + s) * s_low;
    // ⅔ + z·(…) in two parts.
    let rest = polynomial(token, &LN_LONG, z, z * z) * z;
    let (q, q_low) = two_sum(c(2.0 / 3.0), rest);
    let q_low = q_low + c(3.700_743_415_417_188e-17);
    // s³·q.
    let (u, u_low) = two_product(token, s, z);
    let u_low = u_low + s * z_low + s_low * z;
    let (v, v_low) = two_product(token, u, q);
    let v_low = v_low + u * q_low + u_low * q;
    // e ln 2 + 2s + s³q.
    let (a, a_low) = two_sum(e * c(LN2_HI), s + s);
    let (b, b_low) = two_sum(a, v);
    let low = (a_low + b_low) + ((s_low + s_low) + v_low + e * c(LN2_LO));
    let hi = b + low;
    (hi, low - (hi - b))
}

/// xʸ.
///
/// For x < 0 real where y is an integer, else NaN; x⁰ = 1 and 1ʸ = 1 even for NaN, as IEEE 754 has it; the sign of a
/// zero x is ignored (0^−1 = ∞).
#[inline(always)]
#[must_use]
pub fn pow<L: Lanes>(token: L::Token, x: L, y: L) -> L {
    let c = |v: f64| L::splat(token, v);
    let (zero, one, inf) = (c(0.0), c(1.0), c(f64::INFINITY));
    let magnitude = x.abs();
    let regular = magnitude.gt(zero) & magnitude.lt(inf);
    let (l, l_low) = ln_long(token, L::select(regular, magnitude, one));
    let l = L::select(regular, l, ln_special(token, magnitude, zero));
    let (p, p_low) = two_product(token, y, l);
    let p_low = l_low.mul_add(y, p_low);
    // Beyond ±2000 the result is 0 or ∞ whatever the low part, which may be NaN there.
    let low = L::select(p.abs().lt(c(2000.0)), p_low, zero);
    let power = exp_sum(token, p, low);
    // Negative bases: the sign of odd integers (all above 2^53 are even), NaN for what is not an integer.
    let half = y * c(0.5);
    let integer = y.floor().eq(y);
    let odd = integer & !half.floor().eq(half);
    let negative = x.lt(zero);
    let power = L::select(negative & odd, -power, power);
    let power = L::select(negative & !integer, c(f64::NAN), power);
    L::select(y.eq(zero) | x.eq(one), one, power)
}

/// (sin x, cos x).
///
/// Full accuracy for every finite x: beyond 1.6e6 the eight lanes go one by one through [`crate::scalar`]. NaN for ±∞ and
/// NaN; sin ±0 = 0.
#[inline(always)]
#[must_use]
pub fn sin_cos<L: Lanes>(token: L::Token, x: L) -> (L, L) {
    if x.abs().gt(L::splat(token, SIN_COS_LIMIT)).any() {
        return sin_cos_far(token, x);
    }
    let c = |v: f64| L::splat(token, v);
    let k = (x * c(core::f64::consts::FRAC_2_PI)).round();
    // x − k π/2 in two parts (r, low): the first two products are exact, and so is the first difference.
    let a = k.neg_mul_add(c(HALF_PI[0]), x);
    let (b, b_low) = two_sum(a, -(k * c(HALF_PI[1])));
    let w = k.mul_add(c(HALF_PI[2]), k * c(HALF_PI[3])) - b_low;
    let r = b - w;
    let low = (b - r) - w;
    let z = r * r;
    let z2 = z * z;
    // sin(r + low) ≈ sin r + low, cos(r + low) ≈ cos r − r low: low is below 2^−53 r.
    let sine = (polynomial(token, &SIN, z, z2) * z).mul_add(r, low) + r;
    let half = z * c(0.5);
    let one = c(1.0);
    let top = one - half;
    let rest = ((one - top) - half) - r * low;
    let cosine = top + polynomial(token, &COS, z, z2).mul_add(z2, rest);
    // Quadrant.
    let quarter = (k * c(0.25)).floor();
    let j = quarter.neg_mul_add(c(4.0), k);
    let (one_or_two, two_or_three) = (j.eq(one) | j.eq(c(2.0)), j.ge(c(2.0)));
    let swap = j.eq(one) | j.eq(c(3.0));
    let (s, t) = (L::select(swap, cosine, sine), L::select(swap, sine, cosine));
    (L::select(two_or_three, -s, s), L::select(one_or_two, -t, t))
}

#[cold]
#[inline(never)]
fn sin_cos_scalar(x: &[f64; 8]) -> ([f64; 8], [f64; 8]) {
    let both = x.map(scalar::sin_cos);
    (both.map(|p| p.0), both.map(|p| p.1))
}

#[inline(always)]
fn sin_cos_far<L: Lanes>(token: L::Token, x: L) -> (L, L) {
    let (s, c) = sin_cos_scalar(&x.to_array());
    (L::load(token, &s), L::load(token, &c))
}
