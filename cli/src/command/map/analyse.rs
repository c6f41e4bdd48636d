//! `dust3d map analyse`.

use super::super::session::Session;
use super::harmonics::Maps;
use crate::error::Result;
use crate::io::fits::write::{self as fits, Provenance};
use crate::io::manifest::InputRecord;
use crate::io::{Manifest, RunDir};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  dust3d map analyse I_353.f64 Q_353.f64 U_353.f64 --lmax 128 --out alm\n\nWrites T.c128, and E.c128, B.c128 if Q and U are given: little-endian complex128 in healpy's order. Missing pixels\ncount as no fluctuation. Beyond lmax = 2 Nside a HEALPix map does not determine its coefficients well."
)]
pub(in super::super) struct Args {
    /// I, or I Q U
    #[arg(required = true, num_args = 1..=3, value_name = "MAP")]
    maps: Vec<String>,
    /// Band limit, at most 4 Nside [default: 2 Nside]
    #[arg(long, value_name = "L")]
    lmax: Option<usize>,
    /// Jacobi iterations
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(0..=100))]
    iter: u16,
    /// Format of the coefficients: raw, or fits for one alm.fits that healpy's read_alm reads
    #[arg(long, default_value = "raw", value_parser = ["raw", "fits"])]
    format: String,
    /// Directory to make
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace the directory if this program made it
    #[arg(long)]
    force: bool,
}

pub(super) fn execute(args: &Args, session: &Session) -> Result<()> {
    let out = RunDir::create(&args.out, args.force)?;
    let maps = Maps::read(&args.maps)?;
    let lmax = maps.lmax(args.lmax)?;
    if maps.missing > 0 {
        session.note(&format!(
            "{} missing pixels count as no fluctuation",
            maps.missing
        ));
    }
    let mut manifest = Manifest::new("map analyse", maps.nside);
    session.level.name().clone_into(&mut manifest.simd);
    manifest.lmax = Some(lmax);
    for ((name, spec), map) in ["I", "Q", "U"].into_iter().zip(&args.maps).zip(&maps.maps) {
        manifest.inputs.push(InputRecord {
            name: name.to_owned(),
            path: Some(spec.clone()),
            nside: map.nside,
            unit: map.unit.clone().unwrap_or_default(),
            blake3: map.blake3.clone(),
        });
    }
    let unit = maps.maps[0].unit.clone().unwrap_or_default();
    let coefficients = maps.analyse(lmax, args.iter.into(), session.level)?;
    let named = ["T", "E", "B"].into_iter().zip(&coefficients.alms);
    if args.format == "fits" {
        let fields: Vec<_> = named.map(|(name, alm)| (name, alm.as_slice())).collect();
        let mut bytes = Vec::new();
        fits::alm(&fields, lmax, &unit, &Provenance::default(), &mut |part| {
            bytes.extend_from_slice(part);
            Ok(())
        })?;
        out.file("alm.fits", "a_lm, one HDU each", &bytes)?;
        return out.finish(manifest).map(|_| ());
    }
    for (name, alm) in named {
        out.alm(
            name,
            &format!("a_lm of {name}, l-index fastest, m from 0"),
            "",
            alm,
        )?;
    }
    out.finish(manifest).map(|_| ())
}
