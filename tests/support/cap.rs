//! Residual sharing and the polarisation-fraction cap: what must hold for any input, and a slow, plain reference.

use dust3d_kernels::split::cap::{Outcome, pixel_scratch_len, renormalise_pixel};
use dust3d_kernels::split::residual::share;

/// One pixel to be shared and capped.
#[derive(Debug, Clone)]
pub struct Pixel {
    /// The largest polarisation fraction.
    pub p_max: f64,
    /// I_i.
    pub intensity: Vec<f64>,
    /// (Q̃, Ũ)^i, as many as intensities.
    pub predicted: Vec<[f64; 2]>,
    /// (Q, U).
    pub observed: [f64; 2],
}

/// Runs the kernel on dirty scratch.
pub fn run(pixel: &Pixel) -> (Outcome, Vec<[f64; 2]>) {
    let n = pixel.intensity.len();
    let mut q: Vec<f64> = pixel.predicted.iter().map(|v| v[0]).collect();
    let mut u: Vec<f64> = pixel.predicted.iter().map(|v| v[1]).collect();
    let mut scratch = vec![f64::NAN; pixel_scratch_len(n)];
    let outcome = renormalise_pixel(
        pixel.p_max,
        &pixel.intensity,
        pixel.observed,
        &mut q,
        &mut u,
        &mut scratch,
    );
    (outcome, q.into_iter().zip(u).map(|(q, u)| [q, u]).collect())
}

fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

/// Asserts every invariant of the cap on one pixel.
///
/// For any finite input there is no NaN; where all magnitudes are zero or within 1e-280 … 1e280 the sum is kept to 1e-12
/// of max(|V|, Σ|v|), the caps to 1e-12, untouched pixels have the bits of the shared split, and infeasible ones are
/// V I_i/ΣI.
///
/// # Panics
/// If an invariant is broken.
pub fn check(pixel: &Pixel) {
    let n = pixel.intensity.len();
    let (outcome, v) = run(pixel);
    let finite = |x: &f64| x.is_finite();
    let all_finite = pixel.intensity.iter().all(finite)
        && pixel.predicted.iter().flatten().all(finite)
        && pixel.observed.iter().all(finite)
        && pixel.p_max.is_finite();
    if n == 0 {
        return;
    }
    if !all_finite {
        assert_eq!(outcome, Outcome::Missing);
        assert!(v.iter().flatten().all(|x| x.is_nan()));
        return;
    }
    assert!(v.iter().flatten().all(|x| !x.is_nan()), "{pixel:?}: {v:?}");
    let tame = |x: &f64| *x == 0.0 || (1e-280..1e280).contains(&x.abs());
    if !(pixel.intensity.iter().all(tame)
        && pixel.predicted.iter().flatten().all(tame)
        && pixel.observed.iter().all(tame)
        && pixel.p_max >= 0.0
        && tame(&pixel.p_max)
        && tame(&(pixel.p_max * pixel.intensity.iter().copied().fold(0.0, f64::max))))
    {
        return;
    }
    let total = length(pixel.observed);
    let sum = v.iter().fold([0.0, 0.0], |s, v| [s[0] + v[0], s[1] + v[1]]);
    let lengths: f64 = v.iter().map(|&v| length(v)).sum();
    let off = length([sum[0] - pixel.observed[0], sum[1] - pixel.observed[1]]);
    assert!(
        off <= 1e-12 * total.max(lengths),
        "sum off by {off}: {pixel:?}: {v:?}"
    );

    let bright: f64 = pixel.intensity.iter().map(|i| i.max(0.0)).sum();
    let limit = pixel.p_max * bright;
    // Within rounding of the limit either outcome is right.
    let clearly_feasible = total <= limit * (1.0 - 1e-14);
    if clearly_feasible {
        assert_ne!(outcome, Outcome::Infeasible, "{pixel:?}");
    } else if total > limit * (1.0 + 1e-14) {
        assert_eq!(outcome, Outcome::Infeasible, "{pixel:?}");
    }
    if total <= limit {
        for (v, i) in v.iter().zip(&pixel.intensity) {
            let cap = pixel.p_max * i.max(0.0);
            assert!(
                length(*v) <= cap * (1.0 + 1e-12),
                "cap {cap}: {pixel:?}: {v:?}"
            );
        }
    }
    match outcome {
        Outcome::Kept => {
            let mut q: Vec<f64> = pixel.predicted.iter().map(|v| v[0]).collect();
            let mut u: Vec<f64> = pixel.predicted.iter().map(|v| v[1]).collect();
            let mut f = vec![0.0; n];
            share(&pixel.intensity, &mut q, &mut u, pixel.observed, &mut f);
            // Rescaling of extreme pixels may lose the last bits to underflow.
            let ordinary = |x: &f64| *x == 0.0 || (1e-100..1e100).contains(&x.abs());
            if pixel
                .predicted
                .iter()
                .flatten()
                .chain(&pixel.observed)
                .all(ordinary)
                && bright > 0.0
            {
                for ((v, q), u) in v.iter().zip(q).zip(u) {
                    assert_eq!(*v, [q, u], "{pixel:?}");
                }
            }
        }
        Outcome::Infeasible => {
            for (v, i) in v.iter().zip(&pixel.intensity) {
                let part = if bright > 0.0 {
                    i.max(0.0) / bright
                } else {
                    1.0 / n as f64
                };
                for (v, o) in v.iter().zip(pixel.observed) {
                    // A fraction below 1e-290 has lost digits.
                    let bound = 1e-13 * (o * part).abs() + 1e-290 * o.abs();
                    assert!((v - o * part).abs() <= bound, "{pixel:?}");
                }
            }
        }
        Outcome::Capped | Outcome::Missing => {}
    }
}

