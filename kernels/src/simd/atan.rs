//! Sine, cosine, arcsine and arctangent on short intervals, where the caller has done the reduction.
//!
//! Geometry on the sphere mostly knows its angles to lie within an eighth of a turn, so the general reductions of
//! [`math`](super::math) would be wasted. The polynomials come from Remez' exchange in 60-digit arithmetic
//! (`tests/data/math/polynomials.py`); sine and cosine share those of [`math`](super::math).
//!
//! | function | interval | polynomial | its error |
//! | --- | --- | --- | --- |
//! | [`sine`], [`cosine`] | \|x\| ≤ π/4 | degree 5 in x² | 1.1e-17 |
//! | [`arcsine`] | \|x\| ≤ 1/√2 | degree 17 in x² | 1.9e-17 |
//! | [`rough_arcsine`] | \|x\| ≤ 1/√2 | degree 10 in x² | 7.3e-12 |
//! | [`arctangent`] | \|x\| ≤ tan π/8 | degree 10 in x² | 2.7e-18 |
//!
//! Everything is inlined down to the lanes without closures, which would be compiled without the level's instructions.

use super::Lanes;
use super::math::{COS, SIN};
use core::f64::consts::FRAC_2_PI;

/// (asin x − x)/x³ in x², for |x| ≤ 1/√2.
const ASIN: [f64; 18] = [
    0.166_666_666_666_651_6,
    0.075_000_000_004_272_75,
    0.044_642_856_716_790_85,
    0.030_381_966_087_534_55,
    0.022_371_499_742_437_16,
    0.017_365_970_023_401_24,
    0.013_780_653_975_571_048,
    0.013_410_164_433_514_279,
    -0.004_147_865_140_254_218,
    0.086_868_084_358_015_56,
    -0.329_285_427_118_197_5,
    1.105_586_299_453_187,
    -2.710_537_352_888_785,
    5.008_026_872_766_106,
    -6.665_999_926_814_793,
    6.110_882_245_230_915,
    -3.451_940_159_962_865,
    0.928_118_377_544_405,
];

/// The same, shorter.
const ROUGH_ASIN: [f64; 11] = [
    0.166_666_669_229_139_22,
    0.074_999_714_267_565_19,
    0.044_653_898_520_714_31,
    0.030_170_182_125_690_677,
    0.024_715_389_312_348_4,
    0.001_214_674_493_989_67,
    0.085_669_793_638_962_75,
    -0.195_277_164_769_195_13,
    0.387_099_470_356_618_2,
    -0.393_527_408_831_177_15,
    0.205_863_047_904_941_23,
];

/// (atan x − x)/x³ in x², for |x| ≤ tan π/8.
const ATAN: [f64; 11] = [
    -0.333_333_333_333_332,
    0.199_999_999_999_540_43,
    -0.142_857_142_802_442_13,
    0.111_111_107_859_094_87,
    -0.090_908_978_295_693_21,
    0.076_920_615_100_474_2,
    -0.066_631_188_930_442_8,
    0.058_479_977_666_577_65,
    -0.050_398_040_357_432_88,
    0.038_076_984_090_932_985,
    -0.017_920_785_605_502_462,
];

/// tan π/8.
const TAN_EIGHTH: f64 = 0.414_213_562_373_095_05;

/// Polynomial with the constant term first, even and odd terms apart for half the latency.
#[inline(always)]
fn polynomial<L: Lanes, const N: usize>(token: L::Token, c: &[f64; N], z: L) -> L {
    let z2 = z * z;
    let (mut even, mut odd) = (L::splat(token, 0.0), L::splat(token, 0.0));
    let mut k = N;
    while k > 0 {
        k -= 1;
        // The first of either chain multiplies a zero, which the compiler drops.
        if k.is_multiple_of(2) {
            even = if k + 2 < N {
                even.mul_add(z2, L::splat(token, c[k]))
            } else {
                L::splat(token, c[k])
            };
        } else {
            odd = if k + 2 < N {
                odd.mul_add(z2, L::splat(token, c[k]))
            } else {
                L::splat(token, c[k])
            };
        }
    }
    odd.mul_add(z, even)
}

