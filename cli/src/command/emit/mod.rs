//! `dust3d emit`: frequency maps from finished runs.
//!
//! The run is read slab by slab. Raw maps that need no harmonic coefficients are written as they come, in one pass for
//! all bands; else all bands of a pass are added up in memory.

mod bands;
mod harmonics;

use super::print;
use super::run::frequency;
use super::session::Session;
use crate::config::Dtype;
use crate::error::{Error, Result};
use crate::io::fits::Frame;
use crate::io::fits::write::{MapColumn, MapTable, Provenance};
use crate::io::manifest::{InputRecord, MANIFEST};
use crate::io::output::MapWriter;
use crate::io::{Manifest, MapFormat, Run, RunDir};
use crate::kernels::planck::mbb::MbbNode;
use crate::kernels::units::Unit;
use crate::progress::Progress;
use crate::replay;
use crate::stages::emission::{Model, Stokes};
use crate::store::slabs;
use bands::Band;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use harmonics::{Harmonics, Made};
use std::collections::HashMap;
use std::path::PathBuf;

/// Memory for the maps of one pass, bytes; more bands than fit take more passes over the run.
const PASS_BYTES: usize = 1 << 30;

const AFTER_HELP: &str = "\
Examples:
  dust3d emit demo --freq 95,150 --unit uK_CMB --out maps
  dust3d emit demo --freq 143 --bandpass hfi143.txt --unit uK_CMB --beam 7.2 --out maps
  dust3d emit demo --band 95 --band 'F143=HFI_RIMO.fits[BANDPASS_F143]' --beam 30,7.2 --coord C --format fits --out maps
  dust3d emit sky-1 sky-2 sky-3 --freq 353 --stokes QU --out maps

Units: MJy/sr, Jy/sr, K_RJ, mK_RJ, uK_RJ, K_CMB, mK_CMB, uK_CMB. A bandpass is a text file of two columns, GHz and weight
(response to power, as PySM3 takes it), or a table of a FITS file with columns WAVENUMBER (1/cm, unless TUNIT says
otherwise) and TRANSMISSION, as in Planck's reduced instrument models.

Files are called <model>_<band>_<I|Q|U>; in FITS, <model>_<band>.fits; with the seed, <model>_<band>_seed0007.
Another --nside, --beam and --coord go through harmonic coefficients up to --lmax, found as healpy's map2alm(iter=3)
finds them; without any of these, maps are not touched. The beam is exp(-l(l+1) sigma^2/2) for T, E and B alike, where healpy's
smoothing has exp(2 sigma^2) more for E and B.";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Directories of finished runs, or of realisations; of several runs, the seed is put in the names
    #[arg(value_name = "RUN", required = true)]
    runs: Vec<PathBuf>,
    /// Frequencies, GHz (or a wavelength: 100um); with as many --bandpass, they name the bands
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = frequency, required_unless_present_any = ["bandpass", "band"])]
    freq: Vec<f64>,
    /// Integrate over these bandpasses (files, separated by commas, or the option several times)
    #[arg(long, value_name = "FILE")]
    bandpass: Vec<String>,
    /// One more band: a frequency or a bandpass, with a name if you like (the option may be repeated)
    #[arg(long, value_name = "[NAME=]NU|FILE")]
    band: Vec<String>,
    /// Unit of the maps
    #[arg(long, default_value = "MJy/sr", value_parser = unit)]
    unit: Unit,
    /// Emission laws: maps of T and β per layer, one T and β per layer, or the observed T and β for the sum
    #[arg(long, default_value = "3d", value_parser = model())]
    model: Model,
    /// Stokes parameters to write
    #[arg(long, default_value = "IQU", value_parser = ["I", "QU", "IQU"])]
    stokes: String,
    /// Resolution of the maps, resampled through harmonic coefficients [default: that of the run]
    #[arg(long, value_name = "N")]
    nside: Option<u32>,
    /// Smooth with a Gaussian beam, FWHM in arcmin: one for all bands, or one for each (0 = none)
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        allow_negative_numbers = true
    )]
    beam: Vec<f64>,
    /// Coordinates of the maps: Galactic, equatorial (J2000) or ecliptic; Q and U are turned too
    #[arg(long, default_value = "G", value_parser = coordinates())]
    coord: Frame,
    /// Band limit of the harmonic coefficients [default: twice the smaller Nside]
    #[arg(long, value_name = "L")]
    lmax: Option<usize>,
    /// Write harmonic coefficients (T, E, B) in place of maps: .c128, .npy, or one FITS file a band
    #[arg(long)]
    alm: bool,
    /// Put the seed of the run in the names
    #[arg(long)]
    seed_names: bool,
    /// Format of the maps; in FITS, I, Q and U of a band share a file
    #[arg(long, default_value = "raw", value_parser = ["raw", "fits", "npy"])]
    format: String,
    /// Element type of the maps [default: that of the run's templates]
    #[arg(long, value_parser = ["f32", "f64"])]
    dtype: Option<String>,
    /// Directory to make
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace the directory if this program made it
    #[arg(long)]
    force: bool,
}

