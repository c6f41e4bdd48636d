//! Random T and β maps of a layer: right spectra, right distribution (\[MKD18\], section 6).
//!
//! A correlated Gaussian pair with the observed spectra is remapped to the observed distributions, which changes its
//! spectra slightly, so it is filtered back to them. After one such iteration the spectra are exact and the
//! distribution is close.

use super::remap::remap;
use super::spectra::{ObservedLaws, analyse, covariances_of_alm};
use crate::Error;
use crate::random::{Stage, white_alm};
use crate::sht::ShtPlan;
use dust3d_kernels::spectra::Lower2;
use num_complex::Complex;

/// Fluctuations of T (kelvin) and β of one layer (counted from 1) about their averages.
///
/// # Errors
/// Those of the transforms.
pub fn draw(
    plan: &mut ShtPlan,
    observed: &ObservedLaws,
    seed: u64,
    layer: usize,
    refilter_iterations: u32,
) -> Result<(Vec<f64>, Vec<f64>), Error> {
    let lmax = plan.lmax();
    let mut t_alm = white_alm(seed, Stage::EmissionLaws, layer, 0, lmax)?;
    let mut beta_alm = white_alm(seed, Stage::EmissionLaws, layer, 1, lmax)?;
    let roots: Vec<Lower2> = observed.covariances.iter().map(|c| c.root()).collect();
    transform(&mut t_alm, &mut beta_alm, &roots);

    let npix = plan.nside().npix() as usize;
    let (mut t, mut beta) = (vec![0.0; npix], vec![0.0; npix]);
    plan.synthesis_batch(&[&t_alm, &beta_alm], &mut [&mut t, &mut beta])?;
    for _ in 0..refilter_iterations {
        rayon::join(
            || remap(&mut t, &observed.t_sorted),
            || remap(&mut beta, &observed.beta_sorted),
        );
        (t_alm, beta_alm) = analyse(plan, &t, &beta)?;
        let measured = covariances_of_alm(&t_alm, &beta_alm, lmax)?;
        let filters: Vec<Lower2> = measured
            .iter()
            .zip(&observed.covariances)
            .map(|(from, to)| from.recolour(to))
            .collect();
        transform(&mut t_alm, &mut beta_alm, &filters);
        plan.synthesis_batch(&[&t_alm, &beta_alm], &mut [&mut t, &mut beta])?;
    }
    Ok((t, beta))
}

/// Applies one matrix per l to the pair (x, y).
fn transform(x: &mut [Complex<f64>], y: &mut [Complex<f64>], matrices: &[Lower2]) {
    let lmax = matrices.len() - 1;
    let ls = (0..=lmax).flat_map(|m| m..=lmax);
    for ((x, y), l) in x.iter_mut().zip(y).zip(ls) {
        let Lower2 { a, b, c } = matrices[l];
        *y = *x * b + *y * c;
        *x *= a;
    }
}
