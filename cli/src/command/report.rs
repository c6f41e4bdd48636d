//! `dust3d report`.

use super::map::mask;
use super::print;
use super::session::Session;
use crate::error::{Error, ErrorKind, Result};
use crate::io::{Manifest, Run, RunDir};
use crate::report::{self, Options, Status};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  dust3d report demo\n  dust3d report sky-42 --against sky-43 --force\n  dust3d report sky-42 --check --quiet || echo not good\n\nThe report is a page that needs nothing else (index.html), a PNG per figure, the numbers as CSV, and summary.json. With\n--check the exit status is 3 if a requirement of the paper or an invariant of the model fails."
)]
pub(super) struct Args {
    /// Directory of a finished run
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// Set this run beside it
    #[arg(long, value_name = "RUN2")]
    against: Option<PathBuf>,
    /// Exit with status 3 if a check fails
    #[arg(long)]
    check: bool,
    /// Replace an earlier report
    #[arg(long)]
    force: bool,
    /// Directory to make [default: RUN/report]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Percentages of the sky for the spectra of the layers, besides the whole
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "75,25", value_parser = percent)]
    sky: Vec<f64>,
    /// Weights (0 to 1, on the run's grid) of the sky on which maps are correlated [default: its faintest 70 %]
    #[arg(long, value_name = "MAP")]
    mask: Option<String>,
    /// Width of the edges of masks made from the intensity, degrees
    #[arg(long, value_name = "DEG", default_value_t = 2.0)]
    apodise: f64,
    /// Add spectra with the coupling by the mask undone (MASTER), in bands of so many multipoles
    #[arg(long, value_name = "WIDTH", num_args = 0..=1, default_missing_value = "16", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    master: Option<u32>,
}

pub(super) fn execute(args: &Args, session: &Session) -> Result<()> {
    if !(0.0..=30.0).contains(&args.apodise) {
        return Err(Error::usage(format!(
            "--apodise {} is not possible; give degrees from 0 to 30",
            args.apodise
        )));
    }
    let run = Run::open(&args.run)?;
    let against = args.against.as_deref().map(Run::open).transpose()?;
    let options = Options {
        sky_percent: args.sky.clone(),
        apodise_deg: args.apodise,
        mask: args
            .mask
            .as_deref()
            .map(|spec| mask::read(spec, run.manifest.nside))
            .transpose()?,
        master_band: args.master.map(|width| width as usize),
        ..Options::default()
    };
    let target = args.out.clone().unwrap_or_else(|| args.run.join("report"));
    let progress = session.progress();
    let summary = session.on_threads(0, || {
        let out = RunDir::create(&target, args.force)?;
        let summary = report::write(
            &run,
            against.as_ref(),
            &options,
            &out,
            session.level,
            progress.as_ref(),
        )?;
        progress.finish();
        let mut manifest = Manifest::new("report", run.manifest.nside);
        session.level.name().clone_into(&mut manifest.simd);
        manifest.seed = run.manifest.seed;
        manifest.lmax = run.manifest.lmax;
        manifest.layers = run.manifest.layers;
        out.finish(manifest)?;
        Ok(summary)
    })?;
    let failed: Vec<&str> = summary
        .checks
        .iter()
        .filter(|check| check.status == Status::Fail)
        .map(|check| check.id)
        .collect();
    if !session.is_quiet() {
        let mut text = String::new();
        for check in &summary.checks {
            let word = match check.status {
                Status::Pass => "pass",
                Status::Fail => "FAIL",
                Status::NotAvailable => "–",
            };
            text.push_str(&format!("{word:<5} {:<18} {}\n", check.id, check.found));
        }
        print(&format!(
            "{text}\n{} Open {}\n",
            report::outcome(&summary),
            target.join("index.html").display()
        ))?;
    }
    if args.check && !failed.is_empty() {
        return Err(Error::new(
            ErrorKind::Verdict,
            format!(
                "the run does not hold what it should ({}); see {}",
                failed.join(", "),
                target.join("index.html").display()
            ),
        ));
    }
    Ok(())
}

fn percent(text: &str) -> std::result::Result<f64, String> {
    text.trim()
        .parse()
        .ok()
        .filter(|percent| (1.0..=100.0).contains(percent))
        .ok_or_else(|| "a percentage of the sky from 1 to 100 is needed".to_owned())
}
