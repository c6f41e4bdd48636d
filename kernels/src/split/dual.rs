//! The split nearest to a given one under caps and a fixed sum, through its two-dimensional dual.
//!
//! minimise Σ |v_i − u_i|²/w_i  subject to  Σ v_i = V, |v_i| ≤ c_i.
//!
//! With λ the multiplier of the sum, v_i(λ) = the projection of u_i + w_i λ on the disc of radius c_i, and λ solves
//! g(λ) = Σ v_i(λ) − V = 0: the gradient of a convex function of two variables, smooth but for the circles
//! |u_i + w_i λ| = c_i. Newton's method with a line search on the slope g·d (monotone along a line, and free of the
//! cancellation that the function's values suffer) converges from anywhere; the last steps are quadratic.
//!
//! What rounding of λ leaves of the sum is given to the layers that have room.

use super::residual::norm;
use crate::scalar::abs;

/// The projection of (x, y) on the disc of radius c, and |(x, y)|.
#[inline]
fn project(x: f64, y: f64, c: f64) -> ([f64; 2], f64) {
    let length = norm(x, y);
    if length > c {
        let keep = c / length;
        ([x * keep, y * keep], length)
    } else {
        ([x, y], length)
    }
}

/// A gradient so small against the lengths summed up is mostly rounding: no line is searched for a smaller one.
const ROUNDING: f64 = 1e-14;

/// The problem, scaled to numbers near one.
struct Problem<'a> {
    observed: [f64; 2],
    cap: &'a [f64],
    weight: &'a [f64],
    state: [&'a [f64]; 2],
}

/// The gradient at λ, its derivative (xx, xy, yy), and Σ|v_i|.
struct Slope {
    gradient: [f64; 2],
    hessian: [f64; 3],
    lengths: f64,
}

impl Problem<'_> {
    fn layers(&self) -> impl Iterator<Item = (f64, f64, [f64; 2])> {
        let [q, u] = self.state;
        let state = q.iter().zip(u).map(|(&q, &u)| [q, u]);
        let bounds = self.cap.iter().zip(self.weight);
        bounds.zip(state).map(|((&c, &w), state)| (c, w, state))
    }

    fn slope(&self, lambda: [f64; 2]) -> Slope {
        let mut sum = [0.0, 0.0];
        let mut hessian = [0.0; 3];
        let mut lengths = 0.0;
        for (c, w, [q, u]) in self.layers() {
            let (x, y) = (q + w * lambda[0], u + w * lambda[1]);
            let (v, length) = project(x, y, c);
            sum = [sum[0] + v[0], sum[1] + v[1]];
            if length > c {
                // w c/|x| (1 − x̂x̂ᵀ): only turning is left.
                let bend = w * (c / length);
                let (ex, ey) = (x / length, y / length);
                hessian[0] += bend * ey * ey;
                hessian[1] -= bend * ex * ey;
                hessian[2] += bend * ex * ex;
                lengths += c;
            } else {
                hessian[0] += w;
                hessian[2] += w;
                lengths += length;
            }
        }
        Slope {
            gradient: [sum[0] - self.observed[0], sum[1] - self.observed[1]],
            hessian,
            lengths,
        }
    }
}

/// The Newton step −H⁻¹ g with the eigenvalues of H kept above a tiny part of the largest.
fn newton_step(h: [f64; 3], g: [f64; 2]) -> Option<[f64; 2]> {
    let [a, b, d] = h;
    let trace = a + d;
    if !(trace > 0.0) {
        return None;
    }
    let half_difference = 0.5 * (a - d);
    let root = norm(half_difference, b);
    let large = 0.5 * trace + root;
    // The determinant over the large eigenvalue: the small one without cancellation of the trace.
    let small = ((a * d - b * b) / large).max(1e-16 * large);
    // The eigenvector of the large one, from whichever row is not degenerate.
    let (ex, ey) = if root == 0.0 {
        (1.0, 0.0)
    } else if half_difference >= 0.0 {
        (half_difference + root, b)
    } else {
        (b, root - half_difference)
    };
    let length = norm(ex, ey);
    let (ex, ey) = if length > 0.0 {
        (ex / length, ey / length)
    } else {
        (1.0, 0.0)
    };
    let along = -(g[0] * ex + g[1] * ey) / large;
    let across = -(g[1] * ex - g[0] * ey) / small;
    let step = [along * ex - across * ey, along * ey + across * ex];
    (step[0].is_finite() && step[1].is_finite()).then_some(step)
}

