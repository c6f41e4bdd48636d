//! `dust3d map convert`.

use super::super::session::Session;
use crate::config::Dtype;
use crate::error::{Error, Result};
use crate::io::fits::write::{MapColumn, MapTable, Provenance};
use crate::io::{MapFile, MapFormat, MapSource, write_map};
use crate::kernels::healpix::{Nside, resample};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  dust3d map convert I_353.f64 --out I_353.f32\n  dust3d map convert nested.f32 --from-nested --out ring.f64\n  dust3d map convert 'planck.fits[Q_STOKES]' --out Q_353.f64\n  dust3d map convert I.f64 Q.f64 U.f64 --unit MJy/sr --out iqu.fits"
)]
pub(in super::super) struct Args {
    /// The map; several (I Q U) for the columns of one FITS file or the rows of one .npy file
    #[arg(value_name = "MAP", required = true)]
    maps: Vec<String>,
    /// The result (.f32, .f64, .fits or .npy)
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// The map is in NESTED order (raw maps are in RING order by convention; FITS files say which)
    #[arg(long)]
    from_nested: bool,
    /// Write NESTED order, for programs that want it
    #[arg(long)]
    to_nested: bool,
    /// Element type of .fits and .npy files: f32 or f64; default: that of the first map
    #[arg(long, value_name = "TYPE", value_parser = dtype)]
    dtype: Option<Dtype>,
    /// Unit to be stated in a .fits file; default: what the map or the manifest of its run states
    #[arg(long)]
    unit: Option<String>,
}

fn dtype(text: &str) -> std::result::Result<Dtype, String> {
    match text {
        "f32" => Ok(Dtype::F32),
        "f64" => Ok(Dtype::F64),
        _ => Err("f32 or f64 is needed".to_owned()),
    }
}

pub(super) fn execute(args: &Args, session: &Session) -> Result<()> {
    let early = MapFormat::of(&args.out, Dtype::F64)?;
    if args.maps.len() > 1 && matches!(early, MapFormat::Raw(_)) {
        return Err(Error::usage(format!(
            "--out {}: a raw file holds one map; write several to .fits or .npy, or convert each by itself",
            args.out.display()
        )));
    }
    let sources = args
        .maps
        .iter()
        .map(MapSource::parse)
        .collect::<Result<Vec<_>>>()?;
    let maps = sources
        .iter()
        .map(|source| read(args, session, source))
        .collect::<Result<Vec<_>>>()?;
    let format = MapFormat::of(
        &args.out,
        args.dtype
            .or(maps.first().map(|map| map.dtype))
            .unwrap_or(Dtype::F64),
    )?;
    let units: Vec<String> = sources
        .iter()
        .zip(&maps)
        .map(|(source, map)| unit(args, source, map))
        .collect();
    let names: Vec<String> = match sources.len() {
        3 => ["I", "Q", "U"].map(str::to_owned).to_vec(),
        _ => sources.iter().map(name).collect(),
    };
    let columns: Vec<MapColumn<'_>> = names
        .iter()
        .zip(&units)
        .zip(&maps)
        .map(|((name, unit), map)| MapColumn {
            name,
            unit,
            values: &map.values,
        })
        .collect();
    let table = MapTable {
        columns: &columns,
        nested: args.to_nested,
        provenance: &Provenance::default(),
    };
    write_map(&args.out, format, &table)
}

/// The map in the order in which it is written.
fn read(args: &Args, session: &Session, source: &MapSource) -> Result<MapFile> {
    let mut map = source.read()?;
    if args.from_nested && matches!(source, MapSource::Fits { .. }) {
        return Err(Error::usage(format!(
            "--from-nested: `{}` says its order itself, leave the option out",
            source.path().display()
        )));
    }
    for note in &map.notes {
        session.note(note);
    }
    let nside = Nside::new(map.nside.into())?;
    if args.from_nested != args.to_nested {
        let mut other = vec![0.0; map.values.len()];
        if args.from_nested {
            resample::to_ring(session.level, nside, &map.values, &mut other)?;
        } else {
            resample::to_nested(session.level, nside, &map.values, &mut other)?;
        }
        map.values = other;
    }
    Ok(map)
}

fn unit(args: &Args, source: &MapSource, map: &MapFile) -> String {
    args.unit
        .clone()
        .or_else(|| map.unit.clone())
        .or_else(|| source.record()?.unit)
        .unwrap_or_default()
}

/// The column that was asked for, else the name of the file.
fn name(source: &MapSource) -> String {
    let asked = match source {
        MapSource::Fits { selection, .. } => selection.column.clone(),
        _ => None,
    };
    let stem = || {
        let name = source
            .path()
            .file_name()
            .unwrap_or_default()
            .to_string_lossy();
        name.split('.').next().unwrap_or_default().to_owned()
    };
    asked
        .filter(|column| column.parse::<usize>().is_err())
        .unwrap_or_else(stem)
}
