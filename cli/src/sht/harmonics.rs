//! Coefficients of intensity and polarisation together, and their spectra.

use super::{Analysis, ShtPlan};
use crate::Error;
use dust3d_kernels::spectra::cross_spectrum;
use num_complex::Complex;

type Alm = Vec<Complex<f64>>;

/// I, Q, U.
pub type StokesView<'a> = [&'a [f64]; 3];

/// a_lm of intensity and polarisation.
#[derive(Debug, Clone, PartialEq)]
pub struct Harmonics {
    /// Intensity.
    pub t: Alm,
    /// E modes.
    pub e: Alm,
    /// B modes.
    pub b: Alm,
}

/// TT, EE, BB and TE, l = 0 … lmax; of two skies, their cross-spectra.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Spectra {
    /// Intensity.
    pub tt: Vec<f64>,
    /// E modes.
    pub ee: Vec<f64>,
    /// B modes.
    pub bb: Vec<f64>,
    /// Intensity of the first, E modes of the second.
    pub te: Vec<f64>,
}

impl Harmonics {
    /// Of whole skies, all at once.
    ///
    /// # Errors
    /// If a map does not fit the plan.
    pub fn analyse(plan: &mut ShtPlan, skies: &[StokesView<'_>]) -> Result<Vec<Self>, Error> {
        let zero = vec![Complex::new(0.0, 0.0); plan.alm_len()];
        let zero = Self {
            t: zero.clone(),
            e: zero.clone(),
            b: zero,
        };
        let mut out = vec![zero; skies.len()];
        let scalars: Vec<&[f64]> = skies.iter().map(|maps| maps[0]).collect();
        let pairs: Vec<[&[f64]; 2]> = skies.iter().map(|maps| [maps[1], maps[2]]).collect();
        let (mut t, mut eb) = (Vec::new(), Vec::new());
        for sky in &mut out {
            t.push(sky.t.as_mut_slice());
            eb.push([sky.e.as_mut_slice(), sky.b.as_mut_slice()]);
        }
        plan.analysis_mixed(&scalars, &pairs, &mut t, &mut eb, &Analysis::default())?;
        Ok(out)
    }

    /// Auto-spectra.
    ///
    /// # Errors
    /// If the lengths are not those of `lmax`.
    pub fn spectra(&self, lmax: usize) -> Result<Spectra, Error> {
        self.cross(self, lmax)
    }

    /// Cross-spectra with another sky.
    ///
    /// # Errors
    /// If the lengths are not those of `lmax`.
    pub fn cross(&self, other: &Self, lmax: usize) -> Result<Spectra, Error> {
        let cross = |a: &Alm, b: &Alm| -> Result<Vec<f64>, Error> {
            let mut c = vec![0.0; lmax + 1];
            cross_spectrum(a, b, &mut c)?;
            Ok(c)
        };
        Ok(Spectra {
            tt: cross(&self.t, &other.t)?,
            ee: cross(&self.e, &other.e)?,
            bb: cross(&self.b, &other.b)?,
            te: cross(&self.t, &other.e)?,
        })
    }
}
