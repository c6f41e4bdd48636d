//! Normal deviates by inversion: exactly one 64-bit word each, no rejection.
//!
//! The word, read as a signed integer w, is the probability q = (w + ½) 2^−64 away from one half, and the deviate is
//! Φ^−1(½ + q). Both tails are reached with full relative accuracy: the smallest tail probability is 2^−65, the
//! largest deviate 9.15 standard deviations.
//!
//! Φ^−1 is algorithm AS 241 (PPND16) of Wichura, Appl. Statist. 37, 477 (1988): a quotient of polynomials of degree
//! seven for |q| ≤ 0.425, and two more in √(−ln p) towards the tails. Its coefficients stand below, and only `ln` and
//! `sqrt` of [`crate::scalar`] are used, so the values are the same on every machine and never change with a
//! dependency's sampler.
//!
//! **Order of draws.** [`white_alm_into`] draws multipole after multipole: all m of l, then l + 1, two normals for every
//! (l, m), also where m = 0 keeps only one. Coefficients up to a given l are then the same whatever lmax is.

use super::stream::Stream;
use crate::scalar::{ln, sqrt};
use crate::{Complex, Error};

/// Σ c_i x^i.
#[inline(always)]
fn polynomial(coefficients: &[f64; 8], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, &c| sum * x + c)
}

/// |q| ≤ 0.425, in 0.425² − q².
const CENTRE: [[f64; 8]; 2] = [
    [
        3.387_132_872_796_366_608,
        133.141_667_891_784_377_45,
        1_971.590_950_306_551_442_7,
        13_731.693_765_509_461_125,
        45_921.953_931_549_871_457,
        67_265.770_927_008_700_853,
        33_430.575_583_588_128_105,
        2_509.080_928_730_122_672_7,
    ],
    [
        1.0,
        42.313_330_701_600_911_252,
        687.187_007_492_057_908_3,
        5_394.196_021_424_751_107_7,
        21_213.794_301_586_595_867,
        39_307.895_800_092_710_61,
        28_729.085_735_721_942_674,
        5_226.495_278_852_545_610_4,
    ],
];

/// √(−ln p) ≤ 5, in √(−ln p) − 1.6.
const TAIL: [[f64; 8]; 2] = [
    [
        1.423_437_110_749_683_577_34,
        4.630_337_846_156_545_295_9,
        5.769_497_221_460_691_405_5,
        3.647_848_324_763_204_604_4,
        1.270_458_252_452_368_382_58,
        0.241_780_725_177_450_611_77,
        0.022_723_844_989_269_184_5,
        7.745_450_142_783_414_076_4e-4,
    ],
    [
        1.0,
        2.053_191_626_637_758_821_87,
        1.676_384_830_183_803_849_4,
        0.689_767_334_985_100_004_55,
        0.148_103_976_427_480_074_59,
        0.015_198_666_563_616_457_19,
        5.475_938_084_995_344_946e-4,
        1.050_750_071_644_416_843_24e-9,
    ],
];

/// √(−ln p) > 5, in √(−ln p) − 5.
const FAR_TAIL: [[f64; 8]; 2] = [
    [
        6.657_904_643_501_103_777_2,
        5.463_784_911_164_114_369_9,
        1.784_826_539_917_291_335_8,
        0.296_560_571_828_504_891_23,
        0.026_532_189_526_576_123_093,
        0.001_242_660_947_388_078_438_6,
        2.711_555_568_743_487_578_15e-5,
        2.010_334_399_292_288_132_65e-7,
    ],
    [
        1.0,
        0.599_832_206_555_887_937_69,
        0.136_929_880_922_735_805_31,
        0.014_875_361_290_850_615_025,
        7.868_691_311_456_132_591e-4,
        1.846_318_317_510_054_681_8e-5,
        1.421_511_758_316_445_888_7e-7,
        2.044_263_103_389_939_785_64e-15,
    ],
];

