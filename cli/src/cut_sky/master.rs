//! Band powers of a part of the sky with the coupling by the mask undone (MASTER, Hivon et al. 2002).
//!
//! The mean spectrum of the weighted maps is M C ([`coupling_row_into`]). D = l(l+1)C/2π is taken as constant over each
//! band of multipoles; averaging l(l+1)/2π M C over the bands leaves a small linear system. EE and BB are solved together, as the mask
//! turns one into the other. Multipoles outside the bands are taken as empty.

use super::mask::Mask;
use crate::error::{Error, Result};
use crate::kernels::spectra::{
    CouplingRow, coupling_row_into, coupling_scratch_len, cross_spectrum,
};
use crate::sht::Spectra;
use crate::sht::{Analysis, ShtPlan};
use num_complex::Complex;
use rayon::prelude::*;
use std::ops::Range;

/// The coupling of a mask's bands, ready to be undone for any number of spectra.
#[derive(Debug, Clone, PartialEq)]
pub struct Master {
    lmax: usize,
    bands: Vec<Range<usize>>,
    tt: Vec<Vec<f64>>,
    te: Vec<Vec<f64>>,
    polarisation: Vec<Vec<f64>>,
}

/// l(l+1)C_l/2π in each band.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BandPowers {
    /// The multipoles of each band.
    pub bands: Vec<Range<usize>>,
    /// The powers.
    pub powers: Spectra,
}

impl Master {
    /// The coupling of `mask` in bands of `width` multipoles from 2 to the plan's lmax; those left over at the end are in
    /// none. The mask's spectrum is taken up to twice lmax, but not beyond 3 Nside − 1.
    ///
    /// # Errors
    /// A mask that does not fit the plan's Nside, or no band at all.
    pub fn new(plan: &ShtPlan, mask: &Mask, width: usize) -> Result<Self> {
        let lmax = plan.lmax();
        let reach = (2 * lmax).min(3 * plan.nside().get() as usize - 1);
        let mut weights = ShtPlan::new(plan.nside(), reach, plan.level())?;
        let mut alm = vec![Complex::new(0.0, 0.0); weights.alm_len()];
        weights.analysis(&mask.weight, &mut alm, &Analysis::default())?;
        let mut spectrum = vec![0.0; reach + 1];
        cross_spectrum(&alm, &alm, &mut spectrum)?;
        Self::of_spectrum(&spectrum, lmax, width)
    }

    /// The same of a mask known by its spectrum.
    ///
    /// # Errors
    /// No band at all.
    pub fn of_spectrum(mask: &[f64], lmax: usize, width: usize) -> Result<Self> {
        let width = width.max(1);
        let bands: Vec<Range<usize>> = (0..)
            .map(|b| 2 + b * width..2 + (b + 1) * width)
            .take_while(|band| band.end <= lmax + 1)
            .collect();
        if bands.is_empty() {
            return Err(Error::usage(format!(
                "bands of {width} multipoles do not fit between 2 and {lmax}; choose narrower ones"
            )));
        }
        let n = bands.len();
        let rows: Vec<[Vec<f64>; 4]> = bands
            .par_iter()
            .map(|band| {
                let mut sums: [Vec<f64>; 4] = std::array::from_fn(|_| vec![0.0; n]);
                let mut row: [Vec<f64>; 4] = std::array::from_fn(|_| vec![0.0; lmax + 1]);
                let mut scratch = vec![0.0; coupling_scratch_len(lmax)];
                for l in band.clone() {
                    let [tt, te, same, other] = &mut row;
                    let rows = CouplingRow {
                        tt,
                        te,
                        same,
                        other,
                    };
                    coupling_row_into(l, mask, rows, &mut scratch)?;
                    for (sums, row) in sums.iter_mut().zip(&row) {
                        for (sum, band) in sums.iter_mut().zip(&bands) {
                            let band = band.clone();
                            let mean: f64 = band.map(|k| row[k] / band_weight(k)).sum();
                            *sum += band_weight(l) * mean / width as f64;
                        }
                    }
                }
                Ok(sums)
            })
            .collect::<Result<_>>()?;
        let block =
            |kind: usize| -> Vec<Vec<f64>> { rows.iter().map(|sums| sums[kind].clone()).collect() };
        let (same, other) = (block(2), block(3));
        let join = |left: &[Vec<f64>], right: &[Vec<f64>]| -> Vec<Vec<f64>> {
            left.iter()
                .zip(right)
                .map(|(left, right)| [left.as_slice(), right].concat())
                .collect()
        };
        let mut polarisation = join(&same, &other);
        polarisation.extend(join(&other, &same));
        Ok(Self {
            lmax,
            tt: block(0),
            te: block(1),
            polarisation,
            bands,
        })
    }

    /// Band powers behind the spectra of weighted maps (not divided by anything).
    ///
    /// # Errors
    /// Spectra of another lmax, or a mask that leaves too little sky for bands so narrow.
    pub fn band_powers(&self, weighted: &Spectra) -> Result<BandPowers> {
        let mean = |c: &[f64]| -> Result<Vec<f64>> {
            crate::kernels::Error::check_len("spectrum", self.lmax + 1, c.len())?;
            Ok(self
                .bands
                .iter()
                .map(|band| {
                    let sum: f64 = band.clone().map(|l| band_weight(l) * c[l]).sum();
                    sum / band.len() as f64
                })
                .collect())
        };
        let mut ee = solve(
            &self.polarisation,
            [mean(&weighted.ee)?, mean(&weighted.bb)?].concat(),
        )?;
        let bb = ee.split_off(self.bands.len());
        Ok(BandPowers {
            bands: self.bands.clone(),
            powers: Spectra {
                tt: solve(&self.tt, mean(&weighted.tt)?)?,
                te: solve(&self.te, mean(&weighted.te)?)?,
                ee,
                bb,
            },
        })
    }
}

/// l(l+1)/2π.
#[must_use]
pub fn band_weight(l: usize) -> f64 {
    (l * (l + 1)) as f64 / (2.0 * std::f64::consts::PI)
}

/// Solves a linear system by elimination with row pivots.
fn solve(matrix: &[Vec<f64>], mut x: Vec<f64>) -> Result<Vec<f64>> {
    let n = x.len();
    let mut matrix = matrix.to_vec();
    let largest = matrix
        .iter()
        .flatten()
        .fold(0.0_f64, |largest, element| largest.max(element.abs()));
    for column in 0..n {
        let size = |row: &usize| matrix[*row][column].abs();
        let pivot = (column..n)
            .max_by(|a, b| size(a).total_cmp(&size(b)))
            .unwrap_or(column);
        if !(size(&pivot) > 1e-12 * largest) {
            return Err(Error::usage(
                "the mask leaves too little sky for bands so narrow; widen them or the mask",
            ));
        }
        matrix.swap(column, pivot);
        x.swap(column, pivot);
        let (above, below) = matrix.split_at_mut(column + 1);
        let row = &above[column];
        for (offset, other) in below.iter_mut().enumerate() {
            let factor = other[column] / row[column];
            for (element, pivot) in other.iter_mut().zip(row).skip(column) {
                *element -= factor * pivot;
            }
            x[column + 1 + offset] -= factor * x[column];
        }
    }
    for column in (0..n).rev() {
        let known: f64 = (column + 1..n).map(|k| matrix[column][k] * x[k]).sum();
        x[column] = (x[column] - known) / matrix[column][column];
    }
    Ok(x)
}