/// Moves along `step` to where the slope has all but vanished; the new λ and what is there.
fn line_search(
    problem: &Problem<'_>,
    from: [f64; 2],
    start: f64,
    before: &Slope,
    step: [f64; 2],
) -> ([f64; 2], Slope) {
    let at = |t: f64| [from[0] + t * step[0], from[1] + t * step[1]];
    let rate = |s: &Slope| s.gradient[0] * step[0] + s.gradient[1] * step[1];
    let size = |s: &Slope| norm(s.gradient[0], s.gradient[1]);
    let first = rate(before);
    let mut t = 1.0;
    let mut slope = problem.slope(at(t));
    if size(&slope) <= 0.5 * start || start <= ROUNDING * before.lengths {
        return (at(t), slope);
    }
    // Where the rate is below zero and above it.
    let (mut low, mut low_rate) = (0.0, first);
    let mut high: Option<(f64, f64)> = None;
    for _ in 0..100 {
        let here = rate(&slope);
        if abs(here) <= 0.25 * abs(first) {
            break;
        }
        if here < 0.0 {
            (low, low_rate) = (t, here);
        } else {
            high = Some((t, here));
        }
        t = match high {
            None => 2.0 * t,
            Some((end, end_rate)) => {
                // False position, kept off the ends.
                let part = (low_rate / (low_rate - end_rate)).clamp(0.1, 0.9);
                low + part * (end - low)
            }
        };
        slope = problem.slope(at(t));
    }
    (at(t), slope)
}

/// Overwrites `q`, `u` with the split nearest to `state` that keeps the caps and has the sum `observed`.
///
/// All slices have one length. The problem should be feasible: |V| ≤ Σ c_i.
pub(super) fn nearest(
    observed: [f64; 2],
    cap: &[f64],
    weight: &[f64],
    [state_q, state_u]: [&[f64]; 2],
    q: &mut [f64],
    u: &mut [f64],
) {
    let problem = Problem {
        observed,
        cap,
        weight,
        state: [state_q, state_u],
    };
    let mut lambda = [0.0, 0.0];
    let mut best = (lambda, f64::INFINITY);
    let mut slope = problem.slope(lambda);
    for _ in 0..100 {
        let size = norm(slope.gradient[0], slope.gradient[1]);
        let better = size < best.1;
        if better {
            best = (lambda, size);
        }
        let limit = if better { 1e-16 } else { ROUNDING };
        if size <= limit * slope.lengths {
            break;
        }
        let Some(step) = newton_step(slope.hessian, slope.gradient) else {
            break;
        };
        let moved;
        (moved, slope) = line_search(&problem, lambda, size, &slope, step);
        if moved == lambda {
            break;
        }
        lambda = moved;
    }
    let lambda = best.0;
    let mut left = observed;
    let layers = problem.layers();
    for (((c, w, [state_q, state_u]), q), u) in layers.zip(&mut *q).zip(&mut *u) {
        let v;
        (v, _) = project(state_q + w * lambda[0], state_u + w * lambda[1], c);
        [*q, *u] = v;
        left = [left[0] - v[0], left[1] - v[1]];
    }
    // Rounding left over: to whichever layers have room, the largest cap first come, first served.
    for _ in 0..4 {
        for ((q, u), &c) in q.iter_mut().zip(&mut *u).zip(cap) {
            if left == [0.0, 0.0] {
                return;
            }
            let ([x, y], _) = project(*q + left[0], *u + left[1], c);
            left = [left[0] - (x - *q), left[1] - (y - *u)];
            (*q, *u) = (x, y);
        }
    }
}
