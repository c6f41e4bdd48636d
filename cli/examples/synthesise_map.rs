//! Synthesises a random sky, writes it as FITS, and finds its coefficients again.
//!
//! `cargo run --release -p dust3d --example synthesise_map [FILE.fits]`

use dust3d::Error;
use dust3d::config::Dtype;
use dust3d::io::fits::write::{MapColumn, MapTable, Provenance};
use dust3d::io::{MapFormat, write_map};
use dust3d::kernels::healpix::Nside;
use dust3d::kernels::random::{Stream, normal::white_alm_into};
use dust3d::kernels::sht::alm;
use dust3d::kernels::simd::Level;
use dust3d::kernels::{Complex, spectra::scale_by_l};
use dust3d::sht::{Analysis, ShtPlan};
use std::path::PathBuf;

fn main() -> Result<(), Error> {
    let (nside, lmax) = (Nside::new(64)?, 128);

    // E modes with C_l ∝ l^−2.42; the draws of a seed do not depend on lmax.
    let zero = vec![Complex::new(0.0, 0.0); alm::len(lmax)];
    let (mut e, b) = (zero.clone(), zero.clone());
    white_alm_into(&mut Stream::new(7, 0, 0, 0)?, lmax, &mut e)?;
    let root: Vec<f64> = (0..=lmax)
        .map(|l| if l < 2 { 0.0 } else { (l as f64).powf(-1.21) })
        .collect();
    scale_by_l(&mut e, &root)?;

    // A plan holds tables and workspace, and serves any number of transforms.
    let mut plan = ShtPlan::new(nside, lmax, Level::detect())?;
    let npix = nside.npix() as usize;
    let (mut q, mut u) = (vec![0.0; npix], vec![0.0; npix]);
    plan.synthesis_spin2(&e, &b, &mut q, &mut u)?;

    let file = std::env::args_os().nth(1).map_or_else(
        || std::env::temp_dir().join("dust3d-example.fits"),
        PathBuf::from,
    );
    let columns = [("Q", &q), ("U", &u)].map(|(name, values)| MapColumn {
        name,
        unit: "uK_CMB",
        values,
    });
    let table = MapTable {
        columns: &columns,
        nested: false,
        provenance: &Provenance::default(),
    };
    write_map(&file, MapFormat::Fits(Dtype::F64), &table)?;
    println!("{npix} pixels in {}", file.display());

    let (mut found, mut leaked) = (zero.clone(), zero);
    plan.analysis_spin2(&q, &u, &mut found, &mut leaked, &Analysis::default())?;
    let power = |alm: &[Complex<f64>]| alm.iter().map(|a| a.norm_sqr()).sum::<f64>();
    let error: Vec<Complex<f64>> = found.iter().zip(&e).map(|(a, b)| a - b).collect();
    let relative = ((power(&error) + power(&leaked)) / power(&e)).sqrt();
    println!("round trip: {relative:.1e}");
    assert!(relative < 1e-5);
    Ok(())
}
