//! Wigner 3j symbols (j l₂ l₃; 0 m −m) for all j at once.
//!
//! With m₁ = 0 the recurrence of Schulten & Gordon \[SG75\] in j loses its common factor j (j+1) and is symmetric:
//!
//! a(j+1) f(j+1) − 2m(2j+1) f(j) + a(j) f(j−1) = 0,   a(j)² = (j² − (l₂−l₃)²)((l₂+l₃+1)² − j²),
//!
//! j = |l₂−l₃| … l₂+l₃. Beyond the turning points near either end its wanted solution grows towards the middle, so it is
//! run upwards from the lower end and downwards from the upper one, joined in the middle, normalised by
//! Σ (2j+1) f² = 1, and given the sign of its last value, (−1)^(l₂−l₃). For m = 0 every other value is zero and the
//! recurrence has two terms. The cost is one square root and one quotient a value.
//!
//! **\[SG75\]** Schulten & Gordon, J. Math. Phys. 16, 1961 (1975).

use crate::Error;
use crate::scalar::sqrt;

/// The number of symbols for l₂, l₃: j = |l₂−l₃| … l₂+l₃.
#[must_use]
pub const fn wigner3j_len(l2: usize, l3: usize) -> usize {
    2 * (if l2 < l3 { l2 } else { l3 }) + 1
}

/// `out[i]` = (j `l2` `l3`; 0 `m` −`m`) at j = |l₂−l₃| + i; all zero where m exceeds l₂ or l₃.
///
/// `out`: [`wigner3j_len`]`(l2, l3)` values. Tested for m = 0, 2: to 1e-15 for l to 200, norms and ends to 1e-14 for l to
/// 4096 (rows `WIGNER_3J` of the tolerance table).
///
/// # Errors
/// [`Error::Length`] where `out` has another length.
pub fn wigner3j_into(l2: usize, l3: usize, m: usize, out: &mut [f64]) -> Result<(), Error> {
    Error::check_len("3j symbols", wigner3j_len(l2, l3), out.len())?;
    out.fill(0.0);
    if m > l2 || m > l3 {
        return Ok(());
    }
    let steps = Steps::new(l2, l3, m);
    let n = out.len();
    // The middle lies between the turning points; up to it from below, down to it from above.
    let middle = n / 2;
    let low = steps.upwards(out, middle);
    if middle + 1 < n {
        steps.downwards(out, middle, low);
    }
    let norm: f64 = out
        .iter()
        .enumerate()
        .map(|(i, f)| (2.0 * steps.j(i) + 1.0) * f * f)
        .sum();
    let last = out.last().copied().unwrap_or(1.0);
    let odd = (l2 + l3) % 2 == 1;
    let scale = if (last < 0.0) == odd { 1.0 } else { -1.0 } / sqrt(norm);
    for f in out.iter_mut() {
        *f *= scale;
    }
    Ok(())
}

/// The recurrence for one l₂, l₃, m.
struct Steps {
    /// |l₂−l₃|, the least j.
    difference: f64,
    /// l₂+l₃+1.
    above: f64,
    m: f64,
}

impl Steps {
    fn new(l2: usize, l3: usize, m: usize) -> Self {
        Self {
            difference: l2.abs_diff(l3) as f64,
            above: (l2 + l3 + 1) as f64,
            m: m as f64,
        }
    }

    fn j(&self, i: usize) -> f64 {
        self.difference + i as f64
    }

    /// a at the j of index i.
    fn a(&self, i: usize) -> f64 {
        let j = self.j(i);
        let (d, s) = (self.difference, self.above);
        sqrt((j - d) * (j + d) * (s - j) * (s + j))
    }

    /// The factor of the middle term at index i, 2m(2j+1).
    fn b(&self, i: usize) -> f64 {
        2.0 * self.m * (2.0 * self.j(i) + 1.0)
    }

    /// Fills in `out[0 ..= last]` and returns the last two values, the value before the first being 0.
    fn upwards(&self, out: &mut [f64], last: usize) -> (f64, f64) {
        let (mut before, mut here) = (0.0, 1.0);
        let mut a = self.a(0);
        for (i, out) in out.iter_mut().enumerate().take(last + 1) {
            *out = here;
            if i == last {
                break;
            }
            let next_a = self.a(i + 1);
            let next = (self.b(i) * here - a * before) / next_a;
            (before, here, a) = (here, next, next_a);
        }
        (before, here)
    }

    /// Fills in `out[middle + 1 ..]`, scaled so as to continue the values `low` at middle − 1 and middle.
    fn downwards(&self, out: &mut [f64], middle: usize, low: (f64, f64)) {
        let n = out.len();
        let (mut above, mut here) = (0.0, 1.0);
        let mut a = self.a(n);
        for i in (0..n).rev() {
            if i <= middle {
                break;
            }
            if let Some(out) = out.get_mut(i) {
                *out = here;
            }
            let next_a = self.a(i);
            let next = (self.b(i) * here - a * above) / next_a;
            (above, here, a) = (here, next, next_a);
        }
        // `here` is now at the middle; one step further for the value before it.
        let before = if middle > 0 {
            (self.b(middle) * here - a * above) / self.a(middle)
        } else {
            0.0
        };
        // One of the two may be zero or nearly so: the scale is that of least squares.
        let scale = (low.0 * before + low.1 * here) / (before * before + here * here);
        for out in out.iter_mut().skip(middle + 1) {
            *out *= scale;
        }
    }
}
