//! Map → a_lm: quadrature with Jacobi iterations, or least squares.
//!
//! A HEALPix map determines its coefficients only up to lmax = 2 Nside or so. There, with W the pixel areas (times ring
//! weights), Yᵀ W Y differs from the identity by 1e-2 to 1e-3, and a ← a + Yᵀ W (map − Y a) gains that factor per
//! iteration. Conjugate gradients on Yᵀ Y a = Yᵀ map converge faster and to the least-squares solution, also somewhat
//! beyond 2 Nside; at 3 Nside − 1 the loss (0.13 of a white spectrum) is the map's, not the method's.

use super::plan::ShtPlan;
use dust3d_kernels::Error;
use num_complex::Complex;
use rayon::prelude::*;

type Alm = Complex<f64>;

/// How to analyse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Analysis {
    /// Jacobi iterations after the first quadrature.
    pub iterations: usize,
    /// Use ring weights that integrate Y_l0 exactly up to l = 2 Nside.
    pub ring_weights: bool,
}

impl Default for Analysis {
    /// Three iterations, as healpy's `map2alm`, and ring weights, which leave a fifth of the error of equal ones.
    fn default() -> Self {
        Self {
            iterations: 3,
            ring_weights: true,
        }
    }
}

/// How conjugate gradients ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Converged {
    /// Iterations made.
    pub iterations: usize,
    /// ‖Yᵀ(map − Y a)‖ relative to ‖Yᵀ map‖.
    pub residual: f64,
}

/// Σ over −lmax ≤ m ≤ lmax of Re a conj b, from m ≥ 0.
fn dot(lmax: usize, a: &[Alm], b: &[Alm]) -> f64 {
    let products = |a: &[Alm], b: &[Alm]| {
        a.iter()
            .zip(b)
            .map(|(x, y)| x.re * y.re + x.im * y.im)
            .sum::<f64>()
    };
    let (a0, a1) = a.split_at(lmax + 1);
    let (b0, b1) = b.split_at(lmax + 1);
    products(a0, b0) + 2.0 * products(a1, b1)
}

impl ShtPlan {
    /// Quadrature weights of all ring pairs, pixel area included.
    fn quadrature(&mut self, ring_weights: bool) -> Result<Vec<[f64; 8]>, Error> {
        let area = 4.0 * std::f64::consts::PI / self.npix() as f64;
        if !ring_weights {
            return Ok(vec![[area; 8]; self.geometry.rings.len()]);
        }
        if self.ring_weights.is_none() {
            self.ring_weights = Some(self.make_ring_weights()?);
        }
        Ok(self
            .ring_weights
            .iter()
            .flatten()
            .map(|w| w.map(|w| w * area))
            .collect())
    }

    /// a_lm of a map.
    ///
    /// After three iterations at lmax = 2 Nside the relative L2 error on a white spectrum is below 2e-6.
    ///
    /// # Errors
    /// [`Error::Length`] unless `map` and `alm` fit the plan.
    pub fn analysis(
        &mut self,
        map: &[f64],
        alm: &mut [Alm],
        analysis: &Analysis,
    ) -> Result<(), Error> {
        self.analysis_mixed(&[map], &[], &mut [alm], &mut [], analysis)
    }

    /// E and B of Q and U, with healpy's signs (`map2alm_spin([Q, U], spin=2)`).
    ///
    /// # Errors
    /// [`Error::Length`] unless all fit the plan.
    pub fn analysis_spin2(
        &mut self,
        q: &[f64],
        u: &[f64],
        e: &mut [Alm],
        b: &mut [Alm],
        analysis: &Analysis,
    ) -> Result<(), Error> {
        self.analysis_mixed(&[], &[[q, u]], &mut [], &mut [[e, b]], analysis)
    }

    /// [`analysis`](Self::analysis) of several maps at once.
    ///
    /// # Errors
    /// [`Error::Length`] unless all fit the plan and each other in number.
    pub fn analysis_batch(
        &mut self,
        maps: &[&[f64]],
        alms: &mut [&mut [Alm]],
        analysis: &Analysis,
    ) -> Result<(), Error> {
        self.analysis_mixed(maps, &[], alms, &mut [], analysis)
    }

