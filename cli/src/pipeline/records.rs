//! What a manifest says of the stages.

use crate::io::manifest::{FitStatistics, LawsRecord, SmallScaleRecord};
use crate::stages::laws::{Calibration, CalibrationStatus, LawStats};
use crate::stages::small_scales::{KappaStatus, LayerReport};
use std::fmt::Write as _;

/// Of a fit.
pub(super) fn fit(laws: &LawStats) -> FitStatistics {
    FitStatistics {
        t_mean: laws.t_mean,
        t_std: laws.t_std,
        beta_mean: laws.beta_mean,
        beta_std: laws.beta_std,
    }
}

/// Of the laws: how they were calibrated, and mean and standard deviation per layer.
pub(super) fn laws(calibration: &Calibration, t: &[(f64, f64)], beta: &[(f64, f64)]) -> LawsRecord {
    let (t_mean, t_std) = t.iter().copied().unzip();
    let (beta_mean, beta_std) = beta.iter().copied().unzip();
    LawsRecord {
        s_avg: calibration.factors.avg,
        s_t: calibration.factors.t,
        s_beta: calibration.factors.beta,
        calibration_status: match calibration.status {
            CalibrationStatus::Solved => "solved",
            CalibrationStatus::Limit => "limit",
            CalibrationStatus::Given => "given",
        }
        .to_owned(),
        t_mean,
        t_std,
        beta_mean,
        beta_std,
    }
}

/// Of a layer's small scales.
pub(super) fn small_scales(report: &LayerReport) -> SmallScaleRecord {
    SmallScaleRecord {
        alpha_t: report.tt.slope,
        a_t: report.tt.amplitude,
        a_ee: report.a_ee,
        a_bb: report.a_bb,
        kappa: report.kappa,
        kappa_status: match report.kappa_status {
            KappaStatus::Root => "root",
            KappaStatus::Enough => "enough",
            KappaStatus::Limit => "limit",
        }
        .to_owned(),
    }
}

/// Spectra of a layer before and after small scales, a line per l.
pub(super) fn spectra_csv(report: &LayerReport) -> String {
    let mut csv = String::from("l,TT_observed,EE_observed,BB_observed,TE_observed,TT,EE,BB,TE\n");
    for l in 0..report.before.tt.len() {
        let _ = write!(csv, "{l}");
        for spectra in [&report.before, &report.after] {
            for c in [&spectra.tt, &spectra.ee, &spectra.bb, &spectra.te] {
                let _ = write!(csv, ",{:e}", c[l]);
            }
        }
        csv.push('\n');
    }
    csv
}

/// Most memory the process has had resident, where the system tells.
pub(super) fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}