/// sin x for |x| ≤ π/4, to one unit in the last place.
#[inline(always)]
pub(crate) fn sine<L: Lanes>(token: L::Token, x: L) -> L {
    let z = x * x;
    (polynomial(token, &SIN, z) * z).mul_add(x, x)
}

/// cos x for |x| ≤ π/4, to one unit in the last place.
#[inline(always)]
pub(crate) fn cosine<L: Lanes>(token: L::Token, x: L) -> L {
    let z = x * x;
    let one = L::splat(token, 1.0);
    let half = z * L::splat(token, 0.5);
    let top = one - half;
    let rest = (one - top) - half;
    top + polynomial(token, &COS, z).mul_add(z * z, rest)
}

/// asin x for |x| ≤ 1/√2, to one unit in the last place.
#[inline(always)]
pub(crate) fn arcsine<L: Lanes>(token: L::Token, x: L) -> L {
    let z = x * x;
    (polynomial(token, &ASIN, z) * z).mul_add(x, x)
}

/// asin x for 0 ≤ x ≤ 1/√2, to 8e-12 of itself, given x and x².
#[inline(always)]
pub(crate) fn rough_arcsine<L: Lanes>(token: L::Token, x: L, square: L) -> L {
    (x * square).mul_add(polynomial(token, &ROUGH_ASIN, square), x)
}

/// atan x for |x| ≤ tan π/8, to one unit in the last place.
#[inline(always)]
fn arctangent<L: Lanes>(token: L::Token, x: L) -> L {
    let z = x * x;
    (polynomial(token, &ATAN, z) * z).mul_add(x, x)
}

/// The angle of (x, y) from the x axis in quarter turns, 0 ≤ t ≤ 4, to about 2 units in the last place.
///
/// Multiples of an eighth of a turn are exact. (0, 0) gives 0; numbers whose quotient underflows are on the axis.
#[inline(always)]
pub(crate) fn quarter_turns<L: Lanes>(token: L::Token, x: L, y: L) -> L {
    let zero = L::splat(token, 0.0);
    let (ax, ay) = (x.abs(), y.abs());
    let steep = ax.lt(ay);
    let (long, short) = (L::select(steep, ay, ax), L::select(steep, ax, ay));
    // tan(α − π/4) = (tan α − 1)/(tan α + 1) above π/8.
    let wide = (long * L::splat(token, TAN_EIGHTH)).lt(short);
    let top = L::select(wide, short - long, short);
    let bottom = L::select(wide, short + long, long);
    // 0/0 at the origin: any positive divisor will do.
    let bottom = L::select(bottom.eq(zero), L::splat(token, 1.0), bottom);
    let angle = arctangent(token, top / bottom) * L::splat(token, FRAC_2_PI);
    // Fold back: a = 0 … ½ from the nearer axis, then out of the octant, then out of the quadrants. Sums with a whole or
    // half number of quarter turns round once each.
    let base = L::select(wide, L::splat(token, 0.5), zero);
    let west = x.lt(zero);
    let south = y.lt(zero);
    // t = c ± (base + angle): c = 0, 1, 2, 3 or 4.
    let quadrant = L::select(
        steep,
        L::select(south, L::splat(token, 3.0), L::splat(token, 1.0)),
        L::select(
            west,
            L::splat(token, 2.0),
            L::select(south, L::splat(token, 4.0), zero),
        ),
    );
    let minus = differ::<L>(differ::<L>(steep, west), south);
    let turn = base + angle;
    L::select(minus, quadrant - turn, quadrant + turn)
}

/// Exactly one of two masks.
#[inline(always)]
fn differ<L: Lanes>(a: L::Mask, b: L::Mask) -> L::Mask {
    (a | b) & !(a & b)
}
