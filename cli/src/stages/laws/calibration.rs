//! The factors of the emission laws that make the total look like the observations.
//!
//! A sum of layers is fitted hotter and with a smaller spread than its layers (\[MKD18\], section 6, who scale the average
//! temperatures by 0.982 and the fluctuations of T and β by 1.84 and 1.94 for Planck's data). Here the three factors are
//! solved for: the fit of the total must have the observed mean and standard deviation of T and, within
//! [`S_BETA_RANGE`], the observed standard deviation of β. Where no s_β in the range does that, it is held at the nearer
//! end and the other two are solved.
//!
//! A sample of pixels finds the factors and the derivatives; the whole map then corrects them in one or two steps.

use super::sky::{Factors, FitStats, LawStats, Sky, TotalFit};
use crate::Error;
use crate::progress::Progress;
use dust3d_kernels::fit::find_root;
use serde::{Deserialize, Serialize};

/// Allowed factors of the spectral-index fluctuations.
pub const S_BETA_RANGE: (f64, f64) = (0.5, 5.0);
/// Points of the range at which the sign of the mismatch is looked at.
const S_BETA_SCAN: [f64; 7] = [0.5, 0.75, 1.0, 1.5, 2.25, 3.5, 5.0];
/// The whole map is corrected until the statistics agree to this, relative.
const TOLERANCE: f64 = 1e-5;
/// Evaluations of the whole map at most.
const STEPS: usize = 8;

/// Whether s_β was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CalibrationStatus {
    /// All three factors solve.
    Solved,
    /// s_β is at an end of its range.
    Limit,
    /// The factors were given.
    Given,
}

/// The factors and what they lead to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration {
    /// The factors.
    pub factors: Factors,
    /// How they were found.
    pub status: CalibrationStatus,
    /// Fit of the total on the whole map.
    pub fit: FitStats,
}

/// Solves for the factors that bring the fit of the total to the statistics `observed`.
///
/// `sample`: the same sky in some of the pixels (all of them for small maps); `whole`: in all.
///
/// # Errors
/// Those of the kernels.
pub fn calibrate(
    sample: &Sky<'_>,
    whole: &Sky<'_>,
    fit: &TotalFit,
    observed: &LawStats,
    progress: &dyn Progress,
) -> Result<Calibration, Error> {
    let start = Factors {
        avg: 0.98,
        t: 1.5,
        beta: 1.5,
    };
    let (mut factors, mut held) = on_sample(sample, fit, observed, start)?;
    let mut jacobian = derivatives(sample, fit, observed, &factors)?;
    let mut best: Option<(f64, Factors, FitStats, bool)> = None;
    for _ in 0..STEPS {
        let stats = whole.fit(fit, &factors)?;
        progress.advance(1);
        let miss = mismatch(&stats.laws, observed);
        if held && miss[2] * (factors.beta - S_BETA_RANGE.0) > 0.0 && factors.beta > S_BETA_RANGE.0
            || held && factors.beta == S_BETA_RANGE.0 && miss[2] < 0.0
        {
            // The whole map has a solution inside the range though the sample has none.
            held = false;
        }
        let size = miss[0]
            .abs()
            .max(miss[1].abs())
            .max(if held { 0.0 } else { miss[2].abs() });
        if best.as_ref().is_none_or(|b| b.3 != held || size < b.0) {
            best = Some((size, factors, stats, held));
        }
        if size < TOLERANCE {
            break;
        }
        let step = solve(&jacobian, &miss, held);
        factors.avg -= step[0];
        factors.t = (factors.t - step[1]).max(0.0);
        if !held {
            let next = factors.beta - step[2];
            factors.beta = next.clamp(S_BETA_RANGE.0, S_BETA_RANGE.1);
            if factors.beta != next {
                held = true;
                jacobian = derivatives(sample, fit, observed, &factors)?;
            }
        }
    }
    let (_, factors, fit, held) = best.unwrap_or((0.0, factors, FitStats::default(), held));
    Ok(Calibration {
        factors,
        status: if held {
            CalibrationStatus::Limit
        } else {
            CalibrationStatus::Solved
        },
        fit,
    })
}

