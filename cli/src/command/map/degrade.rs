//! `dust3d map degrade`.

use crate::config::Dtype;
use crate::error::{Error, Result};
use crate::io::{MapFormat, MapSource, write_map_file};
use crate::kernels::healpix::{Nside, resample};
use crate::kernels::simd::Level;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  dust3d map degrade I_353.f64 --nside 64 --out I_353_64.f64")]
pub(in super::super) struct Args {
    /// The map
    #[arg(value_name = "MAP")]
    map: String,
    /// Nside of the result, a power of two, at most that of the map
    #[arg(long, value_name = "N")]
    nside: u32,
    /// The result (.f32, .f64, .fits or .npy); missing pixels are left out of the averages
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

pub(super) fn execute(args: &Args, level: Level) -> Result<()> {
    let source = MapSource::parse(&args.map)?;
    MapFormat::of(&args.out, Dtype::F64)?;
    let map = source.read()?;
    if !args.nside.is_power_of_two() || args.nside > map.nside {
        return Err(Error::usage(format!(
            "--nside {} is not possible for `{}` of Nside {}; choose a power of two up to that (a finer map: dust3d map analyse, then synthesise)",
            args.nside, args.map, map.nside
        )));
    }
    let (from, to) = (
        Nside::new(map.nside.into())?,
        Nside::new(args.nside.into())?,
    );
    let mut coarse = vec![0.0; to.npix() as usize];
    resample::degrade_ring(level, from, to, &map.values, &mut coarse)?;
    write_map_file(&args.out, &coarse)
}