pub(super) fn execute(args: &Args, session: &Session) -> Result<()> {
    let bands = bands::bands(args)?;
    let runs = open(&args.runs)?;
    let seeds = args.seed_names || runs.len() > 1;
    if seeds {
        check_seeds(&runs)?;
    }
    let mut harmonics = runs
        .iter()
        .map(|run| Harmonics::of(args, run, session.level))
        .collect::<Result<Vec<_>>>()?;
    let nside = common_nside(&runs, &harmonics)?;
    let transformed = |harmonics: &Harmonics| {
        let mut bands = bands.iter();
        bands.any(|band| harmonics.is_needed(band.fwhm_rad))
    };
    let progress = session.progress();
    let manifest = session.on_threads(0, || {
        let out = RunDir::create(&args.out, args.force)?;
        let mut inputs = Vec::new();
        let ways: Vec<Pass> = runs
            .iter()
            .zip(&harmonics)
            .map(|(run, harmonics)| match format(args, run) {
                MapFormat::Raw(_) if !transformed(harmonics) => Pass::Streamed,
                _ => Pass::Whole(per_pass(run)),
            })
            .collect();
        let passes = |pass: &Pass| match *pass {
            Pass::Streamed => 1,
            Pass::Whole(count) => bands.len().div_ceil(count),
        };
        let steps = runs.iter().zip(&ways);
        let steps = steps.map(|(run, pass)| passes(pass) * slabs(run.npix()).count());
        progress.stage("emission", steps.sum::<usize>() as u64);
        for ((run, harmonics), pass) in runs.iter().zip(&mut harmonics).zip(ways) {
            let suffix = match run.manifest.seed {
                Some(seed) if seeds => format!("_seed{seed:04}"),
                _ => String::new(),
            };
            let writer = Writer {
                args,
                out: &out,
                format: format(args, run),
                run,
                suffix,
            };
            let mut read = Vec::new();
            match pass {
                Pass::Streamed => writer.stream(&bands, session, progress.as_ref(), &mut read)?,
                Pass::Whole(count) => {
                    for bands in bands.chunks(count) {
                        read.clear();
                        let step = || progress.advance(1);
                        let (model, level) = (args.model, session.level);
                        let maps =
                            replay::emission(run, model, &nodes(bands), level, &mut read, step)?;
                        for (band, stokes) in bands.iter().zip(maps) {
                            let made = harmonics.apply(stokes, &args.stokes, band.fwhm_rad)?;
                            writer.write(band, &made, harmonics.lmax)?;
                        }
                    }
                }
            }
            inputs.append(&mut read);
        }
        progress.finish();
        let mut manifest = Manifest::new("emit", nside);
        session.level.name().clone_into(&mut manifest.simd);
        if let [run] = runs.as_slice() {
            manifest.config.clone_from(&run.manifest.config);
            manifest.seed = run.manifest.seed;
            manifest.layers = run.manifest.layers;
        }
        manifest.lmax = transformed(&harmonics[0]).then_some(harmonics[0].lmax);
        manifest.coordinates = args.coord.name().to_ascii_uppercase();
        manifest.inputs = inputs;
        out.finish(manifest)
    })?;
    if session.is_quiet() {
        return Ok(());
    }
    print(&format!(
        "{} {} in {}\n",
        manifest.files.len(),
        if args.format == "raw" && !args.alm {
            "maps"
        } else {
            "files"
        },
        args.out.display()
    ))
}

