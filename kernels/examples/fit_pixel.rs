//! Fits a modified blackbody to one pixel: four intensities in, optical depth, temperature and spectral index out.
//!
//! `cargo run --release -p dust3d-kernels --example fit_pixel`

use dust3d_kernels::Error;
use dust3d_kernels::fit::mbb::{FitStatus, MbbFit};
use dust3d_kernels::planck::spectrum::planck_scalar;
use dust3d_kernels::scalar::pow;

fn main() -> Result<(), Error> {
    // 353, 545, 857 GHz and 100 µm with the errors of the paper; other bands: MbbFit::new(&nu_ghz, &sigma).
    let fit = MbbFit::default();
    let (tau, t_kelvin, beta) = (1.3e-6, 19.4, 1.6);
    let sky: Vec<f64> = fit
        .frequencies()
        .iter()
        .map(|&nu| tau * pow(nu / 353.0, beta) * planck_scalar(nu, t_kelvin))
        .collect();

    let exact = fit.fit_pixel(&sky)?;
    println!("noise-free: {exact:?}");
    assert_eq!(exact.status, FitStatus::Fitted);
    assert!((exact.t_kelvin - t_kelvin).abs() < 1e-7 && (exact.beta - beta).abs() < 1e-7);
    assert!((exact.tau / tau - 1.0).abs() < 1e-7);

    // One sigma up and down.
    let noisy: Vec<f64> = sky
        .iter()
        .zip(fit.sigma())
        .zip([1.0, -1.0, 1.0, -1.0])
        .map(|((i, sigma), sign)| i * (1.0 + sign * sigma))
        .collect();
    let noisy = fit.fit_pixel(&noisy)?;
    println!("noisy:      {noisy:?}");
    assert!((noisy.t_kelvin - t_kelvin).abs() < 2.0);

    // A pixel that was not observed is no failure.
    let missing = fit.fit_pixel(&[sky[0], f64::NAN, sky[2], sky[3]])?;
    println!("missing:    {missing:?}");
    assert_eq!(missing.status, FitStatus::Missing);
    Ok(())
}
