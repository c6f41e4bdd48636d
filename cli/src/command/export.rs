//! `dust3d export`: a run for other programs.

use super::print;
use super::session::Session;
use crate::config::Dtype;
use crate::error::{Error, Result};
use crate::io::fits::write::{MapColumn, MapTable, Provenance};
use crate::io::{Manifest, MapFormat, Run, RunDir};
use crate::kernels::units::NU0_GHZ;
use crate::replay::{LawMaps, LayerMaps, each_layer};
use crate::stages::emission::Model;
use std::path::{Path, PathBuf};

/// The configuration that PySM reads.
const TOML: &str = "pysm3.toml";
const AMPLITUDE: &str = "thermaldust_ampl";
const INDEX: &str = "thermaldust_specind";
const TEMPERATURE: &str = "thermaldust_temp";

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  dust3d export demo --pysm --out demo-pysm\n\nThen, in Python, in place of preset_strings=[\"d12\"]:\n  sky = pysm3.Sky(nside=64, component_config=\"demo-pysm/pysm3.toml\")\n\nThe directory holds I, Q, U (MJy/sr at 353 GHz), spectral index and temperature of every layer as FITS files, and\npysm3.toml, which names them by their absolute paths: export again, or edit it, after moving the directory. Colour\ncorrections were applied when the run was made, so that PySM is told to apply none."
)]
pub(super) struct Args {
    /// Directory of a finished run
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// Templates and configuration for PySM 3 (class ModifiedBlackBodyLayers)
    #[arg(long, required = true)]
    pysm: bool,
    /// Emission laws: 3d, 3d-uniform or 2d (one layer), as of `dust3d emit`
    #[arg(long, default_value = "3d", value_parser = super::emit::model())]
    model: Model,
    /// Element type of the templates [default: that of the run's]
    #[arg(long, value_parser = ["f32", "f64"])]
    dtype: Option<String>,
    /// Directory to make [default: pysm in that of the run]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace the directory if this program made it
    #[arg(long)]
    force: bool,
}

pub(super) fn execute(args: &Args, session: &Session) -> Result<()> {
    let run = Run::open(&args.run)?;
    let dtype = super::emit::dtype(args.dtype.as_deref(), &run);
    let target = args.out.clone().unwrap_or_else(|| args.run.join("pysm"));
    let out = RunDir::create(&target, args.force)?;
    // The parent is there by now; what the path says of it is made absolute, not looked up, as links may be meant.
    let place = std::path::absolute(out.target())
        .map_err(|cause| Error::io("write to", out.target(), &cause))?;
    let folder = place.to_str().ok_or_else(|| {
        Error::usage(format!(
            "`{}` is no UTF-8 text, which a PySM configuration cannot hold; choose another --out",
            place.display()
        ))
    })?;
    let progress = session.progress();
    progress.stage("export", run.layers() as u64);
    let mut inputs = Vec::new();
    let mut number = 0;
    let provenance = Provenance::of_run(&run.manifest);
    let mut advance = || progress.advance(1);
    each_layer(&run, args.model, &mut inputs, &mut advance, |layer| {
        number += 1;
        write_layer(&out, number, layer, dtype, &provenance)
    })?;
    progress.finish();
    out.file(
        TOML,
        "configuration of PySM",
        configuration(&run, args.model, number, folder).as_bytes(),
    )?;
    let mut manifest = Manifest::new("export", run.manifest.nside);
    session.level.name().clone_into(&mut manifest.simd);
    manifest.config.clone_from(&run.manifest.config);
    manifest.seed = run.manifest.seed;
    manifest.lmax = run.manifest.lmax;
    manifest.layers = Some(number);
    manifest.inputs = inputs;
    out.finish(manifest)?;
    if session.is_quiet() {
        return Ok(());
    }
    print(&format!(
        "{number} layers in {folder}\npysm3.Sky(nside={}, component_config={:?})\n",
        run.manifest.nside,
        Path::new(folder).join(TOML).display().to_string(),
    ))
}

/// The three files of a layer.
fn write_layer(
    out: &RunDir,
    number: usize,
    layer: &LayerMaps,
    dtype: Dtype,
    provenance: &Provenance,
) -> Result<()> {
    let write = |stem: &str, provenance: &Provenance, columns: &[MapColumn<'_>]| {
        let table = MapTable {
            columns,
            nested: false,
            provenance,
        };
        out.maps(
            &format!("{stem}{number}"),
            &format!("layer {number}"),
            MapFormat::Fits(dtype),
            &table,
        )
    };
    let column = |name, unit, values| MapColumn { name, unit, values };
    let [i, q, u] = &layer.stokes;
    write(
        AMPLITUDE,
        &provenance.clone().at(NU0_GHZ),
        &[
            column("I", "MJy/sr", i),
            column("Q", "MJy/sr", q),
            column("U", "MJy/sr", u),
        ],
    )?;
    let constant;
    let (t, beta) = match &layer.law {
        LawMaps::Maps { t, beta } => (t, beta),
        &LawMaps::Uniform { t, beta } => {
            constant = [t, beta].map(|value| vec![value; i.len()]);
            (&constant[0], &constant[1])
        }
    };
    write(INDEX, provenance, &[column("BETA", "", beta)])?;
    write(TEMPERATURE, provenance, &[column("TEMPERATURE", "K", t)])
}

/// What `component_config` of `pysm3.Sky` reads.
fn configuration(run: &Run, model: Model, layers: usize, folder: &str) -> String {
    // PySM puts the number of a layer in by Python's `format`, to which other braces are doubled.
    let escaped = folder.replace('{', "{{").replace('}', "}}");
    let path = |stem: &str| {
        let path = Path::new(&escaped).join(format!("{stem}{{layer}}.fits"));
        toml::Value::String(path.display().to_string()).to_string()
    };
    let seed = run
        .manifest
        .seed
        .map_or_else(String::new, |seed| format!(", seed {seed}"));
    format!(
        "# Dust of dust3d {version} (model {model}{seed}) for PySM 3, in place of its d12:\n\
         #   pysm3.Sky(nside={nside}, component_config=\"pysm3.toml\")\n\
         # Paths are absolute, as PySM looks for others in its own folders: edit them after moving this directory.\n\
         [dust3d]\n\
         class = \"ModifiedBlackBodyLayers\"\n\
         map_layers = {amplitude}\n\
         map_mbb_index = {index}\n\
         map_mbb_temperature = {temperature}\n\
         num_layers = {layers}\n\
         freq_ref = \"{NU0_GHZ} GHz\"\n\
         unit_layers = \"MJy/sr\"\n\
         unit_mbb_temperature = \"K\"\n\
         color_correction = 1.0\n\
         max_nside = {nside}\n",
        version = run.manifest.version,
        model = model.name(),
        nside = run.manifest.nside,
        amplitude = path(AMPLITUDE),
        index = path(INDEX),
        temperature = path(TEMPERATURE),
    )
}