/// The runs of `dirs`; a directory without a manifest stands for the runs in it, by name.
fn open(dirs: &[PathBuf]) -> Result<Vec<Run>> {
    let mut runs = Vec::new();
    for dir in dirs {
        let mut inside: Vec<PathBuf> = Vec::new();
        if !dir.join(MANIFEST).exists()
            && let Ok(entries) = std::fs::read_dir(dir)
        {
            let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
            inside.extend(paths.filter(|path| path.join(MANIFEST).exists()));
        }
        if inside.is_empty() {
            // Whatever is wrong with it, this says so.
            inside.push(dir.clone());
        }
        inside.sort();
        for dir in inside {
            runs.push(Run::open(&dir)?);
        }
    }
    Ok(runs)
}

/// How the maps of a run are made.
#[derive(Clone, Copy)]
enum Pass {
    /// All bands in one pass, written as they come.
    Streamed,
    /// Whole maps of so many bands at a time.
    Whole(usize),
}

/// How many bands fit in memory at once.
fn per_pass(run: &Run) -> usize {
    let npix = 12 * (run.manifest.nside as usize).pow(2);
    (PASS_BYTES / (3 * npix * size_of::<f64>())).max(1)
}

/// Names with seeds are different only if the seeds are.
fn check_seeds(runs: &[Run]) -> Result<()> {
    let mut seen: HashMap<u64, &Run> = HashMap::new();
    for run in runs {
        let Some(seed) = run.manifest.seed else {
            continue;
        };
        if let Some(other) = seen.insert(seed, run) {
            return Err(Error::usage(format!(
                "`{}` and `{}` both have the seed {seed}, so that their maps would have the same names; emit them into directories of their own",
                other.dir.display(),
                run.dir.display()
            )));
        }
    }
    Ok(())
}

/// The Nside of all maps.
fn common_nside(runs: &[Run], harmonics: &[Harmonics]) -> Result<u32> {
    let nside = harmonics[0].to;
    match runs.iter().zip(harmonics).find(|(_, h)| h.to != nside) {
        None => Ok(nside),
        Some((run, h)) => Err(Error::usage(format!(
            "`{}` has Nside {nside} and `{}` has {}; choose one for all maps with --nside",
            runs[0].dir.display(),
            run.dir.display(),
            h.to
        ))),
    }
}

/// The element type asked for, or that of the templates of `run`.
pub(super) fn dtype(asked: Option<&str>, run: &Run) -> Dtype {
    match asked {
        Some("f32") => Dtype::F32,
        Some(_) => Dtype::F64,
        None => run
            .manifest
            .config
            .as_ref()
            .map_or(Dtype::F64, |config| config.output.dtype),
    }
}

fn format(args: &Args, run: &Run) -> MapFormat {
    let dtype = dtype(args.dtype.as_deref(), run);
    match args.format.as_str() {
        "fits" => MapFormat::Fits(dtype),
        "npy" => MapFormat::Npy(dtype),
        _ => MapFormat::Raw(dtype),
    }
}

fn nodes(bands: &[Band]) -> Vec<Vec<MbbNode>> {
    bands.iter().map(|band| band.nodes.clone()).collect()
}

