//! What must hold of every run, whatever its data: sums, bounds, signs.

use super::figure::{Check, decimal, power};
use super::layers::KEEP_ALL;
use super::models::LOW_L;
use super::numbers::{correlation, mean_over_l};
use super::source::Source;
use crate::config::Dtype;
use crate::error::Result;

/// Rounding allowed in sums over layers.
const SUM: f64 = 1e-12;

/// All invariants.
pub(super) fn checks(source: &Source<'_>) -> Result<Vec<Check>> {
    let mut checks = vec![intensity_sum(source)?];
    checks.extend(polarisation(source)?);
    checks.extend(templates(source)?);
    checks.push(large_scales(source)?);
    Ok(checks)
}

fn not_kept(id: &'static str, demand: &str, what: &str, figure: &'static str) -> Check {
    Check::not_available(
        id,
        demand,
        format!("the run did not keep {what}; {KEEP_ALL}"),
        figure,
    )
}

fn intensity_sum(source: &Source<'_>) -> Result<Check> {
    let (id, demand) = (
        "intensity_sum",
        "intensity layers add up to the observed intensity (relative 10⁻¹²) and none is negative",
    );
    if !source.kept("intensity/I") {
        return Ok(not_kept(id, demand, "the intensity layers", "predicted"));
    }
    let layers = source.maps("intensity/I")?;
    let (mut worst, mut least) = (0.0_f64, f64::INFINITY);
    for (p, observed) in source.observed[0].iter().enumerate() {
        let sum: f64 = layers.iter().map(|map| map[p]).sum();
        least = layers.iter().fold(least, |least, map| least.min(map[p]));
        let scale = observed.abs().max(f64::MIN_POSITIVE);
        worst = worst.max((sum - observed).abs() / scale);
    }
    Ok(Check::new(
        id,
        demand,
        worst <= SUM && least >= 0.0,
        format!(
            "largest relative difference {}, least value {} MJy/sr",
            power(worst, 1),
            decimal(least, 3)
        ),
        "predicted",
    )
    .with("largest_relative_difference", worst)
    .with("least", least))
}

/// The sums of Q and U and the cap, before small scales.
fn polarisation(source: &Source<'_>) -> Result<[Check; 2]> {
    let sum = (
        "polarisation_sum",
        "renormalised Q and U add up to the observed ones (10⁻¹² of the layers' polarised intensity)",
    );
    let p_max = source.config.polarisation.p_max;
    let cap = (
        "polarisation_cap",
        format!(
            "polarisation fraction of every renormalised layer ≤ p_max = {p_max} wherever the observation allows it"
        ),
    );
    if !["intensity/I", "renormalised/Q", "renormalised/U"]
        .iter()
        .all(|stem| source.kept(stem))
    {
        return Ok([
            not_kept(sum.0, sum.1, "the renormalised layers", "renormalised"),
            not_kept(
                cap.0,
                &cap.1,
                "the renormalised layers",
                "polarisation-fraction",
            ),
        ]);
    }
    let (i, q, u) = (
        source.maps("intensity/I")?,
        source.maps("renormalised/Q")?,
        source.maps("renormalised/U")?,
    );
    let (mut worst, mut most, mut infeasible) = (0.0_f64, 0.0_f64, 0_u64);
    for p in 0..source.plan.npix() {
        let (mut sq, mut su, mut size, mut total) = (0.0, 0.0, 0.0, 0.0);
        for layer in 0..source.layers {
            sq += q[layer][p];
            su += u[layer][p];
            size += q[layer][p].hypot(u[layer][p]);
            total += i[layer][p];
        }
        let (oq, ou) = (source.observed[1][p], source.observed[2][p]);
        let scale = oq.hypot(ou).max(size).max(f64::MIN_POSITIVE);
        worst = worst.max((sq - oq).hypot(su - ou) / scale);
        if oq.hypot(ou) > p_max * total {
            infeasible += 1;
            continue;
        }
        for layer in 0..source.layers {
            let (v, c) = (q[layer][p].hypot(u[layer][p]), p_max * i[layer][p]);
            if c > 0.0 {
                most = most.max(v / c);
            } else if v > 0.0 {
                most = f64::INFINITY;
            }
        }
    }
    Ok([
        Check::new(sum.0, sum.1, worst <= SUM, format!("largest difference {}", power(worst, 1)), "renormalised")
            .with("largest_difference", worst),
        Check::new(
            cap.0,
            cap.1,
            most <= 1.0 + SUM,
            format!("largest fraction {} p_max; in {infeasible} pixels the observation itself exceeds p_max", decimal(most, 6)),
            "polarisation-fraction",
        )
        .with("largest_over_p_max", if most.is_finite() { most } else { f64::MAX })
        .with("infeasible_pixels", infeasible),
    ])
}

/// Positivity and physical limit of the templates.
fn templates(source: &Source<'_>) -> Result<[Check; 2]> {
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    for number in 1..=source.layers {
        let (i, q, u) = (
            source.map(&format!("templates/I_{number}"))?,
            source.map(&format!("templates/Q_{number}"))?,
            source.map(&format!("templates/U_{number}"))?,
        );
        for ((i, q), u) in i.iter().zip(&q).zip(&u) {
            least = least.min(*i);
            let p = q.hypot(*u);
            if *i > 0.0 {
                most = most.max(p / i);
            } else if p > 0.0 {
                most = f64::INFINITY;
            }
        }
    }
    let positive = Check::new(
        "positivity",
        "no negative intensity in any template",
        least >= 0.0,
        format!("least value {} MJy/sr", decimal(least, 3)),
        "templates",
    )
    .with("least", least);
    let demand = "polarised intensity of every template ≤ its intensity";
    let scales = &source.config.small_scales;
    let physical = if scales.enabled && !scales.physical_limit {
        Check::not_available(
            "physical_limit",
            demand,
            "switched off by small_scales.physical_limit = false",
            "polarisation-fraction",
        )
    } else {
        // Rounding of the file's numbers is no violation.
        let rounding = if source.config.output.dtype == Dtype::F32 {
            1e-6
        } else {
            1e-12
        };
        Check::new(
            "physical_limit",
            demand,
            most <= 1.0 + rounding,
            format!("largest P/I {}", decimal(most, 6)),
            "polarisation-fraction",
        )
        .with(
            "largest_fraction",
            if most.is_finite() { most } else { f64::MAX },
        )
    };
    Ok([positive, physical])
}

/// The sum of the templates and the observation, at low l.
fn large_scales(source: &Source<'_>) -> Result<Check> {
    let lmax = source.lmax;
    let (o, s, x) = (
        source.observed_alm.spectra(lmax)?,
        source.total_alm.spectra(lmax)?,
        source.observed_alm.cross(&source.total_alm, lmax)?,
    );
    let low = [
        correlation(&x.tt, &o.tt, &s.tt),
        correlation(&x.ee, &o.ee, &s.ee),
        correlation(&x.bb, &o.bb, &s.bb),
    ]
    .map(|r| mean_over_l(&r, |l| LOW_L.contains(&l)));
    Ok(Check::new(
        "large_scales",
        "on large scales the total is the observation (correlation at 353 GHz over 2 ≤ l ≤ 30 at least 0.95 in T, E and B: random scales set in at l ≈ 30)",
        low.iter().all(|r| *r >= 0.95),
        format!("T {}, E {}, B {}", decimal(low[0], 4), decimal(low[1], 4), decimal(low[2], 4)),
        "total-spectra",
    )
    .with("T", low[0])
    .with("E", low[1])
    .with("B", low[2]))
}
