//! The recurrence in steps of two degrees \[I18\], and its coefficients.
//!
//! With ε_l = √((l² − m²)/(4l² − 1)) the functions of one order obey x λ_l = ε_{l+1} λ_{l+1} + ε_l λ_{l−1}, x = cos θ.
//! Those of odd l − m vanish at the equator: λ_{m+2n+1} = x r_n with r_n even in x, and then
//! λ_{m+2n} = ε_{l+1} r_n + ε_l r_{n−1} (l = m + 2n). One set of functions r_n therefore carries both parities:
//!
//! Σ_l a_l λ_l = Σ_n r_n [(ε_{l+1} a_l + ε_{l+2} a_{l+2}) + x a_{l+1}].
//!
//! Two steps of the recurrence of λ make one of r, in x²; scaled as r_n = α_n q_n with
//! α_{n+1} D_{n+1} = α_{n−1} D_n, D_n = ε_{l+1} ε_l at l = m + 2n, it becomes
//!
//! q_{n+1} = (a_n x² + b_n) q_n − q_{n−1},   a_n = α_n/(α_{n+1} D_{n+1}),   b_n = −a_n (ε_{l+1}² + ε_{l+2}²):
//!
//! two FMA for two degrees. Near the poles a_n x² + b_n loses what θ says, and is formed as c_n − a_n sin²θ,
//! c_n = a_n + b_n. The free first ratio of α is chosen so that α_{n+1}/α_n → 1 at the end of the chain.

use super::double::Double;
use crate::error::Error;
use crate::scalar;

/// One step of the recurrence: a_n, b_n, c_n = a_n + b_n, α_n.
pub type Step = [f64; 4];

/// Steps needed for order `m`: n = 0 … with l = m + 2n ≤ lmax + 2 (the two more are for spin 2).
#[must_use]
pub const fn step_count(lmax: usize, m: usize) -> usize {
    (lmax + 2).saturating_sub(m) / 2 + 1
}

/// Entries of [`epsilon_table`] for order `m`: l = m … lmax + 6.
#[must_use]
pub const fn epsilon_len(lmax: usize, m: usize) -> usize {
    (lmax + 7).saturating_sub(m)
}

/// ε_l = √((l² − m²)/(4l² − 1)) for l = m, m + 1, …; entry 0 is zero.
pub fn epsilon_table(m: usize, out: &mut [f64]) {
    let mf = m as f64;
    for (k, e) in out.iter_mut().enumerate() {
        let l = mf + k as f64;
        // both factors are exact integers below 2^53
        *e = scalar::sqrt(((l - mf) * (l + mf)) / ((2.0 * l - 1.0) * (2.0 * l + 1.0)));
    }
}

/// The steps of one order from its ε; `steps` of [`step_count`], `epsilon` of [`epsilon_len`].
///
/// # Errors
/// [`Error::Length`] if `epsilon` is too short for `steps`.
pub fn step_table(epsilon: &[f64], steps: &mut [Step]) -> Result<(), Error> {
    let count = steps.len();
    Error::check_scratch("epsilon", 2 * count + 2, epsilon.len())?;
    let product = |n: usize| epsilon[2 * n + 1] * epsilon[2 * n];
    // α downwards from the end, where it is one
    let (mut above, mut here) = (1.0, 1.0);
    for n in (0..count).rev() {
        // here = α_n, above = α_{n+1}
        let d = product(n + 1);
        let a = here / (above * d);
        let (e1, e2) = (epsilon[2 * n + 1], epsilon[2 * n + 2]);
        let e = e1 * e1 + e2 * e2;
        steps[n] = [a, -a * e, a * (1.0 - e), here];
        // α_{n−1} = α_{n+1} D_{n+1}/D_n
        if n > 0 {
            let below = above * d / product(n);
            (above, here) = (here, below);
        }
    }
    Ok(())
}

/// r_0/sin^m θ for m = 0, 1, …: (−1)^m √(2m+3) √(Π_{k≤m} (2k+1)/(2k) / 4π).
///
/// To be divided by α_0 of the order to start q.
pub fn start_norms(out: &mut [f64]) {
    // 1/4π
    let mut product = Double {
        hi: 0.079_577_471_545_947_67,
        lo: -4.919_669_168_795_621_5e-18,
    };
    for (m, out) in out.iter_mut().enumerate() {
        let m = m as f64;
        if m > 0.0 {
            product = product
                .mul(Double::from(2.0 * m + 1.0))
                .div(Double::from(2.0 * m));
        }
        *out = product.mul(Double::from(2.0 * m + 3.0)).sqrt().value();
    }
    for out in out.iter_mut().skip(1).step_by(2) {
        *out = -*out;
    }
}