/// Writes what was made of a run.
struct Writer<'a> {
    args: &'a Args,
    out: &'a RunDir,
    format: MapFormat,
    run: &'a Run,
    suffix: String,
}

impl Writer<'_> {
    fn stem(&self, band: &Band) -> String {
        format!("{}_{}{}", self.args.model.name(), band.name, self.suffix)
    }

    /// Raw maps as they come from the run.
    fn stream(
        &self,
        bands: &[Band],
        session: &Session,
        progress: &dyn Progress,
        inputs: &mut Vec<InputRecord>,
    ) -> Result<()> {
        let model = self.args.model;
        let wanted: Vec<usize> = (0..3)
            .filter(|&k| self.args.stokes.contains(["I", "Q", "U"][k]))
            .collect();
        let mut files = Vec::new();
        for band in bands {
            for &k in &wanted {
                let stokes = ["I", "Q", "U"][k];
                files.push(self.out.begin_map(
                    &format!("{}_{stokes}", self.stem(band)),
                    &format!("{stokes} of {}, model {}", band.name, model.name()),
                    self.args.unit.name(),
                    self.run.manifest.nside,
                    self.format.dtype(),
                )?);
            }
        }
        let step = || progress.advance(1);
        let take = |slab: &[Stokes]| {
            let mut files = files.iter_mut();
            for stokes in slab {
                for (&k, file) in wanted.iter().zip(&mut files) {
                    file.append(&stokes[k])?;
                }
            }
            Ok(())
        };
        replay::each_slab(
            self.run,
            model,
            &nodes(bands),
            session.level,
            inputs,
            step,
            take,
        )?;
        files.into_iter().try_for_each(MapWriter::finish)
    }

    fn write(&self, band: &Band, made: &Made, lmax: usize) -> Result<()> {
        let stem = self.stem(band);
        let mut what = format!("{}, model {}", band.name, self.args.model.name());
        if band.fwhm_rad > 0.0 {
            // To a millionth of an arcmin, so that what was asked for is what is written.
            let arcmin = (band.fwhm_rad.to_degrees() * 60e6).round() / 1e6;
            what += &format!(", beam of {arcmin} arcmin");
        }
        if self.args.coord != Frame::Galactic {
            what += &format!(", {} coordinates", self.args.coord.name());
        }
        let provenance = Provenance {
            frequency_ghz: band.ghz,
            frame: self.args.coord,
            ..Provenance::of_run(&self.run.manifest)
        };
        let unit = self.args.unit.name();
        match made {
            Made::Maps(maps) => {
                let columns: Vec<MapColumn<'_>> = maps
                    .iter()
                    .map(|(name, values)| MapColumn { name, unit, values })
                    .collect();
                let table = MapTable {
                    columns: &columns,
                    nested: false,
                    provenance: &provenance,
                };
                self.out.maps(&stem, &what, self.format, &table)
            }
            Made::Coefficients(alms) => {
                let fields: Vec<_> = alms
                    .iter()
                    .map(|(name, values)| (*name, values.as_slice()))
                    .collect();
                self.out
                    .coefficients(&stem, &what, self.format, &fields, lmax, unit, &provenance)
            }
        }
    }
}

fn unit(text: &str) -> std::result::Result<Unit, String> {
    text.parse().map_err(|_| {
        let names: Vec<&str> = Unit::ALL.into_iter().map(Unit::name).collect();
        format!("the units are {}", names.join(", "))
    })
}

pub(super) fn model() -> impl TypedValueParser<Value = Model> {
    PossibleValuesParser::new(Model::ALL.map(Model::name)).try_map(|name| {
        let found = Model::ALL.into_iter().find(|model| model.name() == name);
        found.ok_or("no such model")
    })
}

fn coordinates() -> impl TypedValueParser<Value = Frame> {
    PossibleValuesParser::new(["G", "C", "E"])
        .try_map(|letter| Frame::by_name(&letter).ok_or("no such coordinates"))
}
