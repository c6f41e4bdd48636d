//! Root of a function of one variable in a bracket.
//!
//! Ridders' method (Ridders, IEEE Trans. Circuits Syst. 26, 979, 1979): an exponential factor straightens the function
//! over the bracket, then one step of false position; converges quadratically and never leaves the bracket. Each step
//! costs two evaluations.

/// The root of `f` between `a` and `b`, where `f(a) = fa` and `f(b) = fb` have opposite signs, to within `tolerance`.
///
/// Returns the last estimate when the bracket cannot shrink further, and `a` or `b` where the function vanishes there.
///
/// # Errors
/// The first error of `f`.
pub fn find_root<E>(
    mut f: impl FnMut(f64) -> Result<f64, E>,
    (mut a, mut fa): (f64, f64),
    (mut b, mut fb): (f64, f64),
    tolerance: f64,
) -> Result<f64, E> {
    if fa == 0.0 {
        return Ok(a);
    }
    if fb == 0.0 {
        return Ok(b);
    }
    let mut estimate = 0.5 * (a + b);
    // Halving alone ends a bracket of doubles in 1100 steps; Ridders takes a handful.
    for _ in 0..200 {
        let c = 0.5 * (a + b);
        let fc = f(c)?;
        if fc == 0.0 {
            return Ok(c);
        }
        let s = crate::scalar::sqrt(fc * fc - fa * fb);
        let step = if s > 0.0 { (c - a) * fc / s } else { 0.0 };
        let x = if fa > fb { c + step } else { c - step };
        let moved = (x - estimate).abs();
        estimate = x;
        let fx = f(x)?;
        if fx == 0.0 || moved <= tolerance {
            return Ok(x);
        }
        if (fc < 0.0) != (fx < 0.0) {
            (a, fa, b, fb) = if c < x {
                (c, fc, x, fx)
            } else {
                (x, fx, c, fc)
            };
        } else if (fa < 0.0) != (fx < 0.0) {
            (b, fb) = (x, fx);
        } else {
            (a, fa) = (x, fx);
        }
        if (b - a).abs() <= tolerance {
            return Ok(x);
        }
    }
    Ok(estimate)
}
