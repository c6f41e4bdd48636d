//! Masks: weights from 0 to 1 per pixel.

use super::pseudo::truncated;
use crate::Error;
use crate::kernels::healpix::disc::{Inclusion, ring_ranges};
use crate::kernels::healpix::{Nside, ring};
use crate::kernels::sht::alm;
use crate::kernels::simd::Level;
use crate::kernels::spectra::{beam, scale_by_l};
use crate::sht::ShtPlan;
use num_complex::Complex;
use rayon::prelude::*;

/// A weight map.
#[derive(Debug, Clone, PartialEq)]
pub struct Mask {
    /// Weights in RING order, 0 … 1.
    pub weight: Vec<f64>,
}

impl Mask {
    /// The whole sky.
    #[must_use]
    pub fn whole(npix: usize) -> Self {
        Self {
            weight: vec![1.0; npix],
        }
    }

    /// The faintest `share` (0 … 1) of a map's pixels: as many as come nearest to it, the first of equal ones.
    #[must_use]
    pub fn faintest(map: &[f64], share: f64) -> Self {
        let mut order: Vec<usize> = (0..map.len()).collect();
        order.sort_by(|&a, &b| map[a].total_cmp(&map[b]));
        let kept = (share.clamp(0.0, 1.0) * map.len() as f64).round() as usize;
        let mut weight = vec![0.0; map.len()];
        for &pixel in &order[..kept] {
            weight[pixel] = 1.0;
        }
        Self { weight }
    }

    /// The same mask with its weights multiplied by a taper that rises from 0 beside pixels of weight 0 to 1 at `width`
    /// radians from them: x − sin(2πx)/2π with x² = (1 − cos θ)/(1 − cos `width`), θ the distance to the centre of the
    /// nearest such pixel. (NaMaster's C1.)
    ///
    /// # Errors
    /// Those of the kernels (a width that is not a number or negative).
    pub fn apodised(&self, nside: Nside, width: f64, level: Level) -> Result<Self, Error> {
        if width == 0.0 {
            return Ok(self.clone());
        }
        let zero = |pixel: u64| {
            self.weight
                .get(pixel as usize)
                .is_some_and(|weight| *weight == 0.0)
        };
        // The nearest pixel of weight 0 is one at the rim of its region.
        let mut rim = Vec::new();
        for pixel in (0..nside.npix()).filter(|&pixel| zero(pixel)) {
            let near = ring::neighbours(nside, pixel)?;
            if near.into_iter().flatten().any(|pixel| !zero(pixel)) {
                rim.push(pixel);
            }
        }
        let parts: Vec<Vec<(u64, f64)>> = rim
            .par_chunks(64)
            .map(|rim| {
                let mut found = Vec::new();
                for &pixel in rim {
                    let (here, at) = (ring::pix2loc(nside, pixel)?, ring::pix2vec(nside, pixel)?);
                    let mut failure = Ok(());
                    ring_ranges(level, nside, here, width, Inclusion::Centres, |range| {
                        for other in range.filter(|&other| !zero(other)) {
                            match ring::pix2vec(nside, other) {
                                // Half the squared chord is 1 − cos θ, without cancellation.
                                Ok(to) => found.push((
                                    other,
                                    0.5 * at
                                        .iter()
                                        .zip(&to)
                                        .map(|(a, b)| (a - b) * (a - b))
                                        .sum::<f64>(),
                                )),
                                Err(error) => failure = Err(error),
                            }
                        }
                    })?;
                    failure?;
                }
                Ok(found)
            })
            .collect::<Result<_, Error>>()?;
        let mut nearest = vec![f64::INFINITY; self.weight.len()];
        for (pixel, depth) in parts.into_iter().flatten() {
            let slot = &mut nearest[pixel as usize];
            *slot = slot.min(depth);
        }
        let reach = 2.0 * (0.5 * width).sin().powi(2);
        let weight = self.weight.iter().zip(nearest).map(|(weight, depth)| {
            let x = (depth / reach).sqrt();
            if x < 1.0 {
                let turn = 2.0 * std::f64::consts::PI;
                weight * (x - (turn * x).sin() / turn)
            } else {
                *weight
            }
        });
        Ok(Self {
            weight: weight.collect(),
        })
    }

    /// Mean weight.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.weight.iter().sum::<f64>() / self.weight.len().max(1) as f64
    }

    /// Mean of the squared weight: what the spectra of weighted maps are divided by.
    #[must_use]
    pub fn mean_square(&self) -> f64 {
        self.weight
            .iter()
            .map(|weight| weight * weight)
            .sum::<f64>()
            / self.weight.len().max(1) as f64
    }
}

/// The map of coefficients up to `lmax`, smoothed with a Gaussian beam of full width at half maximum `fwhm` (radians), on
/// the grid and up to the band limit of the plan.
///
/// # Errors
/// If the number of coefficients is not that of `lmax`.
pub fn smoothed_alm(
    alm: &[Complex<f64>],
    lmax: usize,
    fwhm: f64,
    to: &mut ShtPlan,
) -> Result<Vec<f64>, Error> {
    crate::kernels::Error::check_len("coefficients", alm::len(lmax), alm.len())?;
    let mut alm = truncated(alm, lmax, to.lmax());
    let window: Vec<f64> = (0..=to.lmax()).map(|l| beam(fwhm, l)).collect();
    scale_by_l(&mut alm, &window)?;
    let mut out = vec![0.0; to.npix()];
    to.synthesis(&alm, &mut out)?;
    Ok(out)
}
