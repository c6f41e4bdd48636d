//! `dust3d map synthesise`.

use super::super::session::Session;
use crate::config::Dtype;
use crate::error::{Error, Result};
use crate::io::manifest::InputRecord;
use crate::io::{Alm, Manifest, RunDir, read_alm};
use crate::kernels::healpix::Nside;
use crate::sht::ShtPlan;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  dust3d map synthesise alm --nside 64 --out maps\n\nReads T.c128 and, or, E.c128 with B.c128 from the directory (as `dust3d map analyse` writes them); writes I.f64 and, or,\nQ.f64, U.f64."
)]
pub(in super::super) struct Args {
    /// Directory with T.c128, E.c128, B.c128
    #[arg(value_name = "DIR")]
    alm: PathBuf,
    /// Resolution of the maps, a power of two, at least a quarter of the coefficients' lmax
    #[arg(long, value_name = "N")]
    nside: u32,
    /// Directory to make
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace the directory if this program made it
    #[arg(long)]
    force: bool,
}

pub(super) fn execute(args: &Args, session: &Session) -> Result<()> {
    if !args.nside.is_power_of_two() || args.nside > crate::io::raw::LARGEST_NSIDE {
        return Err(Error::usage(format!(
            "--nside {} is not possible; choose a power of two up to {}",
            args.nside,
            crate::io::raw::LARGEST_NSIDE
        )));
    }
    let out = RunDir::create(&args.out, args.force)?;
    let (t, e, b) = (
        read(&args.alm, "T")?,
        read(&args.alm, "E")?,
        read(&args.alm, "B")?,
    );
    let pair = match (e, b) {
        (Some(e), Some(b)) if e.lmax != b.lmax => {
            return Err(Error::input(format!(
                "`{}`: E.c128 goes to lmax {} and B.c128 to {}; both must go equally far",
                args.alm.display(),
                e.lmax,
                b.lmax
            )));
        }
        (Some(e), Some(b)) => Some((e, b)),
        (None, None) => None,
        (Some(_), None) | (None, Some(_)) => {
            return Err(Error::input(format!(
                "`{}` holds one of E.c128 and B.c128; both are needed",
                args.alm.display()
            )));
        }
    };
    if t.is_none() && pair.is_none() {
        return Err(Error::input(format!(
            "`{}` holds neither T.c128 nor E.c128 and B.c128; give a directory of coefficients",
            args.alm.display()
        )));
    }
    let nside = Nside::new(args.nside.into())?;
    let npix = nside.npix() as usize;
    let plan = |lmax: usize| {
        if lmax > 4 * args.nside as usize {
            return Err(Error::usage(format!(
                "coefficients up to lmax {lmax} need --nside {} or more",
                lmax.div_ceil(4).next_power_of_two()
            )));
        }
        Ok(ShtPlan::new(nside, lmax, session.level)?)
    };
    let mut manifest = Manifest::new("map synthesise", args.nside);
    session.level.name().clone_into(&mut manifest.simd);
    if let Some(t) = &t {
        let mut i = vec![0.0; npix];
        plan(t.lmax)?.synthesis(&t.values, &mut i)?;
        out.map("I", "synthesis of T.c128", "", args.nside, &i, Dtype::F64)?;
        manifest.lmax = Some(t.lmax);
    }
    if let Some((e, b)) = &pair {
        let (mut q, mut u) = (vec![0.0; npix], vec![0.0; npix]);
        plan(e.lmax)?.synthesis_spin2(&e.values, &b.values, &mut q, &mut u)?;
        out.map(
            "Q",
            "synthesis of E.c128 and B.c128, Stokes Q",
            "",
            args.nside,
            &q,
            Dtype::F64,
        )?;
        out.map(
            "U",
            "synthesis of E.c128 and B.c128, Stokes U",
            "",
            args.nside,
            &u,
            Dtype::F64,
        )?;
        manifest.lmax = manifest.lmax.max(Some(e.lmax));
    }
    for name in ["T", "E", "B"] {
        let path = args.alm.join(format!("{name}.c128"));
        if let Ok(bytes) = std::fs::read(&path) {
            manifest.inputs.push(InputRecord {
                name: name.to_owned(),
                path: Some(path.display().to_string()),
                nside: args.nside,
                unit: String::new(),
                blake3: blake3::hash(&bytes).to_hex().to_string(),
            });
        }
    }
    out.finish(manifest).map(|_| ())
}

/// The coefficients `name`, if they are there.
fn read(dir: &Path, name: &str) -> Result<Option<Alm>> {
    let path = dir.join(format!("{name}.c128"));
    if path.exists() {
        read_alm(&path).map(Some)
    } else {
        Ok(None)
    }
}
