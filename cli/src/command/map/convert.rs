//! `dust3d map convert`.

use crate::error::Result;
use crate::io::{MapSource, write_map_file};
use crate::kernels::healpix::{Nside, resample};
use crate::kernels::simd::Level;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  dust3d map convert I_353.f64 --out I_353.f32\n  dust3d map convert nested.f32 --from-nested --out ring.f64"
)]
pub(in super::super) struct Args {
    /// The map
    #[arg(value_name = "MAP")]
    map: String,
    /// The result (.f32 or .f64)
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// The map is in NESTED order (raw maps are in RING order by convention)
    #[arg(long)]
    from_nested: bool,
    /// Write NESTED order, for programs that want it
    #[arg(long)]
    to_nested: bool,
}

pub(super) fn execute(args: &Args, level: Level) -> Result<()> {
    let source = MapSource::parse(&args.map)?;
    MapSource::parse(&args.out)?;
    let map = source.read()?;
    let nside = Nside::new(map.nside.into())?;
    let mut values = map.values;
    if args.from_nested != args.to_nested {
        let mut other = vec![0.0; values.len()];
        if args.from_nested {
            resample::to_ring(level, nside, &values, &mut other)?;
        } else {
            resample::to_nested(level, nside, &values, &mut other)?;
        }
        values = other;
    }
    write_map_file(&args.out, &values)
}
