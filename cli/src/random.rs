//! Random a_lm from the streams of the run's seed.

use dust3d_kernels::random::Stream;
use dust3d_kernels::spectra::alm_len;
use num_complex::Complex;

/// What a stream of random numbers is for. The numbers are part of the format of a seed: never reuse or change one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// The built-in sky.
    BuiltinSky = 0,
    /// Small scales of intensity and polarisation.
    SmallScales = 1,
    /// Temperature and spectral-index maps.
    Laws = 2,
}

/// Gaussian a_lm of unit spectrum: ⟨|a_lm|²⟩ = 1, a_l0 real.
///
/// Drawn l by l, for m = 0 … l, two normals each (the second of m = 0 is drawn and not used), so that the values up to
/// some l are the same for every larger `lmax`.
#[must_use]
pub fn unit_alm(seed: u64, stage: Stage, layer: usize, field: u32, lmax: usize) -> Vec<Complex<f64>> {
    let mut stream = Stream::new(seed, stage as u32, layer as u32, field);
    let mut alm = vec![Complex::new(0.0, 0.0); alm_len(lmax)];
    let mut normals = vec![0.0; 2 * (lmax + 1)];
    for l in 0..=lmax {
        let normals = &mut normals[..2 * (l + 1)];
        stream.fill_normals(normals);
        for (m, pair) in normals.chunks_exact(2).enumerate() {
            alm[m * (2 * lmax + 1 - m) / 2 + l] = if m == 0 {
                Complex::new(pair[0], 0.0)
            } else {
                Complex::new(pair[0], pair[1]) * std::f64::consts::FRAC_1_SQRT_2
            };
        }
    }
    alm
}