/// Factors for the sample, and whether s_β is held at an end.
fn on_sample(
    sky: &Sky<'_>,
    fit: &TotalFit,
    observed: &LawStats,
    start: Factors,
) -> Result<(Factors, bool), Error> {
    let mut warm = start;
    let beta_excess = |s_beta: f64, warm: &mut Factors| -> Result<f64, Error> {
        warm.beta = s_beta;
        *warm = match_temperature(sky, fit, observed, *warm)?;
        Ok(mismatch(&sky.fit(fit, warm)?.laws, observed)[2])
    };
    let mut points: Vec<(f64, f64)> = Vec::new();
    for s_beta in S_BETA_SCAN {
        let excess = beta_excess(s_beta, &mut warm)?;
        if let Some(&last) = points.last()
            && (last.1 < 0.0) != (excess < 0.0)
        {
            let root = find_root(|s| beta_excess(s, &mut warm), last, (s_beta, excess), 1e-6)?;
            beta_excess(root, &mut warm)?;
            return Ok((warm, false));
        }
        points.push((s_beta, excess));
    }
    let nearer = match points.as_slice() {
        [first, .., last] if last.1.abs() < first.1.abs() => last.0,
        _ => S_BETA_RANGE.0,
    };
    beta_excess(nearer, &mut warm)?;
    Ok((warm, true))
}

/// s_avg and s_T for a given s_β, by Newton steps with finite differences.
fn match_temperature(
    sky: &Sky<'_>,
    fit: &TotalFit,
    observed: &LawStats,
    mut factors: Factors,
) -> Result<Factors, Error> {
    for _ in 0..20 {
        let miss = mismatch(&sky.fit(fit, &factors)?.laws, observed);
        if miss[0].abs().max(miss[1].abs()) < 0.1 * TOLERANCE {
            break;
        }
        let jacobian = derivatives(sky, fit, observed, &factors)?;
        let step = solve(&jacobian, &miss, true);
        factors.avg -= step[0].clamp(-0.1, 0.1);
        factors.t = (factors.t - step[1].clamp(-0.5, 0.5)).max(0.01);
    }
    Ok(factors)
}

/// Relative differences of mean T, spread of T and spread of β from those observed.
fn mismatch(laws: &LawStats, observed: &LawStats) -> [f64; 3] {
    [
        laws.t_mean / observed.t_mean - 1.0,
        laws.t_std / observed.t_std - 1.0,
        laws.beta_std / observed.beta_std - 1.0,
    ]
}

/// ∂ mismatch / ∂ (s_avg, s_T, s_β), row by row.
fn derivatives(
    sky: &Sky<'_>,
    fit: &TotalFit,
    observed: &LawStats,
    at: &Factors,
) -> Result<[[f64; 3]; 3], Error> {
    const H: f64 = 1e-3;
    let shifted = |avg: f64, t: f64, beta: f64| -> Result<[f64; 3], Error> {
        let factors = Factors {
            avg: at.avg + avg,
            t: at.t + t,
            beta: at.beta + beta,
        };
        Ok(mismatch(&sky.fit(fit, &factors)?.laws, observed))
    };
    let mut jacobian = [[0.0; 3]; 3];
    for (column, [a, t, b]) in [[H, 0.0, 0.0], [0.0, H, 0.0], [0.0, 0.0, H]]
        .into_iter()
        .enumerate()
    {
        let (up, down) = (shifted(a, t, b)?, shifted(-a, -t, -b)?);
        for row in 0..3 {
            jacobian[row][column] = (up[row] - down[row]) / (2.0 * H);
        }
    }
    Ok(jacobian)
}

/// J⁻¹ · miss by Cramer's rule, in the first two dimensions if the third is held; zero where J is singular.
fn solve(j: &[[f64; 3]; 3], miss: &[f64; 3], held: bool) -> [f64; 3] {
    let det2 = |a: f64, b: f64, c: f64, d: f64| a * d - b * c;
    let quotient = |x: f64, det: f64| {
        if det == 0.0 || !det.is_finite() {
            0.0
        } else {
            x / det
        }
    };
    if held {
        let det = det2(j[0][0], j[0][1], j[1][0], j[1][1]);
        return [
            quotient(det2(miss[0], j[0][1], miss[1], j[1][1]), det),
            quotient(det2(j[0][0], miss[0], j[1][0], miss[1]), det),
            0.0,
        ];
    }
    let det3 = |m: &[[f64; 3]; 3]| {
        m[0][0] * det2(m[1][1], m[1][2], m[2][1], m[2][2])
            - m[0][1] * det2(m[1][0], m[1][2], m[2][0], m[2][2])
            + m[0][2] * det2(m[1][0], m[1][1], m[2][0], m[2][1])
    };
    let det = det3(j);
    core::array::from_fn(|column| {
        let mut m = *j;
        for row in 0..3 {
            m[row][column] = miss[row];
        }
        quotient(det3(&m), det)
    })
}