/// The normal deviate of a random word: Φ^−1(½ + q), q = (w + ½) 2^−64 with w the word as a signed integer.
///
/// Odd in the sense `from_word(!w) == -from_word(w)`, increasing in w.
///
/// # Accuracy
/// See `tests/support/tolerance.rs`, row `normal`.
///
/// ```
/// use dust3d_kernels::random::normal::from_word;
/// assert!(from_word(0) > 0.0 && from_word(u64::MAX) == -from_word(0));
/// ```
#[inline]
#[must_use]
pub fn from_word(word: u64) -> f64 {
    const SCALE: f64 = 1.0 / 18_446_744_073_709_551_616.0;
    let negative = (word >> 63) != 0;
    // 0 … 2^63 − 1, mirrored: |q| = (steps + ½) 2^−64.
    let steps = if negative { !word } else { word };
    let q = (steps as f64 + 0.5) * SCALE;
    let z = if q <= 0.425 {
        let r = 0.180_625 - q * q;
        q * (polynomial(&CENTRE[0], r) / polynomial(&CENTRE[1], r))
    } else {
        // The tail probability ½ − |q|, from integers: no cancellation.
        let p = (((1_u64 << 63) - 1 - steps) as f64 + 0.5) * SCALE;
        let r = sqrt(-ln(p));
        if r <= 5.0 {
            let r = r - 1.6;
            polynomial(&TAIL[0], r) / polynomial(&TAIL[1], r)
        } else {
            let r = r - 5.0;
            polynomial(&FAR_TAIL[0], r) / polynomial(&FAR_TAIL[1], r)
        }
    };
    if negative { -z } else { z }
}

impl Stream {
    /// The next normal deviate, mean 0 and variance 1; one word.
    #[inline]
    pub fn normal(&mut self) -> f64 {
        from_word(self.word())
    }

    /// Fills a slice with normal deviates, in order; one word each.
    pub fn fill_normals(&mut self, out: &mut [f64]) {
        for value in out {
            *value = self.normal();
        }
    }
}

/// The number of normals drawn before those of (l, m): 2 (l(l+1)/2 + m).
#[must_use]
pub const fn normals_before(l: u64, m: u64) -> u64 {
    l * (l + 1) + 2 * m
}

/// Words of all coefficients up to `lmax`: (lmax + 1)(lmax + 2), or the largest number there is.
fn words_len(lmax: usize) -> usize {
    let count = lmax.checked_add(2).and_then(|n| n.checked_mul(lmax + 1));
    count.unwrap_or(usize::MAX)
}

/// White Gaussian harmonic coefficients, ⟨|a_lm|²⟩ = 1 for every l and m, drawn from the start of a stream.
///
/// a_l0 = x and a_lm = (x + iy)/√2 for m > 0, with (x, y) the next two normals; for m = 0 y is drawn and left. Draws run
/// over all m of l, then l + 1, so the coefficients do not depend on `lmax`.
///
/// | argument | shape | layout |
/// | --- | --- | --- |
/// | `alm` | (lmax+1)(lmax+2)/2 | m-major, index m(2 lmax + 1 − m)/2 + l |
///
/// # Errors
/// [`Error::Length`] if `alm` is not of that length.
pub fn white_alm_into(
    stream: &mut Stream,
    lmax: usize,
    alm: &mut [Complex<f64>],
) -> Result<(), Error> {
    Error::check_len("alm", words_len(lmax) / 2, alm.len())?;
    for l in 0..=lmax {
        let mut index = l;
        for m in 0..=l {
            let (x, y) = (stream.word(), stream.word());
            if let Some(a) = alm.get_mut(index) {
                *a = white(m, x, y);
            }
            index += lmax - m;
        }
    }
    Ok(())
}

/// One order m of [`white_alm_into`]'s coefficients, from the words it would draw: orders can be made side by side.
///
/// | argument | shape | what |
/// | --- | --- | --- |
/// | `words` | (lmax+1)(lmax+2) | the first words of the stream |
/// | `order` | lmax + 1 − m | a_lm, l = m … lmax |
///
/// # Errors
/// [`Error::Length`] if a slice is not of that length; m > lmax leaves none that is.
pub fn white_order_into(
    words: &[u64],
    lmax: usize,
    m: usize,
    order: &mut [Complex<f64>],
) -> Result<(), Error> {
    Error::check_len("words", words_len(lmax), words.len())?;
    Error::check_len("order", (lmax + 1).saturating_sub(m), order.len())?;
    for (l, a) in (m..).zip(order) {
        let at = l * (l + 1) + 2 * m;
        if let Some(&[x, y]) = words.get(at..at + 2) {
            *a = white(m, x, y);
        }
    }
    Ok(())
}

/// A coefficient of order m from its two words.
#[inline]
fn white(m: usize, x: u64, y: u64) -> Complex<f64> {
    if m == 0 {
        Complex::new(from_word(x), 0.0)
    } else {
        let half = core::f64::consts::FRAC_1_SQRT_2;
        Complex::new(half * from_word(x), half * from_word(y))
    }
}
