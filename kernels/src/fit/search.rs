//! The minimum of a function of one variable: a scan's best bracket, refined by golden section.
//!
//! The objective of the pitch fit is a sum of absolute values: continuous, with a kink wherever a pixel changes sign,
//! and with one clear minimum in practice. Golden section needs no derivative, never leaves the bracket, and each
//! evaluation shrinks it by 0.618, which suits an objective that costs a pass over the sky. A minimum at the end of
//! the range is found as that end.

/// Where a function is least.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Minimum {
    /// The argument.
    pub x: f64,
    /// The value there.
    pub value: f64,
    /// Half the width of the interval known to hold the minimum of a unimodal function.
    pub tolerance: f64,
    /// Evaluations of the function.
    pub evaluations: u32,
}

/// The index of the least value of a scan, the first of equals; `None` if there is none that is not NaN.
#[must_use]
pub fn least(values: &[f64]) -> Option<usize> {
    let mut best: Option<(usize, f64)> = None;
    for (i, &value) in values.iter().enumerate() {
        if value < best.map_or(f64::INFINITY, |(_, v)| v) || (best.is_none() && !value.is_nan()) {
            best = Some((i, value));
        }
    }
    best.map(|(i, _)| i)
}

/// The interval around the least value of a scan: from the point before it to the point after it.
///
/// At an end of the scan the interval is one-sided. `None` if `x` and `values` differ in length, are empty, or hold no
/// number.
#[must_use]
pub fn bracket(x: &[f64], values: &[f64]) -> Option<[f64; 2]> {
    if x.len() != values.len() {
        return None;
    }
    let best = least(values)?;
    let before = x.get(best.saturating_sub(1))?;
    let after = x.get(best + 1).or(x.last())?;
    Some([*before, *after])
}

/// Golden-section search on \[low, high\] until the interval is shorter than 2·`tolerance`.
///
/// The ends are evaluated too, so a minimum at an end is returned as exactly that end, and the result is never worse
/// than either. At most 200 evaluations, however small the tolerance. The point returned is one at which `f` was
/// evaluated; NaN counts as larger than anything.
///
/// ```
/// use dust3d_kernels::fit::search::golden_section;
/// let m = golden_section(|x| (x - 0.3).abs(), -1.0, 1.0, 1e-6);
/// assert!((m.x - 0.3).abs() < 1e-6);
/// ```
pub fn golden_section(
    mut f: impl FnMut(f64) -> f64,
    low: f64,
    high: f64,
    tolerance: f64,
) -> Minimum {
    /// (√5 − 1)/2.
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let mut evaluations = 0;
    let mut eval = |x: f64| {
        evaluations += 1;
        let value = f(x);
        if value.is_nan() { f64::INFINITY } else { value }
    };
    let (mut a, mut b) = if low <= high {
        (low, high)
    } else {
        (high, low)
    };
    let mut best = (a, eval(a));
    let mut keep = |x: f64, value: f64| {
        if value < best.1 {
            best = (x, value);
        }
    };
    if b > a {
        let at_b = eval(b);
        keep(b, at_b);
        let (mut c, mut d) = (b - GOLDEN * (b - a), a + GOLDEN * (b - a));
        let (mut f_c, mut f_d) = (eval(c), eval(d));
        keep(c, f_c);
        keep(d, f_d);
        for _ in 0..196 {
            if b - a <= 2.0 * tolerance {
                break;
            }
            if f_c < f_d {
                (b, d, f_d) = (d, c, f_c);
                c = b - GOLDEN * (b - a);
                f_c = eval(c);
                keep(c, f_c);
            } else {
                (a, c, f_c) = (c, d, f_d);
                d = a + GOLDEN * (b - a);
                f_d = eval(d);
                keep(d, f_d);
            }
        }
    }
    let (x, value) = best;
    Minimum {
        x,
        value,
        tolerance: 0.5 * (b - a),
        evaluations,
    }
}