    /// [`analysis_spin2`](Self::analysis_spin2) of several pairs at once.
    ///
    /// # Errors
    /// [`Error::Length`] unless all fit the plan and each other in number.
    pub fn analysis_spin2_batch(
        &mut self,
        qu: &[[&[f64]; 2]],
        eb: &mut [[&mut [Alm]; 2]],
        analysis: &Analysis,
    ) -> Result<(), Error> {
        self.analysis_mixed(&[], qu, &mut [], eb, analysis)
    }

    /// Scalar maps and spin-2 pairs at once; every result has the bits it would have alone.
    ///
    /// # Errors
    /// [`Error::Length`] unless all fit the plan and each other in number.
    pub fn analysis_mixed(
        &mut self,
        maps: &[&[f64]],
        qu: &[[&[f64]; 2]],
        alms: &mut [&mut [Alm]],
        eb: &mut [[&mut [Alm]; 2]],
        analysis: &Analysis,
    ) -> Result<(), Error> {
        let weights = self.quadrature(analysis.ring_weights)?;
        self.weighted_adjoint(maps, qu, alms, eb, Some(&weights))?;
        if analysis.iterations == 0 {
            return Ok(());
        }
        let zeros = |count: usize, len: usize| -> Vec<Vec<f64>> { vec![vec![0.0; len]; count] };
        let total = maps.len() + 2 * qu.len();
        let mut residual = zeros(total, self.npix());
        let mut change = vec![vec![Alm::default(); self.alm_len()]; total];
        let split = maps.len();
        for _ in 0..analysis.iterations {
            {
                let shared: Vec<&[Alm]> = alms.iter().map(|a| &**a).collect();
                let shared_eb: Vec<[&[Alm]; 2]> = eb.iter().map(|[e, b]| [&**e, &**b]).collect();
                let (mut scalar_maps, mut pair_maps) = views_mut(&mut residual, split);
                self.synthesis_mixed(&shared, &shared_eb, &mut scalar_maps, &mut pair_maps)?;
            }
            let given = maps.iter().copied().chain(qu.iter().flatten().copied());
            for (map, residual) in given.zip(&mut residual) {
                residual
                    .par_iter_mut()
                    .zip(map)
                    .for_each(|(r, x)| *r = x - *r);
            }
            {
                let (scalar_maps, pair_maps) = views(&residual, split);
                let (mut scalar_alms, mut pair_alms) = views_mut(&mut change, split);
                self.weighted_adjoint(
                    &scalar_maps,
                    &pair_maps,
                    &mut scalar_alms,
                    &mut pair_alms,
                    Some(&weights),
                )?;
            }
            let all = alms
                .iter_mut()
                .map(|a| &mut **a)
                .chain(eb.iter_mut().flatten().map(|a| &mut **a));
            for (alm, change) in all.zip(&change) {
                alm.par_iter_mut().zip(change).for_each(|(a, d)| *a += d);
            }
        }
        Ok(())
    }

    /// The least-squares a_lm of a map, by conjugate gradients until the residual of the normal equations is below
    /// `tolerance` of its start or `most` iterations are made.
    ///
    /// # Errors
    /// [`Error::Length`] unless `map` and `alm` fit the plan.
    pub fn analysis_to_accuracy(
        &mut self,
        map: &[f64],
        alm: &mut [Alm],
        tolerance: f64,
        most: usize,
    ) -> Result<Converged, Error> {
        self.conjugate_gradients(&[map], &mut [alm], tolerance, most)
    }

    /// The least-squares E and B of Q and U, as [`analysis_to_accuracy`](Self::analysis_to_accuracy).
    ///
    /// # Errors
    /// [`Error::Length`] unless all fit the plan.
    pub fn analysis_spin2_to_accuracy(
        &mut self,
        q: &[f64],
        u: &[f64],
        e: &mut [Alm],
        b: &mut [Alm],
        tolerance: f64,
        most: usize,
    ) -> Result<Converged, Error> {
        self.conjugate_gradients(&[q, u], &mut [e, b], tolerance, most)
    }

