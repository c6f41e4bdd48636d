//! Rotation of harmonic coefficients.
//!
//! The function f′(v) = f(R⁻¹ v) has a′_lm = Σ_m′ D^l_mm′ a_lm′, D^l_mm′ = e^(−imα) d^l_mm′(β) e^(−im′γ) for
//! R = R_z(α) R_y(β) R_z(γ). Degree by degree, the matrix d^l follows from that of degree l − ½ by adding one spin ½
//! [Risbo 1996, J. Geodesy 70, 383]: with J = 2l and states numbered i = l − m, each is a mean over one spin more,
//!
//! d(i, k) = [√((J−i)(J−k)) c d(i, k) − √((J−i)k) s d(i, k−1) + √(i(J−k)) s d(i−1, k) + √(ik) c d(i−1, k−1)]/J,
//!
//! c = cos β/2, s = sin β/2, old values on the right. Every step is a contraction: rounding does not grow. Rows with
//! m ≥ 0 are kept, as d_{−m,−m′} = (−1)^{m−m′} d_mm′.
//!
//! Cost: 4/3 lmax³ elements, twice; memory 4 lmax² numbers.

use crate::kernels::sht::alm;
use crate::kernels::{Complex, Error};
use rayon::prelude::*;

/// Rows of a matrix above which threads share them.
const SHARED_ROWS: usize = 128;

/// Rotates coefficients up to `lmax`, in place, by R = R_z(α) R_y(β) R_z(γ), the angles of `euler` in radians. E and B are
/// rotated as T is. Relative to the largest coefficient of a degree the error is below 1e-12 up to lmax = 2048.
///
/// # Errors
/// [`Error::Length`] unless every one of `alms` has the coefficients up to `lmax`.
pub fn rotate_alms(
    alms: &mut [&mut [Complex<f64>]],
    lmax: usize,
    euler: [f64; 3],
) -> Result<(), Error> {
    for alm in alms.iter() {
        if alm.len() != alm::len(lmax) {
            return Err(Error::Length {
                what: "alm",
                expected: alm::len(lmax),
                got: alm.len(),
            });
        }
    }
    let [alpha, beta, gamma] = euler;
    let phases = |angle: f64| -> Vec<Complex<f64>> {
        (0..=lmax)
            .map(|m| Complex::from_polar(1.0, -(m as f64 * angle)))
            .collect()
    };
    let (left, right) = (phases(alpha), phases(gamma));
    let mut matrix = Matrix::new(lmax, beta);
    let mut turned = vec![Complex::new(0.0, 0.0); lmax + 1];
    for l in 1..=lmax {
        matrix.grow();
        matrix.grow();
        for alm in alms.iter_mut() {
            for (m, (turned, phase)) in turned[..=l].iter_mut().zip(&right).enumerate() {
                *turned = alm[alm::index(lmax, l, m)] * phase;
            }
            for (m, phase) in left[..=l].iter().enumerate() {
                alm[alm::index(lmax, l, m)] = matrix.row_sum(l, m, &turned[..=l]) * phase;
            }
        }
    }
    Ok(())
}

/// d of one degree, whole or half.
struct Matrix {
    /// J = 2l.
    twice: usize,
    cos: f64,
    sin: f64,
    /// √0, √1, …
    roots: Vec<f64>,
    /// Numbers from row to row.
    stride: usize,
    /// Rows i = 0 … ⌊J/2⌋ + 1, where there are as many.
    rows: Vec<f64>,
    /// Those of J − 1.
    before: Vec<f64>,
}

impl Matrix {
    fn new(lmax: usize, beta: f64) -> Self {
        let stride = 2 * lmax + 1;
        let mut rows = vec![0.0; (lmax + 2) * stride];
        rows[0] = 1.0;
        Self {
            twice: 0,
            cos: (beta / 2.0).cos(),
            sin: (beta / 2.0).sin(),
            roots: (0..=stride).map(|n| (n as f64).sqrt()).collect(),
            stride,
            before: rows.clone(),
            rows,
        }
    }

    /// From J to J + 1.
    fn grow(&mut self) {
        std::mem::swap(&mut self.rows, &mut self.before);
        self.twice += 1;
        let (n, stride) = (self.twice, self.stride);
        let last = n / 2;
        let step = Step {
            n,
            cos: self.cos / n as f64,
            sin: self.sin / n as f64,
            roots: &self.roots,
        };
        let before = &self.before;
        let row = |(i, row): (usize, &mut [f64])| {
            // Row i − 1 of nothing is multiplied by √0.
            let above = i.saturating_sub(1) * stride;
            let (above, same) = (
                &before[above..above + n],
                &before[i * stride..i * stride + n],
            );
            step.row(i, above, same, &mut row[..=n]);
        };
        let rows = self.rows[..(last + 1) * stride].par_chunks_mut(stride);
        if last >= SHARED_ROWS {
            rows.enumerate().for_each(row);
        } else {
            self.rows[..(last + 1) * stride]
                .chunks_mut(stride)
                .enumerate()
                .for_each(row);
        }
        // One row more, by the symmetry, for the next step.
        let extra = last + 1;
        if extra <= n {
            let mirror = n - extra;
            for k in 0..=n {
                let value = self.rows[mirror * stride + n - k];
                let odd = (extra + k) % 2 == 1;
                self.rows[extra * stride + k] = if odd { -value } else { value };
            }
        }
    }

    /// Σ_m′ d^l_mm′ b_m′ over all m′, of coefficients with b_{−m′} = (−1)^m′ conj b_m′.
    fn row_sum(&self, l: usize, m: usize, b: &[Complex<f64>]) -> Complex<f64> {
        let start = (l - m) * self.stride;
        let row = &self.rows[start..start + 2 * l + 1];
        let (plus, minus) = (&row[..=l], &row[l..]);
        let mut sum = b[0] * row[l];
        let mut sign = -1.0;
        // m′ = 1, 2, …: leftwards of the middle; −m′ rightwards.
        for ((b, plus), minus) in b[1..]
            .iter()
            .zip(plus.iter().rev().skip(1))
            .zip(&minus[1..])
        {
            let minus = sign * minus;
            sum.re += (plus + minus) * b.re;
            sum.im += (plus - minus) * b.im;
            sign = -sign;
        }
        sum
    }
}

/// What all rows of a step share; cos and sin divided by J.
struct Step<'a> {
    n: usize,
    cos: f64,
    sin: f64,
    roots: &'a [f64],
}

impl Step<'_> {
    /// Row i of J from rows i − 1 and i of J − 1.
    fn row(&self, i: usize, above: &[f64], same: &[f64], row: &mut [f64]) {
        let n = self.n;
        let (down, up) = (self.roots[n - i], self.roots[i]);
        let (same_cos, same_sin) = (down * self.cos, down * self.sin);
        let (above_cos, above_sin) = (up * self.cos, up * self.sin);
        // Both old rows end at k = n − 1.
        row[0] = self.roots[n] * (same_cos * same[0] + above_sin * above[0]);
        row[n] = self.roots[n] * (above_cos * above[n - 1] - same_sin * same[n - 1]);
        let inner = row[1..n].iter_mut().enumerate();
        for (k, value) in inner {
            let (left, right) = (self.roots[k + 1], self.roots[n - 1 - k]);
            *value = right * (same_cos * same[k + 1] + above_sin * above[k + 1])
                + left * (above_cos * above[k] - same_sin * same[k]);
        }
    }
}