/// The state after sharing and the neighbour passes, and the weights w_i, straight from the definitions.
pub fn after_passes(pixel: &Pixel) -> (Vec<[f64; 2]>, Vec<f64>) {
    let n = pixel.intensity.len();
    let bright: f64 = pixel.intensity.iter().sum();
    let strength: Vec<f64> = pixel.predicted.iter().map(|&v| length(v)).collect();
    let all: f64 = strength.iter().sum();
    let f: Vec<f64> = (0..n)
        .map(|i| {
            if all > 0.0 {
                strength[i] / all
            } else {
                pixel.intensity[i] / bright
            }
        })
        .collect();
    let sum = |k: usize| pixel.predicted.iter().map(|v| v[k]).sum::<f64>();
    let residual = [pixel.observed[0] - sum(0), pixel.observed[1] - sum(1)];
    let mut v: Vec<[f64; 2]> = (0..n)
        .map(|i| {
            let p = pixel.predicted[i];
            [p[0] + f[i] * residual[0], p[1] + f[i] * residual[1]]
        })
        .collect();
    for _ in 0..2 * n {
        let before = v.clone();
        for i in 0..n {
            let cap = pixel.p_max * pixel.intensity[i];
            if length(before[i]) <= cap {
                continue;
            }
            let neighbours: Vec<usize> = [i.wrapping_sub(1), i + 1]
                .into_iter()
                .filter(|&j| j < n)
                .collect();
            for k in 0..2 {
                let excess = before[i][k] * (1.0 - cap / length(before[i]));
                v[i][k] -= excess;
                for &j in &neighbours {
                    v[j][k] += excess / neighbours.len() as f64;
                }
            }
        }
    }
    let w = (0..n).map(|i| f[i] + pixel.intensity[i] / bright).collect();
    (v, w)
}

/// The split nearest to `u` under the caps with the sum V, by bisection nested twice on the dual's gradient.
///
/// The inner root gives the gradient of the partially minimised (still convex) dual, so both are monotone.
pub fn nearest(pixel: &Pixel, u: &[[f64; 2]], w: &[f64]) -> Vec<[f64; 2]> {
    let split = |lambda: [f64; 2]| -> Vec<[f64; 2]> {
        (0..u.len())
            .map(|i| {
                let cap = pixel.p_max * pixel.intensity[i];
                let x = [u[i][0] + w[i] * lambda[0], u[i][1] + w[i] * lambda[1]];
                let l = length(x);
                if l > cap { x.map(|x| x * cap / l) } else { x }
            })
            .collect()
    };
    let gradient = |lambda: [f64; 2], k: usize| -> f64 {
        split(lambda).iter().map(|v| v[k]).sum::<f64>() - pixel.observed[k]
    };
    let bisect = |f: &dyn Fn(f64) -> f64| {
        let mut reach = 1.0;
        while f(reach) < 0.0 && reach < 1e12 {
            reach *= 2.0;
        }
        let mut high = reach;
        reach = 1.0;
        while f(-reach) > 0.0 && reach < 1e12 {
            reach *= 2.0;
        }
        let mut low = -reach;
        for _ in 0..120 {
            let middle = 0.5 * (low + high);
            if f(middle) < 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    };
    let inner = |x: f64| bisect(&|y| gradient([x, y], 1));
    let x = bisect(&|x| gradient([x, inner(x)], 0));
    split([x, inner(x)])
}
