//! Quadrature weights of the rings.
//!
//! Equal weights integrate only l = 0 and odd l exactly. One weight per ring pair makes Σ_p w(p) Y_l0(p) vanish for
//! every even l from 2 to 2 Nside while Σ_p w(p) = N_pix. There are 2 Nside weights for Nside + 1 conditions; of all
//! solutions the one with least Σ_p (w − 1)² is taken. It is w = 1 + Σ_l μ_l λ_l0 with, Y_0 the synthesis of m = 0,
//! Y_0ᵀ Y_0 μ = −Y_0ᵀ 1 (l ≥ 2) or 0 (l = 0), solved by conjugate gradients: Y_0ᵀ Y_0 is nearly N_pix/4π.

use super::plan::ShtPlan;
use dust3d_kernels::Error;
use dust3d_kernels::sht::{
    Aligned, Line, PhaseBlock, PhaseIndex, adjoint, adjoint_scratch_len, epsilon_len,
    epsilon_table, scalar_coefficients, scalar_from_sums, start_norms, step_count, step_table,
    synthesis,
};
use num_complex::Complex;

/// Relative size of the remaining quadrature errors.
const TOLERANCE: f64 = 1e-14;
const MOST_ITERATIONS: usize = 100;

impl ShtPlan {
    /// Weight of each ring pair, eight per block, near 1.
    pub(super) fn make_ring_weights(&self) -> Result<Vec<[f64; 8]>, Error> {
        let geometry = &self.geometry;
        let lmax = 2 * self.nside.get() as usize;
        let (epsilon, steps, norm) = {
            let mut epsilon = vec![0.0; epsilon_len(lmax, 0)];
            epsilon_table(0, &mut epsilon);
            let mut steps = vec![[0.0; 4]; step_count(lmax, 0)];
            step_table(&epsilon, &mut steps)?;
            let mut norm = [0.0];
            start_norms(&mut norm);
            let norm = norm[0] / steps[0][3];
            (epsilon, steps, norm)
        };
        let n = lmax / 2 + 1;
        let blocks = geometry.rings.len();
        let mut phases: Vec<PhaseBlock> = vec![PhaseBlock::default(); blocks];
        let mut coefficients = vec![[0.0; 4]; n];
        let mut scratch = vec![Line::default(); adjoint_scratch_len(n, 1)];
        let mut alm = vec![Complex::default(); lmax + 1];
        // values on rings of Σ μ_l λ_l0, even l only
        let mut on_rings = |mu: &[f64], phases: &mut [PhaseBlock]| -> Result<(), Error> {
            for (l, a) in alm.iter_mut().enumerate() {
                *a = Complex::new(if l % 2 == 0 { mu[l / 2] } else { 0.0 }, 0.0);
            }
            scalar_coefficients(self.level, &alm, &epsilon, &steps, 1, 0, &mut coefficients);
            synthesis(
                self.level,
                &geometry.rings,
                0,
                norm,
                &steps,
                1,
                &coefficients,
                PhaseIndex::default(),
                phases,
            )
        };
        let mut alm_back = vec![Complex::default(); lmax + 1];
        let mut sums = vec![[0.0; 4]; n];
        // Σ_p λ_l0 f(p), even l, for f constant on ring pairs; destroys f
        let mut moments = |f: &mut [PhaseBlock], out: &mut [f64]| -> Result<(), Error> {
            for (b, (block, shapes)) in f.iter_mut().zip(&geometry.shapes).enumerate() {
                for lane in 0..8 {
                    let value = block[0][lane] * shapes.pixels[lane] as f64;
                    let equator = 8 * b + lane + 1 == 2 * self.nside.get() as usize;
                    block[0][lane] = value;
                    block[2][lane] = if equator { 0.0 } else { value };
                }
                block[1] = [0.0; 8];
                block[3] = [0.0; 8];
            }
            adjoint(
                self.level,
                &geometry.rings,
                0,
                norm,
                &steps,
                1,
                PhaseIndex::default(),
                f,
                &mut sums,
                &mut scratch,
            )?;
            scalar_from_sums(
                self.level,
                &sums,
                &epsilon,
                &steps,
                1,
                0,
                false,
                &mut alm_back,
            );
            for (out, a) in out.iter_mut().zip(alm_back.iter().step_by(2)) {
                *out = a.re;
            }
            Ok(())
        };

        phases.fill(Aligned([[1.0; 8], [0.0; 8], [1.0; 8], [0.0; 8]]));
        let mut residual = vec![0.0; n];
        moments(&mut phases, &mut residual)?;
        let scale = residual[0];
        for r in &mut residual {
            *r = -*r;
        }
        residual[0] = 0.0;
        let mut mu = vec![0.0; n];
        let mut direction = residual.clone();
        let mut image = vec![0.0; n];
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut norm2 = dot(&residual, &residual);
        for _ in 0..MOST_ITERATIONS {
            if norm2.sqrt() <= TOLERANCE * scale {
                break;
            }
            on_rings(&direction, &mut phases)?;
            moments(&mut phases, &mut image)?;
            let step = norm2 / dot(&direction, &image);
            for ((mu, r), (d, i)) in mu
                .iter_mut()
                .zip(&mut residual)
                .zip(direction.iter().zip(&image))
            {
                *mu += step * d;
                *r -= step * i;
            }
            let next = dot(&residual, &residual);
            let ratio = next / norm2;
            norm2 = next;
            for (d, r) in direction.iter_mut().zip(&residual) {
                *d = r + ratio * *d;
            }
        }
        on_rings(&mu, &mut phases)?;
        Ok(phases.iter().map(|p| p[0].map(|v| 1.0 + v)).collect())
    }
}
