//! What `dust3d run` prints at the end.

use crate::io::Manifest;
use crate::io::manifest::FitStatistics;
use std::fmt::Write;
use std::path::Path;

/// The factors (s_avg, s_T, s_β) of the paper, for Planck's data.
const PAPER_FACTORS: [f64; 3] = [0.982, 1.84, 1.94];

/// Averages, factors, fits, counts and times of a run, as text.
pub(super) fn summary(manifest: &Manifest, dir: &Path) -> String {
    let mut text = String::new();
    head(&mut text, manifest);
    layers(&mut text, manifest);
    fits(&mut text, manifest);
    counts(&mut text, manifest);
    times(&mut text, manifest);
    let dir = dir.display();
    let _ = writeln!(
        text,
        "\n{} files in {dir}; look at {dir}/overview.png, read {dir}/manifest.json",
        manifest.files.len()
    );
    text
}

/// A line per realisation, as text.
pub(super) fn realisations(made: &[Manifest], out: &Path) -> String {
    let mut text = String::new();
    for manifest in made {
        let seconds: f64 = manifest.stages.iter().map(|s| s.seconds).sum();
        let kappa: Vec<String> = manifest
            .small_scales
            .iter()
            .map(|s| format!("{:.3}", s.kappa))
            .collect();
        let _ = writeln!(
            text,
            "seed {:>6}: {seconds:8.2} s, {} files, κ {}",
            manifest.seed.unwrap_or(0),
            manifest.files.len(),
            kappa.join(" ")
        );
    }
    let _ = writeln!(text, "{} realisations in {}", made.len(), out.display());
    text
}

fn head(text: &mut String, manifest: &Manifest) {
    let _ = write!(text, "Nside {}", manifest.nside);
    for (name, value) in [("lmax", manifest.lmax), ("layers", manifest.layers)] {
        if let Some(value) = value {
            let _ = write!(text, ", {name} {value}");
        }
    }
    if let Some(seed) = manifest.seed {
        let _ = write!(text, ", seed {seed}");
    }
    if manifest.synthetic_inputs == Some(true) {
        text.push_str(", built-in synthetic sky");
    }
    text.push('\n');
    if let Some(pitch) = manifest.pitch_deg {
        let given = manifest
            .config
            .as_ref()
            .is_some_and(|config| config.field.pitch_deg.is_some());
        let how = if given {
            "given"
        } else {
            "fitted; the paper finds −33° on Planck data"
        };
        let _ = writeln!(text, "pitch angle {pitch:.2}° ({how})");
    }
}

fn layers(text: &mut String, manifest: &Manifest) {
    let count = manifest.layers.unwrap_or(0);
    let _ = write!(text, "\n{:<26}", "layer");
    for layer in 1..=count {
        let _ = write!(text, "{layer:>9}");
    }
    text.push('\n');
    let mut row = |name: &str, values: &[f64], decimals: usize| {
        let _ = write!(text, "{name:<26}");
        for value in values {
            let _ = write!(text, "{value:>9.decimals$}");
        }
        text.push('\n');
    };
    if let Some(averages) = &manifest.layer_averages {
        row("T averaged (K)", &averages.t, 3);
        row("β averaged", &averages.beta, 4);
    }
    if let Some(laws) = &manifest.laws {
        row("T mean (K)", &laws.t_mean, 3);
        row("T standard deviation (K)", &laws.t_std, 3);
        row("β mean", &laws.beta_mean, 4);
        row("β standard deviation", &laws.beta_std, 4);
    }
    if !manifest.small_scales.is_empty() {
        let column = |get: fn(&crate::io::manifest::SmallScaleRecord) -> f64| -> Vec<f64> {
            manifest.small_scales.iter().map(get).collect()
        };
        row("slope of TT", &column(|record| record.alpha_t), 3);
        row("κ", &column(|record| record.kappa), 4);
    }
}

fn fits(text: &mut String, manifest: &Manifest) {
    let (Some(observed), Some(total)) = (manifest.mbb_fit_observed, manifest.mbb_fit_total) else {
        return;
    };
    let _ = writeln!(
        text,
        "\n{:<26}{:>12}{:>12}",
        "modified blackbody", "observed", "simulated"
    );
    type Get = fn(&FitStatistics) -> f64;
    let rows: [(&str, Get); 4] = [
        ("T mean (K)", |fit| fit.t_mean),
        ("T standard deviation (K)", |fit| fit.t_std),
        ("β mean", |fit| fit.beta_mean),
        ("β standard deviation", |fit| fit.beta_std),
    ];
    for (name, get) in rows {
        let _ = writeln!(
            text,
            "{name:<26}{:>12.4}{:>12.4}",
            get(&observed),
            get(&total)
        );
    }
    if let Some(laws) = &manifest.laws {
        let [avg, t, beta] = PAPER_FACTORS;
        let _ = writeln!(
            text,
            "factors {}: s_avg {:.4} (paper {avg}), s_T {:.4} ({t}), s_β {:.4} ({beta})",
            laws.calibration_status, laws.s_avg, laws.s_t, laws.s_beta
        );
    }
}

fn counts(text: &mut String, manifest: &Manifest) {
    let counts = &manifest.counts;
    let _ = writeln!(text, "\npixels");
    for (what, count) in [
        ("not covered by the cube", counts.missing_cube_pixels),
        ("negative intensity layer", counts.negative_intensity),
        ("polarisation capped", counts.capped_pixels),
        ("cap infeasible", counts.infeasible_pixels),
        ("fit not converged", counts.unconverged_fits),
        ("T or β at its floor", counts.floored_laws),
        ("|(Q, U)| limited to I", counts.limited_pixels),
    ] {
        let _ = writeln!(text, "  {what:<26}{count:>12}");
    }
}

fn times(text: &mut String, manifest: &Manifest) {
    let total: f64 = manifest.stages.iter().map(|stage| stage.seconds).sum();
    let _ = writeln!(text, "\nseconds");
    for stage in &manifest.stages {
        let _ = writeln!(text, "  {:<26}{:>12.2}", stage.name, stage.seconds);
    }
    let _ = write!(text, "  {:<26}{total:>12.2}", "total");
    if let Some(bytes) = manifest.peak_memory_bytes {
        let _ = write!(text, "   (peak memory {:.0} MB)", bytes as f64 / 1e6);
    }
    text.push('\n');
}
