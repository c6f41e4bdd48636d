//! `dust3d emit`: frequency maps from a finished run.
//!
//! Layers are read one at a time; all bands of a pass are added up in memory.

use super::print;
use super::run::frequency;
use super::session::Session;
use crate::config::Dtype;
use crate::error::{Error, Result};
use crate::io::fits::write::{MapColumn, MapTable, Provenance};
use crate::io::manifest::InputRecord;
use crate::io::{Bandpass, Manifest, MapFormat, Run, RunDir};
use crate::kernels::Complex;
use crate::kernels::healpix::Nside;
use crate::kernels::planck::bandpass::band_weights_into;
use crate::kernels::planck::mbb::MbbNode;
use crate::kernels::sht::alm;
use crate::kernels::simd::Level;
use crate::kernels::spectra::beam;
use crate::kernels::spectra::scale_by_l;
use crate::kernels::units::{NU0_GHZ, Unit};
use crate::replay;
use crate::sht::{Analysis, ShtPlan};
use crate::stages::emission::{Model, Stokes};
use std::path::PathBuf;

/// Memory for the maps of one pass, bytes; more bands than fit take more passes over the run.
const PASS_BYTES: usize = 1 << 30;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  dust3d emit demo --freq 95,150 --unit uK_CMB --out maps\n  dust3d emit demo --freq 143 --bandpass hfi143.txt --unit uK_CMB --beam 7.2 --out maps\n\nUnits: MJy/sr, Jy/sr, K_RJ, mK_RJ, uK_RJ, K_CMB, mK_CMB, uK_CMB. A bandpass is a text file of two columns, GHz and weight\n(response to power, as PySM3 takes it). Files are called <model>_<GHz>GHz_<I|Q|U>; in FITS, <model>_<GHz>GHz.fits."
)]
pub(super) struct Args {
    /// Directory of a finished run
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// Frequencies, GHz (or a wavelength: 100um); with --bandpass, one that names the band
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = frequency, required_unless_present = "bandpass")]
    freq: Vec<f64>,
    /// Unit of the maps
    #[arg(long, default_value = "MJy/sr", value_parser = unit)]
    unit: Unit,
    /// Emission laws: maps of T and β per layer, one T and β per layer, or the observed T and β for the sum
    #[arg(long, default_value = "3d", value_parser = model)]
    model: Model,
    /// Integrate over this bandpass
    #[arg(long, value_name = "FILE")]
    bandpass: Option<PathBuf>,
    /// Resolution of the maps, resampled through spherical harmonics [default: that of the run]
    #[arg(long, value_name = "N")]
    nside: Option<u32>,
    /// Smooth with a Gaussian beam, FWHM in arcmin
    #[arg(long, value_name = "ARCMIN")]
    beam: Option<f64>,
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

/// What is emitted: its name in files, and a sum over frequencies.
struct Band {
    name: String,
    nodes: Vec<MbbNode>,
}

pub(super) fn execute(args: &Args, session: &Session) -> Result<()> {
    let bands = bands(args)?;
    let run = Run::open(&args.run)?;
    let resampling = Resampling::of(args, &run)?;
    let dtype = match args.dtype.as_deref() {
        Some("f32") => Dtype::F32,
        Some(_) => Dtype::F64,
        None => run
            .manifest
            .config
            .as_ref()
            .map_or(Dtype::F64, |config| config.output.dtype),
    };
    let format = match args.format.as_str() {
        "fits" => MapFormat::Fits(dtype),
        "npy" => MapFormat::Npy(dtype),
        _ => MapFormat::Raw(dtype),
    };
    let progress = session.progress();
    let manifest = session.on_threads(0, || {
        let out = RunDir::create(&args.out, args.force)?;
        let npix = 12 * (run.manifest.nside as usize).pow(2);
        let per_pass = (PASS_BYTES / (3 * npix * size_of::<f64>())).max(1);
        let mut inputs = Vec::new();
        let steps = (bands.len().div_ceil(per_pass) * run.layers()) as u64;
        progress.stage("emission", steps);
        for pass in bands.chunks(per_pass) {
            let nodes: Vec<Vec<MbbNode>> = pass.iter().map(|band| band.nodes.clone()).collect();
            let maps = replay::emission(
                &run,
                args.model,
                &nodes,
                session.level,
                |input: InputRecord| inputs.push(input),
                || progress.advance(1),
            )?;
            for (band, stokes) in pass.iter().zip(maps) {
                let stokes = resampling.apply(stokes, session.level)?;
                let columns: Vec<MapColumn<'_>> = ["I", "Q", "U"]
                    .into_iter()
                    .zip(&stokes)
                    .map(|(name, values)| MapColumn {
                        name,
                        unit: args.unit.name(),
                        values,
                    })
                    .collect();
                let provenance = Provenance {
                    frequency_ghz: band.name.strip_suffix("GHz").and_then(|nu| nu.parse().ok()),
                    ..Provenance::of_run(&run.manifest)
                };
                let table = MapTable {
                    columns: &columns,
                    nested: false,
                    provenance: &provenance,
                };
                let model = args.model.name();
                out.maps(
                    &format!("{model}_{}", band.name),
                    &format!("{}, model {model}", band.name),
                    format,
                    &table,
                )?;
            }
        }
        progress.finish();
        let mut manifest = Manifest::new("emit", resampling.to);
        session.level.name().clone_into(&mut manifest.simd);
        manifest.config.clone_from(&run.manifest.config);
        manifest.seed = run.manifest.seed;
        manifest.layers = run.manifest.layers;
        manifest.lmax = resampling.lmax;
        inputs.dedup_by(|a: &mut InputRecord, b| a.name == b.name);
        manifest.inputs = inputs;
        out.finish(manifest)
    })?;
    if session.is_quiet() {
        return Ok(());
    }
    print(&format!(
        "{} maps in {}\n",
        manifest.files.len(),
        args.out.display()
    ))
}

