//! `dust3d run`.

use super::session::Session;
use super::{print, summary};
use crate::config::{Config, Draft, Preset, parse_frequency};
use crate::error::Result;
use crate::io::{Inputs, RunDir};
use crate::pipeline;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde_json::Value;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  dust3d run --out demo\n  dust3d run planck.toml --out sky --nside 256 --seed 7 --freq 95,150\n  dust3d run --out plain --set small_scales.enabled=false\n  dust3d run --preset planck-gnilc --out planck --seed 3"
)]
pub(super) struct Args {
    /// Configuration (`dust3d config` prints the default one); none = the built-in sky
    #[arg(value_name = "CONFIG.toml")]
    config: Option<PathBuf>,
    /// Begin with the values of a preset (`dust3d config --preset NAME` prints them)
    #[arg(long, value_name = "NAME", value_parser = preset())]
    preset: Option<Preset>,
    /// Directory to make
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace the directory if it is an earlier run
    #[arg(long)]
    force: bool,
    /// Working resolution, a power of two [key nside]
    #[arg(long, value_name = "N")]
    nside: Option<u32>,
    /// Band limit, at most 4 nside [key lmax]
    #[arg(long, value_name = "L")]
    lmax: Option<u64>,
    /// Seed of all random draws [key seed]
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// Frequencies of the emission maps, GHz (or a wavelength: 100um) [key frequencies]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = frequency)]
    freq: Option<Vec<f64>>,
    /// Which stages to keep [key output.keep]
    #[arg(long, value_parser = ["all", "final"])]
    keep: Option<String>,
    /// Override any key of the configuration
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl Args {
    fn resolve(&self) -> Result<Config> {
        let mut draft = Draft::new();
        if let Some(preset) = self.preset {
            draft = draft.toml(preset.toml(), Path::new(""))?;
        }
        if let Some(path) = &self.config {
            draft = draft.file(path)?;
        }
        for assignment in &self.set {
            draft = draft.set(assignment)?;
        }
        let flags = [
            ("nside", self.nside.map(Value::from)),
            ("lmax", self.lmax.map(Value::from)),
            ("seed", self.seed.map(Value::from)),
            ("frequencies", self.freq.clone().map(Value::from)),
            ("output.keep", self.keep.clone().map(Value::from)),
        ];
        for (key, value) in flags {
            if let Some(value) = value {
                draft = draft.put(key, value)?;
            }
        }
        draft.finish()
    }
}

pub(super) fn execute(args: &Args, session: &Session) -> Result<()> {
    let config = args.resolve()?;
    let progress = session.progress();
    let manifest = session.on_threads(config.threads, || {
        // The directory first: whether it may be made is known at once, and it goes again if the inputs are bad.
        let out = RunDir::create(&args.out, args.force)?;
        let inputs = if config.inputs.is_built_in() {
            None
        } else {
            progress.stage("reading the inputs", 1);
            let inputs = Inputs::read(&config).map_err(|error| match args.preset {
                Some(preset) => error.with_remedy(format_args!(
                    "`dust3d config --preset {}` says where its files come from",
                    preset.name()
                )),
                None => error,
            })?;
            for note in inputs.notes() {
                progress.note(note);
            }
            Some(inputs)
        };
        let manifest = pipeline::run(&config, inputs, &out, session.level, progress.as_ref())?;
        progress.finish();
        out.finish(manifest)
    })?;
    if session.is_quiet() {
        return Ok(());
    }
    print(&summary::summary(&manifest, &args.out))
}

/// For clap: the name of a preset.
pub(super) fn preset() -> impl TypedValueParser<Value = Preset> {
    PossibleValuesParser::new(Preset::ALL.map(Preset::name))
        .try_map(|name| Preset::by_name(&name).ok_or("no such preset"))
}

/// For clap: a frequency in GHz, or a wavelength such as `100um`.
pub(super) fn frequency(text: &str) -> std::result::Result<f64, String> {
    parse_frequency(text)
        .ok_or_else(|| "a frequency in GHz is needed, or a wavelength such as 100um".to_owned())
}
