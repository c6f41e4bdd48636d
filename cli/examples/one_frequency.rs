//! Makes a run of the built-in sky, or opens one, and evaluates it at one frequency.
//!
//! `cargo run --release -p dust3d --example one_frequency -- [RUN] [GHz]`

use dust3d::config::Draft;
use dust3d::io::{Run, RunDir};
use dust3d::kernels::simd::Level;
use dust3d::kernels::units::Unit;
use dust3d::progress::Silent;
use dust3d::replay::emission;
use dust3d::stages::emission::{Model, monochromatic};
use dust3d::{Error, pipeline};
use std::path::{Path, PathBuf};

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let dir = match arguments.next() {
        Some(dir) => PathBuf::from(dir),
        None => {
            let dir = std::env::temp_dir().join("dust3d-example-run");
            make(&dir)?;
            dir
        }
    };
    let ghz: f64 = arguments
        .next()
        .and_then(|text| text.parse().ok())
        .unwrap_or(150.0);

    let run = Run::open(&dir)?;
    // MJy/sr; a band is a list of frequencies with weights.
    let bands = [monochromatic(ghz)?];
    let mut read = Vec::new();
    let sky = emission(
        &run,
        Model::ThreeD,
        &bands,
        Level::detect(),
        &mut read,
        || {},
    )?;
    let [[i, q, u]] = sky.as_slice() else {
        unreachable!("one band");
    };
    let npix = i.len();
    let to_uk = Unit::MicroKCmb.from_mjysr(ghz)?;
    let rms = |map: &[f64]| (map.iter().map(|x| x * x).sum::<f64>() / npix as f64).sqrt() * to_uk;
    println!(
        "{ghz} GHz: rms of I, Q, U {:.3}, {:.3}, {:.3} uK_CMB",
        rms(i),
        rms(q),
        rms(u)
    );
    assert!(rms(i) > rms(q) && rms(q) > 0.0 && rms(u) > 0.0);
    Ok(())
}

/// A small run, as `dust3d run --nside 16 --out DIR --force` makes it.
fn make(dir: &Path) -> Result<(), Error> {
    let config = Draft::new().put("nside", 16)?.put("seed", 7)?.finish()?;
    let out = RunDir::create(dir, true)?;
    let manifest = pipeline::run(&config, None, &out, Level::detect(), &Silent)?;
    println!(
        "run in {}: pitch angle {:.1}°",
        dir.display(),
        manifest.pitch_deg.unwrap_or(f64::NAN)
    );
    out.finish(manifest)?;
    Ok(())
}