fn bands(args: &Args) -> Result<Vec<Band>> {
    let Some(path) = &args.bandpass else {
        return args
            .freq
            .iter()
            .map(|&nu| {
                let factor = args.unit.from_mjysr(nu)?;
                Ok(Band {
                    name: format!("{nu}GHz"),
                    nodes: vec![MbbNode::new(nu, NU0_GHZ, factor)?],
                })
            })
            .collect();
    };
    let name = match args.freq.as_slice() {
        [] => path
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned(),
        [nu] => format!("{nu}GHz"),
        more => {
            return Err(Error::usage(format!(
                "--freq gives {} frequencies; with --bandpass give one, which names the band, or none",
                more.len()
            )));
        }
    };
    let band = Bandpass::read(path)?;
    let mut weights = vec![0.0; band.nu_ghz.len()];
    band_weights_into(args.unit, &band.nu_ghz, &band.weight, &mut weights)
        .map_err(|cause| Error::input(format!("{}: {cause}", path.display())))?;
    let nodes = band
        .nu_ghz
        .iter()
        .zip(weights)
        .filter(|(_, weight)| *weight != 0.0);
    let nodes = nodes
        .map(|(&nu, weight)| Ok(MbbNode::new(nu, NU0_GHZ, weight)?))
        .collect::<Result<_>>()?;
    Ok(vec![Band { name, nodes }])
}

/// Another Nside, a beam, or neither.
struct Resampling {
    from: u32,
    to: u32,
    /// Band limit, if anything is to be done.
    lmax: Option<usize>,
    fwhm_rad: f64,
}

impl Resampling {
    fn of(args: &Args, run: &Run) -> Result<Self> {
        let from = run.manifest.nside;
        let to = args.nside.unwrap_or(from);
        if !to.is_power_of_two() || to > crate::io::raw::LARGEST_NSIDE {
            return Err(Error::usage(format!(
                "--nside {to} is not possible; choose a power of two up to {}",
                crate::io::raw::LARGEST_NSIDE
            )));
        }
        let arcmin = args.beam.unwrap_or(0.0);
        if !(0.0..=10_800.0).contains(&arcmin) {
            return Err(Error::usage(format!(
                "--beam {arcmin} is not possible; give a FWHM in arcmin from 0 to 10800"
            )));
        }
        // What the coarser of the two grids can carry.
        let needed = to != from || arcmin > 0.0;
        let lmax = needed.then(|| {
            run.manifest
                .lmax
                .unwrap_or(2 * from as usize)
                .min(2 * from.min(to) as usize)
        });
        Ok(Self {
            from,
            to,
            lmax,
            fwhm_rad: (arcmin / 60.0).to_radians(),
        })
    }

    fn apply(&self, [i, q, u]: Stokes, level: Level) -> Result<Stokes> {
        let Some(lmax) = self.lmax else {
            return Ok([i, q, u]);
        };
        let zero = vec![Complex::new(0.0, 0.0); alm::len(lmax)];
        let (mut t, mut e, mut b) = (zero.clone(), zero.clone(), zero);
        let mut plan = ShtPlan::new(Nside::new(self.from.into())?, lmax, level)?;
        plan.analysis_mixed(
            &[&i],
            &[[&q, &u]],
            &mut [&mut t],
            &mut [[&mut e, &mut b]],
            &Analysis::default(),
        )?;
        let window: Vec<f64> = (0..=lmax).map(|l| beam(self.fwhm_rad, l)).collect();
        for alm in [&mut t, &mut e, &mut b] {
            scale_by_l(alm, &window)?;
        }
        let npix = 12 * (self.to as usize).pow(2);
        let mut out: Stokes = std::array::from_fn(|_| vec![0.0; npix]);
        let [i, q, u] = &mut out;
        let mut plan = ShtPlan::new(Nside::new(self.to.into())?, lmax, level)?;
        plan.synthesis_mixed(&[&t], &[[&e, &b]], &mut [i], &mut [[q, u]])?;
        Ok(out)
    }
}

fn unit(text: &str) -> std::result::Result<Unit, String> {
    text.parse().map_err(|_| {
        let names: Vec<&str> = Unit::ALL.into_iter().map(Unit::name).collect();
        format!("the units are {}", names.join(", "))
    })
}

fn model(text: &str) -> std::result::Result<Model, String> {
    Model::ALL
        .into_iter()
        .find(|model| model.name() == text)
        .ok_or_else(|| "the models are 3d, 3d-uniform, 2d".to_owned())
}
