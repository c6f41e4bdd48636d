//! `dust3d map mask`.

use super::harmonics::Maps;
use crate::config::Dtype;
use crate::cut_sky::{Mask, mask};
use crate::error::{Error, Result};
use crate::io::{MapFormat, write_map_file};
use crate::kernels::healpix::Nside;
use crate::kernels::simd::Level;
use crate::sht::ShtPlan;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  dust3d map mask I_353.f64 --sky 70 --out sky70.f64\n  dust3d map spectrum I.f64 Q.f64 U.f64 --mask sky70.f64 --master 16"
)]
pub(in super::super) struct Args {
    /// The map whose faint parts are kept
    #[arg(value_name = "MAP")]
    map: String,
    /// Percentage of the sky to keep
    #[arg(long, value_name = "PERCENT")]
    sky: f64,
    /// Beam to which the map is smoothed first (FWHM), degrees
    #[arg(long, value_name = "DEG", default_value_t = 5.0)]
    smooth: f64,
    /// Width of the edge over which weights rise from 0 to 1, degrees
    #[arg(long, value_name = "DEG", default_value_t = 2.0)]
    apodise: f64,
    /// The weights (.f32, .f64, .fits or .npy)
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

pub(super) fn execute(args: &Args, level: Level) -> Result<()> {
    for (name, value, limit) in [
        ("sky", args.sky, 100.0),
        ("smooth", args.smooth, 90.0),
        ("apodise", args.apodise, 90.0),
    ] {
        if !(0.0..=limit).contains(&value) {
            return Err(Error::usage(format!(
                "--{name} {value} is not possible; give a number from 0 to {limit}"
            )));
        }
    }
    MapFormat::of(&args.out, Dtype::F64)?;
    let maps = Maps::read(std::slice::from_ref(&args.map))?;
    let nside = Nside::new(maps.nside.into())?;
    let lmax = maps.lmax(None)?;
    let alm = maps.analyse(lmax, 3, level)?.alms.remove(0);
    let mut plan = ShtPlan::new(nside, lmax, level)?;
    let smooth = mask::smoothed_alm(&alm, lmax, args.smooth.to_radians(), &mut plan)?;
    let weights = Mask::faintest(&smooth, args.sky / 100.0).apodised(
        nside,
        args.apodise.to_radians(),
        level,
    )?;
    write_map_file(&args.out, &weights.weight)
}

/// Reads the weights of a mask for maps of `nside`; nothing where they are missing.
pub(in super::super) fn read(spec: &str, nside: u32) -> Result<Mask> {
    let map = crate::io::MapSource::parse(spec)?.read()?;
    if map.nside != nside {
        return Err(Error::usage(format!(
            "--mask {spec} has Nside {} and the maps have {nside}; bring it to their grid first",
            map.nside
        )));
    }
    let weight: Vec<f64> = map
        .values
        .into_iter()
        .map(|x| {
            if crate::kernels::healpix::missing::is_missing(x) {
                0.0
            } else {
                x
            }
        })
        .collect();
    if let Some(pixel) = weight.iter().position(|x| !(0.0..=1.0).contains(x)) {
        return Err(Error::usage(format!(
            "--mask {spec}: pixel {pixel} has weight {}; weights are from 0 to 1",
            weight[pixel]
        )));
    }
    if weight.iter().all(|x| *x == 0.0) {
        return Err(Error::usage(format!(
            "--mask {spec} leaves no sky; give one with weights above 0"
        )));
    }
    Ok(Mask { weight })
}
