//! The polarisation-fraction cap of one pixel: no layer above p_max I_i, the sum kept.
//!
//! \[MKD18\] gives the excess of a layer to its neighbours without saying how. Ours, precisely:
//!
//! 1. |V| > p_max ΣI: no split can obey the caps; v_i = V I_i/ΣI (V/N if ΣI = 0), and the pixel is infeasible.
//! 2. No layer above its cap c_i = p_max I_i: nothing is touched.
//! 3. 2N simultaneous passes: every layer with |v_i| > c_i gives away v_i (1 − c_i/|v_i|), half to each neighbour, all
//!    to the only one at an end, all computed from one state.
//! 4. If a layer still exceeds its cap, the split that minimises Σ |v_i − u_i|²/w_i under every cap and the sum, u the
//!    state after the passes and w_i = F_i + I_i/ΣI (module `dual`).
//!
//! **Numbers.** Everything is scaled by a power of two where |V| or the prediction is extreme, so no finite input gives
//! NaN, and intensities enter only as caps and fractions. The result is checked against the invariants, and where
//! rounding leaves no better answer (caps 1e16 times smaller than what is to be capped) the split V I_i/ΣI, which is
//! always feasible, is returned.

use super::dual;
use super::residual::{fractions, norm, power_of_two, share, unit_scale};
use crate::scalar::abs;

/// What became of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Every layer was within its cap: the shared split is unchanged.
    Kept,
    /// Some layer was above its cap; now none is.
    Capped,
    /// No split obeys the caps: v_i = V I_i/ΣI.
    Infeasible,
    /// Some input is not finite: every layer is NaN.
    Missing,
}

/// Relative excess over a cap, and relative error of a sum, that are rounding.
const SLACK: f64 = 4e-13;

/// Length of the scratch of [`renormalise_pixel`].
#[must_use]
pub const fn pixel_scratch_len(n_layers: usize) -> usize {
    5 * n_layers
}

/// Views of the scratch, N numbers each.
struct Work<'a> {
    /// F_i, then w_i.
    weight: &'a mut [f64],
    /// Caps c_i.
    cap: &'a mut [f64],
    /// What layers receive in a pass; later the state after the passes.
    spare_q: &'a mut [f64],
    spare_u: &'a mut [f64],
}

impl<'a> Work<'a> {
    /// The views, and N numbers for I_i/ΣI.
    fn new(n: usize, scratch: &'a mut [f64]) -> Option<(Self, &'a mut [f64])> {
        let (weight, rest) = scratch.split_at_mut_checked(n)?;
        let (fraction, rest) = rest.split_at_mut_checked(n)?;
        let (cap, rest) = rest.split_at_mut_checked(n)?;
        let (spare_q, rest) = rest.split_at_mut_checked(n)?;
        let (spare_u, _) = rest.split_at_mut_checked(n)?;
        let work = Self {
            weight,
            cap,
            spare_q,
            spare_u,
        };
        Some((work, fraction))
    }
}

/// Shares the residual of one pixel (see [`super::residual`]) and caps the result.
///
/// | argument | shape | what |
/// | --- | --- | --- |
/// | `p_max` | 1 | the largest polarisation fraction, ≥ 0 |
/// | `intensity` | N | I_i; below zero counts as zero |
/// | `observed` | 2 | V = (Q, U) |
/// | `q`, `u` | N | in: the prediction (Q̃, Ũ)^i; out: the split v_i |
/// | `scratch` | ≥ [`pixel_scratch_len`]`(N)` | contents ignored, left dirty |
///
/// Lengths that do not fit leave everything untouched and give [`Outcome::Missing`]; [`super::renormalise_into`]
/// checks them.
///
/// # Accuracy
/// For finite input of magnitude 0 or 1e-290 and more:
/// |Σ v_i − V| ≤ 1e-12 max(|V|, Σ|v_i|); |v_i| ≤ c_i (1 + 1e-12) unless infeasible; a pixel that needs no cap has the bits
/// of [`share`] (but for under- and overflow).
///
/// ```
/// use dust3d_kernels::split::cap::*;
/// // One bright layer: the other may carry no more than a quarter of its intensity.
/// let (mut q, mut u) = ([0.1, 0.9], [0.0, 0.0]);
/// let mut scratch = [0.0; pixel_scratch_len(2)];
/// let outcome = renormalise_pixel(0.25, &[8.0, 2.0], [1.0, 0.0], &mut q, &mut u, &mut scratch);
/// assert_eq!((outcome, q), (Outcome::Capped, [0.5, 0.5]));
/// ```
pub fn renormalise_pixel(
    p_max: f64,
    intensity: &[f64],
    observed: [f64; 2],
    q: &mut [f64],
    u: &mut [f64],
    scratch: &mut [f64],
) -> Outcome {
    let n = intensity.len();
    if q.len() != n || u.len() != n {
        return Outcome::Missing;
    }
    let Some((work, fraction)) = Work::new(n, scratch) else {
        return Outcome::Missing;
    };
    let maps = q.iter().chain(u.iter()).chain(&observed);
    let finite = maps.clone().chain(intensity).all(|x| x.is_finite());
    if !finite || !p_max.is_finite() {
        q.fill(f64::NAN);
        u.fill(f64::NAN);
        return Outcome::Missing;
    }
    if !fractions(intensity.iter().copied(), fraction) {
        fraction.fill(1.0 / n as f64);
        proportional(observed, fraction, q, u);
        return if observed == [0.0, 0.0] {
            Outcome::Kept
        } else {
            Outcome::Infeasible
        };
    }
    let own = scale_of(&mut observed.iter());
    caps(p_max, intensity, own, work.cap);
    let limit = work.cap.iter().fold(0.0, |sum, c| sum + c);
    if norm(observed[0] * own, observed[1] * own) > limit {
        proportional(observed, fraction, q, u);
        return Outcome::Infeasible;
    }
    let scale = scale_of(&mut q.iter().chain(u.iter()).chain(&observed));
    if scale != own {
        caps(p_max, intensity, scale, work.cap);
    }
    rescale(q, u, scale);
    let (outcome, good) = split(observed.map(|x| x * scale), intensity, fraction, q, u, work);
    rescale(q, u, 1.0 / scale);
    if !(good && sums_to(observed, q, u)) {
        proportional(observed, fraction, q, u);
    }
    outcome
}

