//! Random a_lm of a layer: Gaussian, with power-law spectra and a correlation of T and E.
//!
//! \[MKD18\], section 5. Deviates are drawn l by l, and within an l for m = 0 … l, two for each (l, m), from one stream
//! per field, so the seeds up to a given l do not depend on lmax, on Nside, on the other layers or on threads.

use crate::Error;
use crate::random::{Stage, white_alm};
use dust3d_kernels::spectra::{PowerLaw, scale_by_l};
use num_complex::Complex;

/// The random a_lm of one layer, before any window.
pub struct Seeds {
    /// Intensity.
    pub t: Vec<Complex<f64>>,
    /// E modes, correlated with `t`.
    pub e: Vec<Complex<f64>>,
    /// B modes.
    pub b: Vec<Complex<f64>>,
}

/// Draws the seeds of a layer (counted from 1) with spectra `tt`, `ee`, `bb` for l ≥ 2 and zero below.
///
/// # Errors
/// If the layer number is out of the generator's range.
pub fn draw(
    seed: u64,
    layer: usize,
    lmax: usize,
    (tt, ee, bb): (PowerLaw, PowerLaw, PowerLaw),
    te_correlation: f64,
) -> Result<Seeds, Error> {
    let mut t = white_alm(seed, Stage::SmallScales, layer, 0, lmax)?;
    let mut e = white_alm(seed, Stage::SmallScales, layer, 1, lmax)?;
    let mut b = white_alm(seed, Stage::SmallScales, layer, 2, lmax)?;
    let independent = ((1.0 - te_correlation) * (1.0 + te_correlation)).sqrt();
    for (e, t) in e.iter_mut().zip(&t) {
        *e = *t * te_correlation + *e * independent;
    }
    for (alm, law) in [(&mut t, tt), (&mut e, ee), (&mut b, bb)] {
        let amplitude: Vec<f64> = (0..=lmax)
            .map(|l| if l < 2 { 0.0 } else { law.at(l).sqrt() })
            .collect();
        scale_by_l(alm, &amplitude)?;
    }
    Ok(Seeds { t, e, b })
}
