//! `dust3d run`.

use super::session::Session;
use super::{print, summary};
use crate::config::{Config, Draft, Preset, parse_frequency};
use crate::error::Result;
use crate::io::{Inputs, Manifest, RunDir};
use crate::kernels::simd::Level;
use crate::pipeline::{self, Options, Prepared};
use crate::progress::Progress;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde_json::Value;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  dust3d run --out demo\n  dust3d run planck.toml --out sky --nside 256 --seed 7 --freq 95,150\n  dust3d run --out plain --set small_scales.enabled=false\n  dust3d run planck.toml --out skies --realisations 10..19\n  dust3d run --preset planck-gnilc --out planck --seed 3"
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
    /// One run per seed, in OUT/seed0010 …: 10..19 (both included), or a list; the built-in sky keeps --seed
    #[arg(long, value_name = "SEEDS", value_parser = seeds)]
    realisations: Option<Seeds>,
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
    let made = session.on_threads(config.threads, || match &args.realisations {
        Some(seeds) => realisations(args, &config, seeds, session.level, progress.as_ref()),
        None => one(args, &config, session.level, progress.as_ref()).map(|m| vec![m]),
    })?;
    if session.is_quiet() {
        return Ok(());
    }
    match (made.as_slice(), &args.realisations) {
        ([manifest], None) => print(&summary::summary(manifest, &args.out)),
        _ => print(&summary::realisations(&made, &args.out)),
    }
}

fn one(args: &Args, config: &Config, level: Level, progress: &dyn Progress) -> Result<Manifest> {
    // The directory first: whether it may be made is known at once, and it goes again if the inputs are bad.
    let out = RunDir::create(&args.out, args.force)?;
    let inputs = read_inputs(args, config, progress)?;
    let manifest = pipeline::run(config, inputs, &out, level, progress)?;
    progress.finish();
    out.finish(manifest)
}

/// One directory per seed; what no draw enters is made once.
fn realisations(
    args: &Args,
    config: &Config,
    seeds: &Seeds,
    level: Level,
    progress: &dyn Progress,
) -> Result<Vec<Manifest>> {
    let dir = |seed: u64| args.out.join(seeds.name(seed));
    for &seed in &seeds.0 {
        RunDir::check(&dir(seed), args.force)?;
    }
    let options = Options {
        level,
        reuse: true,
        ..Options::default()
    };
    let mut prepared: Option<Prepared> = None;
    let mut made = Vec::new();
    for (k, &seed) in seeds.0.iter().enumerate() {
        let out = RunDir::create(&dir(seed), args.force)?;
        progress.note(&format!(
            "realisation {} of {}: seed {seed}",
            k + 1,
            seeds.0.len()
        ));
        let base = match &mut prepared {
            Some(base) => base,
            None => {
                let inputs = read_inputs(args, config, progress)?;
                prepared.insert(pipeline::prepare(config, inputs, &out, &options, progress)?)
            }
        };
        let manifest = base.realise(seed, &out, progress)?;
        made.push(out.finish(manifest)?);
    }
    progress.finish();
    Ok(made)
}

/// The observations, none for the built-in sky.
fn read_inputs(args: &Args, config: &Config, progress: &dyn Progress) -> Result<Option<Inputs>> {
    if config.inputs.is_built_in() {
        return Ok(None);
    }
    progress.stage("reading the inputs", 1);
    let inputs = Inputs::read(config).map_err(|error| match args.preset {
        Some(preset) => error.with_remedy(format_args!(
            "`dust3d config --preset {}` says where its files come from",
            preset.name()
        )),
        None => error,
    })?;
    for note in inputs.notes() {
        progress.note(note);
    }
    Ok(Some(inputs))
}

/// Seeds of realisations, in order, each once.
#[derive(Debug, Clone)]
struct Seeds(Vec<u64>);

/// More directories than this are a slip of the hand.
const MOST_REALISATIONS: usize = 10_000;

impl Seeds {
    /// `seed0007`: as wide as the largest, four digits at least.
    fn name(&self, seed: u64) -> String {
        let widest = self.0.iter().max().map_or(0, |s| s.to_string().len());
        format!("seed{seed:0width$}", width = widest.max(4))
    }
}

/// For clap: `10..19` (both included), `3`, or a list of these.
fn seeds(text: &str) -> std::result::Result<Seeds, String> {
    let wanted = "seeds are needed, such as 10..19 (both included) or 1,5,9";
    let mut all = Vec::new();
    for part in text.split(',') {
        let number = |s: &str| s.trim().parse::<u64>().map_err(|_| wanted.to_owned());
        let (first, last) = match part.split_once("..") {
            Some((a, b)) => (number(a)?, number(b.trim_start_matches('='))?),
            None => (number(part)?, number(part)?),
        };
        if last < first || last - first >= MOST_REALISATIONS as u64 {
            return Err(format!(
                "{first}..{last} is empty or more than {MOST_REALISATIONS} seeds"
            ));
        }
        all.extend(first..=last);
    }
    let mut seen = std::collections::HashSet::new();
    all.retain(|seed| seen.insert(*seed));
    if all.len() > MOST_REALISATIONS {
        return Err(format!(
            "at most {MOST_REALISATIONS} realisations in one run"
        ));
    }
    Ok(Seeds(all))
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