/// A power of two that brings the largest of some numbers near one; 1 unless it is extreme.
///
/// Scaling changes no bit (but for underflow) and keeps sums and squares in range.
fn scale_of(numbers: &mut dyn Iterator<Item = &f64>) -> f64 {
    let largest = numbers.fold(0.0, |a: f64, x| a.max(abs(*x)));
    if (1e-120..1e120).contains(&largest) {
        1.0
    } else {
        unit_scale(largest)
    }
}

fn rescale(q: &mut [f64], u: &mut [f64], scale: f64) {
    if scale != 1.0 {
        for x in q.iter_mut().chain(u) {
            *x *= scale;
        }
    }
}

/// Steps 2 to 4 of a feasible pixel; the outcome, and whether the caps are kept.
fn split(
    observed: [f64; 2],
    intensity: &[f64],
    fraction: &[f64],
    q: &mut [f64],
    u: &mut [f64],
    work: Work<'_>,
) -> (Outcome, bool) {
    share(intensity, q, u, observed, work.weight);
    if within(work.cap, 0.0, q, u) {
        return (Outcome::Kept, true);
    }
    for _ in 0..2 * q.len() {
        if !pass(work.cap, q, u, work.spare_q, work.spare_u) {
            break;
        }
    }
    if !(within(work.cap, SLACK, q, u) && sums_to(observed, q, u)) {
        for (w, f) in work.weight.iter_mut().zip(fraction) {
            *w += f;
        }
        work.spare_q.copy_from_slice(q);
        work.spare_u.copy_from_slice(u);
        dual::nearest(
            observed,
            work.cap,
            work.weight,
            [work.spare_q, work.spare_u],
            q,
            u,
        );
    }
    (Outcome::Capped, within(work.cap, SLACK, q, u))
}

/// c_i = p_max I_i in scaled units; none so large that sums overflow, none so small that it has lost digits.
fn caps(p_max: f64, intensity: &[f64], scale: f64, cap: &mut [f64]) {
    for (c, &i) in cap.iter_mut().zip(intensity) {
        let product = p_max.max(0.0) * i.max(0.0) * scale;
        *c = if product > 1e-290 {
            product.min(power_of_two(500))
        } else {
            0.0
        };
    }
}

/// v_i = V f_i.
fn proportional(observed: [f64; 2], fraction: &[f64], q: &mut [f64], u: &mut [f64]) {
    for ((q, u), f) in q.iter_mut().zip(u).zip(fraction) {
        (*q, *u) = (observed[0] * f, observed[1] * f);
    }
}

/// One simultaneous neighbour pass; false if no layer was above its cap.
fn pass(
    cap: &[f64],
    q: &mut [f64],
    u: &mut [f64],
    gained_q: &mut [f64],
    gained_u: &mut [f64],
) -> bool {
    let n = cap.len();
    if n < 2 {
        return false;
    }
    gained_q.fill(0.0);
    gained_u.fill(0.0);
    let mut any = false;
    for (i, ((&c, q), u)) in cap.iter().zip(&mut *q).zip(&mut *u).enumerate() {
        let length = norm(*q, *u);
        if length > c {
            any = true;
            let keep = c / length;
            let kept = [*q * keep, *u * keep];
            let excess = [*q - kept[0], *u - kept[1]];
            [*q, *u] = kept;
            let inner = i > 0 && i + 1 < n;
            let part = if inner { 0.5 } else { 1.0 };
            let mut give = |to: usize| {
                if let (Some(q), Some(u)) = (gained_q.get_mut(to), gained_u.get_mut(to)) {
                    *q += part * excess[0];
                    *u += part * excess[1];
                }
            };
            if i > 0 {
                give(i - 1);
            }
            if i + 1 < n {
                give(i + 1);
            }
        }
    }
    if any {
        for (x, gained) in q.iter_mut().zip(gained_q).chain(u.iter_mut().zip(gained_u)) {
            *x += *gained;
        }
    }
    any
}

/// Is every layer within its cap?
fn within(cap: &[f64], slack: f64, q: &[f64], u: &[f64]) -> bool {
    let mut layers = q.iter().zip(u).zip(cap);
    layers.all(|((&q, &u), &c)| norm(q, u) <= c * (1.0 + slack))
}

/// Do the layers add up to V, to rounding?
fn sums_to(observed: [f64; 2], q: &[f64], u: &[f64]) -> bool {
    let mut off = [-observed[0], -observed[1]];
    let mut lengths = 0.0;
    for (&q, &u) in q.iter().zip(u) {
        off = [off[0] + q, off[1] + u];
        lengths += abs(q) + abs(u);
    }
    abs(off[0]) + abs(off[1]) <= SLACK * lengths.max(abs(observed[0]) + abs(observed[1]))
}
