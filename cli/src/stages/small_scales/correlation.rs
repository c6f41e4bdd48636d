//! T–E correlation of a layer with small scales.
//!
//! Each l is whitened with the covariance of (T, E) that the simulated layer has, and recoloured with the one it should
//! have (\[MKD18\], section 5), with lower-triangular roots, so that T is not touched and the intensity stays positive.
//!
//! Erratum: the paper's covariance of the simulated layer assumes seeds that are not modulated by the layer's
//! polarised intensity. By default it is measured instead, in bins of l.

use crate::Error;
use crate::config::TeFilter;
use dust3d_kernels::spectra::{Cov2, PowerLaw, beam, beam_complement, binned_mean, cross_spectrum};
use num_complex::Complex;

/// What the correlation is made of.
pub struct Te<'a> {
    /// Coefficient at small scales.
    pub rho: f64,
    /// Beam of the intensity, radians.
    pub intensity_beam: f64,
    /// Beam of the polarisation, radians.
    pub polarisation_beam: f64,
    /// The fitted spectra, for the analytic filter.
    pub tt: PowerLaw,
    /// See `tt`.
    pub ee: PowerLaw,
    /// a_lm of the layer without small scales, for the measured filter.
    pub t_obs: &'a [Complex<f64>],
    /// See `t_obs`.
    pub e_obs: &'a [Complex<f64>],
}

/// Gives `e` the wanted correlation with `t`.
///
/// # Errors
/// If the a_lm have different lengths.
pub fn correlate(
    filter: TeFilter,
    te: &Te<'_>,
    t: &[Complex<f64>],
    e: &mut [Complex<f64>],
    lmax: usize,
) -> Result<(), Error> {
    let matrices = match filter {
        TeFilter::None => return Ok(()),
        TeFilter::Measured => measured(te, t, e, lmax)?,
        TeFilter::Analytic => analytic(te, lmax),
    };
    let mut index = 0;
    for m in 0..=lmax {
        for l in m..=lmax {
            if l >= 2 {
                let [b, c] = matrices[l];
                e[index] = t[index] * b + e[index] * c;
            }
            index += 1;
        }
    }
    Ok(())
}

/// Per l, what T and E contribute to the new E, from spectra measured in bins.
fn measured(
    te: &Te<'_>,
    t: &[Complex<f64>],
    e: &[Complex<f64>],
    lmax: usize,
) -> Result<Vec<[f64; 2]>, Error> {
    let observed = binned_covariances(te.t_obs, te.e_obs, lmax)?;
    let simulated = binned_covariances(t, e, lmax)?;
    Ok((0..=lmax)
        .map(|l| {
            let sim = simulated[l];
            let small = beam_complement(te.polarisation_beam, l);
            let rho = (1.0 - small) * observed[l].correlation() + small * te.rho;
            let target = Cov2 {
                xy: rho * (sim.xx * sim.yy).sqrt(),
                ..sim
            };
            second_row(sim, target)
        })
        .collect())
}

/// Per l, what T and E contribute to the new E, from the spectra the seeds were drawn with.
fn analytic(te: &Te<'_>, lmax: usize) -> Vec<[f64; 2]> {
    (0..=lmax)
        .map(|l| {
            let (xx, yy) = (te.tt.at(l), te.ee.at(l));
            let with = |rho: f64| Cov2 {
                xx,
                xy: rho * (xx * yy).sqrt(),
                yy,
            };
            let large = beam(te.intensity_beam, l) * beam(te.polarisation_beam, l);
            let small = (beam_complement(te.intensity_beam, l)
                * beam_complement(te.polarisation_beam, l))
            .sqrt();
            second_row(with(te.rho * (large + small)), with(te.rho))
        })
        .collect()
}

/// The row of the matrix that makes the new E; E stays as it is where there is nothing to correlate with.
fn second_row(from: Cov2, to: Cov2) -> [f64; 2] {
    if from.xx > 0.0 && from.yy > 0.0 {
        let m = from.recolour(&to);
        [m.b, m.c]
    } else {
        [0.0, 1.0]
    }
}

fn binned_covariances(
    t: &[Complex<f64>],
    e: &[Complex<f64>],
    lmax: usize,
) -> Result<Vec<Cov2>, Error> {
    let binned = |a: &[Complex<f64>], b: &[Complex<f64>]| -> Result<Vec<f64>, Error> {
        let (mut c, mut out) = (vec![0.0; lmax + 1], vec![0.0; lmax + 1]);
        cross_spectrum(a, b, &mut c)?;
        binned_mean(&c, &mut out)?;
        Ok(out)
    };
    let (tt, te, ee) = (binned(t, t)?, binned(t, e)?, binned(e, e)?);
    Ok((0..=lmax)
        .map(|l| Cov2 {
            xx: tt[l],
            xy: te[l],
            yy: ee[l],
        })
        .collect())
}
