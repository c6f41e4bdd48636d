//! Gaussian small scales of the polarisation of a layer.
//!
//! The seeds are windowed by √(1 − h_l²), synthesised, multiplied by the layer's polarised intensity over its rms, and
//! analysed again; E and B are scaled to the fitted amplitudes and added to the observed a_lm through the same window
//! (\[MKD18\], section 5). The window comes before the modulation because the red seeds, nearly constant across a layer
//! that hugs the plane, would otherwise give back the layer's own pattern with E and B mixed.

use super::StokesMaps;
use crate::Error;
use crate::parallel;
use crate::sht::{Analysis, ShtPlan};
use dust3d_kernels::spectra::{
    PowerLaw, beam_complement, cross_spectrum, fit_amplitude, scale_by_l,
};
use num_complex::Complex;
use rayon::prelude::*;

/// What the fluctuations are to be.
pub struct Fluctuations<'a> {
    /// The layer as observed.
    pub maps: &'a StokesMaps,
    /// Wanted E spectrum.
    pub ee: PowerLaw,
    /// Wanted B spectrum.
    pub bb: PowerLaw,
    /// Multipoles in which the amplitudes are compared.
    pub range: (usize, usize),
    /// Beam of the observed polarisation, radians.
    pub beam: f64,
}

/// a_lm of E and B: observed plus windowed random.
pub type EbAlm = (Vec<Complex<f64>>, Vec<Complex<f64>>);

/// Adds fluctuations to the observed E and B.
///
/// # Errors
/// If the lengths do not fit the plan.
pub fn add(
    plan: &mut ShtPlan,
    wanted: &Fluctuations<'_>,
    (e_obs, b_obs): (&[Complex<f64>], &[Complex<f64>]),
    (mut e, mut b): EbAlm,
) -> Result<EbAlm, Error> {
    let lmax = plan.lmax();
    let complement: Vec<f64> = (0..=lmax)
        .map(|l| beam_complement(wanted.beam, l))
        .collect();
    let window: Vec<f64> = complement.iter().map(|c| c.sqrt()).collect();
    scale_by_l(&mut e, &window)?;
    scale_by_l(&mut b, &window)?;
    let npix = wanted.maps.q.len();
    let (mut q, mut u) = (vec![0.0; npix], vec![0.0; npix]);
    plan.synthesis_spin2(&e, &b, &mut q, &mut u)?;
    modulate(&wanted.maps.q, &wanted.maps.u, &mut q, &mut u);
    plan.analysis_spin2(&q, &u, &mut e, &mut b, &Analysis::default())?;

    let mut spectrum = vec![0.0; lmax + 1];
    for (alm, law, observed) in [(&mut e, wanted.ee, e_obs), (&mut b, wanted.bb, b_obs)] {
        cross_spectrum(alm, alm, &mut spectrum)?;
        for (c, w) in spectrum.iter_mut().zip(&complement) {
            *c = if *w > 0.0 { *c / w } else { 0.0 };
        }
        let (lo, hi) = wanted.range;
        let amplitude = fit_amplitude(&spectrum, lo, hi, law.slope);
        let scale = if amplitude > 0.0 {
            (law.amplitude / amplitude).sqrt()
        } else {
            0.0
        };
        let factor: Vec<f64> = window.iter().map(|w| w * scale).collect();
        scale_by_l(alm, &factor)?;
        for (a, o) in alm.iter_mut().zip(observed) {
            *a += o;
        }
    }
    Ok((e, b))
}

/// (Q, U) ← (Q, U) · P/rms(P), P the polarised intensity of the layer.
fn modulate(q_layer: &[f64], u_layer: &[f64], q: &mut [f64], u: &mut [f64]) {
    let n = q_layer.len();
    let [square] = parallel::sums(n, |r| {
        let squares = q_layer[r.clone()].iter().zip(&u_layer[r]);
        [squares.map(|(q, u)| q * q + u * u).sum()]
    });
    let rms = (square / n as f64).sqrt();
    let scale = if rms > 0.0 { 1.0 / rms } else { 0.0 };
    q.par_iter_mut()
        .zip(u)
        .zip(q_layer.par_iter().zip(u_layer))
        .for_each(|((q, u), (ql, ul))| {
            let p = ql.hypot(*ul) * scale;
            *q *= p;
            *u *= p;
        });
}
