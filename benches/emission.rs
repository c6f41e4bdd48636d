//! Layers and noisy intensities that look like those of a run.

use dust3d_kernels::fit::mbb::{DEFAULT_NU_GHZ, DEFAULT_SIGMA};
use dust3d_kernels::planck::spectrum::planck_scalar;
use dust3d_kernels::units::NU0_GHZ;

/// A small generator of normal deviates, the same everywhere (sum of twelve uniform ones).
struct Normal(u64);

impl Normal {
    fn next(&mut self) -> f64 {
        let uniform = |s: &mut u64| {
            *s ^= *s << 13;
            *s ^= *s >> 7;
            *s ^= *s << 17;
            (*s >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform(&mut self.0)).sum::<f64>() - 6.0
    }
}

/// Templates and laws of a layer, T about 19.4 ± 1.25 K and β about 1.6 ± 0.13.
pub struct Layer {
    /// I, Q, U at ν₀, MJy/sr.
    pub stokes: [Vec<f64>; 3],
    /// K.
    pub t: Vec<f64>,
    /// Spectral index.
    pub beta: Vec<f64>,
}

impl Layer {
    /// A layer of `n` pixels.
    pub fn new(n: usize) -> Self {
        let mut g = Normal(0x2545_f491_4f6c_dd1d);
        let mut map = |f: fn(f64) -> f64| (0..n).map(|_| f(g.next())).collect();
        Self {
            stokes: [map(f64::exp), map(|x| 0.05 * x), map(|x| 0.05 * x)],
            t: map(|x| 19.4 + 1.25 * x),
            beta: map(|x| 1.6 + 0.13 * x),
        }
    }

    /// The three templates.
    pub fn iqu(&self) -> [&[f64]; 3] {
        [&self.stokes[0], &self.stokes[1], &self.stokes[2]]
    }
}

/// Intensities at the default frequencies of the fit, with `noise` times its default errors.
pub struct Noisy {
    /// One map per frequency, MJy/sr.
    pub intensity: [Vec<f64>; 4],
    /// The temperatures behind them, K.
    pub t: Vec<f64>,
}

impl Noisy {
    /// `n` pixels.
    pub fn new(n: usize, noise: f64) -> Self {
        let layer = Layer::new(n);
        let mut g = Normal(0x9e37_79b9_7f4a_7c15);
        let intensity = std::array::from_fn(|f| {
            let (nu, sigma) = (DEFAULT_NU_GHZ[f], DEFAULT_SIGMA[f]);
            (0..n)
                .map(|p| {
                    let law = (nu / NU0_GHZ).powf(layer.beta[p]) * planck_scalar(nu, layer.t[p]);
                    1e-5 * law * (1.0 + noise * sigma * g.next())
                })
                .collect()
        });
        Self {
            intensity,
            t: layer.t,
        }
    }

    /// The four maps.
    pub fn maps(&self) -> [&[f64]; 4] {
        std::array::from_fn(|f| self.intensity[f].as_slice())
    }
}