    /// One scalar map or one pair.
    fn conjugate_gradients(
        &mut self,
        maps: &[&[f64]],
        alms: &mut [&mut [Alm]],
        tolerance: f64,
        most: usize,
    ) -> Result<Converged, Error> {
        let lmax = self.lmax;
        let sets = maps.len();
        let weights = self.quadrature(false)?;
        let scalars = if sets == 1 { 1 } else { 0 };
        let mut residual = vec![vec![Alm::default(); self.alm_len()]; sets];
        let mut image = residual.clone();
        let mut pixels = vec![vec![0.0; self.npix()]; sets];
        {
            let (s, p) = views_of(maps, scalars);
            let (mut sa, mut pa) = views_mut(&mut residual, scalars);
            self.weighted_adjoint(&s, &p, &mut sa, &mut pa, Some(&weights))?;
        }
        for a in alms.iter_mut() {
            Error::check_len("coefficients", self.alm_len(), a.len())?;
            a.fill(Alm::default());
        }
        let mut direction = residual.clone();
        let total = |a: &[Vec<Alm>], b: &[Vec<Alm>]| {
            a.iter().zip(b).map(|(a, b)| dot(lmax, a, b)).sum::<f64>()
        };
        let mut norm2 = total(&residual, &residual);
        let first = norm2;
        let mut iterations = 0;
        while iterations < most && norm2 > tolerance * tolerance * first {
            {
                let (s, p) = views(&direction, scalars);
                let (mut sm, mut pm) = views_mut(&mut pixels, scalars);
                self.synthesis_mixed(&s, &p, &mut sm, &mut pm)?;
            }
            {
                let (s, p) = views(&pixels, scalars);
                let (mut sa, mut pa) = views_mut(&mut image, scalars);
                self.weighted_adjoint(&s, &p, &mut sa, &mut pa, Some(&weights))?;
            }
            let step = norm2 / total(&direction, &image);
            for ((alm, d), (r, i)) in alms
                .iter_mut()
                .zip(&direction)
                .zip(residual.iter_mut().zip(&image))
            {
                for ((a, d), (r, i)) in alm.iter_mut().zip(d).zip(r.iter_mut().zip(i)) {
                    *a += d * step;
                    *r -= i * step;
                }
            }
            let next = total(&residual, &residual);
            let ratio = next / norm2;
            norm2 = next;
            for (d, r) in direction.iter_mut().zip(&residual) {
                for (d, r) in d.iter_mut().zip(r) {
                    *d = r + *d * ratio;
                }
            }
            iterations += 1;
        }
        Ok(Converged {
            iterations,
            residual: if first > 0.0 {
                (norm2 / first).sqrt()
            } else {
                0.0
            },
        })
    }
}

/// Sets as scalars (the first `split`) and pairs.
fn views<T>(sets: &[Vec<T>], split: usize) -> (Vec<&[T]>, Vec<[&[T]; 2]>) {
    let all: Vec<&[T]> = sets.iter().map(|s| &s[..]).collect();
    views_of(&all, split)
}

fn views_of<'a, T>(sets: &[&'a [T]], split: usize) -> (Vec<&'a [T]>, Vec<[&'a [T]; 2]>) {
    let (scalars, pairs) = sets.split_at(split);
    (scalars.to_vec(), pairs.as_chunks::<2>().0.to_vec())
}

type PairsMut<'a, T> = Vec<[&'a mut [T]; 2]>;

fn views_mut<T>(sets: &mut [Vec<T>], split: usize) -> (Vec<&mut [T]>, PairsMut<'_, T>) {
    let (scalars, pairs) = sets.split_at_mut(split);
    (
        scalars.iter_mut().map(|s| &mut s[..]).collect(),
        pairs
            .as_chunks_mut::<2>()
            .0
            .iter_mut()
            .map(|[a, b]| [&mut a[..], &mut b[..]])
            .collect(),
    )
}
