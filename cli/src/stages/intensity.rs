//! Intensity of each layer at ν₀.
//!
//! \[MKD18\], section 4.1: Ĩ_i = f_i τ B_ν₀(T_i), T_i the layer's average temperature, then the rest of the observed
//! intensity is shared in proportion to f_i: I_i = Ĩ_i + f_i (I − Σ_j Ĩ_j). Where this is negative in a layer, the layer
//! is set to zero and the others are scaled, so that Σ I_i = I and I_i ≥ 0 everywhere.

use crate::parallel;
use dust3d_kernels::healpix::missing::is_missing;
use dust3d_kernels::planck::spectrum::planck_scalar;
use dust3d_kernels::units::NU0_GHZ;

/// Averages of the observed temperature and spectral index over each layer, weighted by its fraction of the dust.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerAverages {
    /// Kelvin.
    pub t: Vec<f64>,
    /// Dimensionless.
    pub beta: Vec<f64>,
}

/// The sums behind [`LayerAverages`], made slab by slab.
///
/// T_avg = Σ_p f_i T_d / Σ_p f_i and the same for β; missing pixels are left out (\[MKD18\], section 6, with the weights
/// normalised).
pub struct AverageSums {
    /// Σ f x and Σ f per layer.
    t: Vec<[f64; 2]>,
    beta: Vec<[f64; 2]>,
}

impl AverageSums {
    /// Nothing yet, for so many layers.
    #[must_use]
    pub fn new(layers: usize) -> Self {
        Self {
            t: vec![[0.0; 2]; layers],
            beta: vec![[0.0; 2]; layers],
        }
    }

    /// Adds some pixels: the fractions of every layer, the observed T and β.
    pub fn add(&mut self, fractions: &[Vec<f64>], t: &[f64], beta: &[f64]) {
        for (sums, x) in [(&mut self.t, t), (&mut self.beta, beta)] {
            for (sum, f) in sums.iter_mut().zip(fractions) {
                let [product, weight] = weighted_sums(f, x);
                sum[0] += product;
                sum[1] += weight;
            }
        }
    }

    /// The averages; of a layer without dust those of the maps `t`, `beta`.
    #[must_use]
    pub fn averages(&self, t: &[f64], beta: &[f64]) -> LayerAverages {
        let average = |sums: &[[f64; 2]], x: &[f64]| {
            let of_layer = |&[sum, weight]: &[f64; 2]| {
                if weight > 0.0 { sum / weight } else { mean(x) }
            };
            sums.iter().map(of_layer).collect()
        };
        LayerAverages {
            t: average(&self.t, t),
            beta: average(&self.beta, beta),
        }
    }
}

/// Σ f x and Σ f over the pixels where x is not missing.
fn weighted_sums(f: &[f64], x: &[f64]) -> [f64; 2] {
    parallel::sums(f.len(), |range| {
        let mut part = [0.0; 2];
        for (&f, &x) in f[range.clone()].iter().zip(&x[range]) {
            if !is_missing(x) {
                part[0] += f * x;
                part[1] += f;
            }
        }
        part
    })
}

/// Mean of the pixels that are not missing.
pub(super) fn mean(x: &[f64]) -> f64 {
    let [sum, count] = parallel::sums(x.len(), |range| {
        let valid = x[range].iter().filter(|&&x| !is_missing(x));
        valid.fold([0.0; 2], |[s, n], x| [s + x, n + 1.0])
    });
    sum / count
}

/// The intensity layers (MJy/sr), and in how many pixels a layer came out negative and was cut.
#[must_use]
pub fn intensity(
    fractions: &[Vec<f64>],
    i: &[f64],
    tau: &[f64],
    averages: &LayerAverages,
) -> (Vec<Vec<f64>>, u64) {
    let brightness: Vec<f64> = averages
        .t
        .iter()
        .map(|&t| planck_scalar(NU0_GHZ, t))
        .collect();
    let mut layers = vec![vec![0.0; i.len()]; fractions.len()];
    let cut = parallel::for_columns(&mut layers, |range, mut layers| {
        let mut cut = 0;
        for (k, p) in range.enumerate() {
            let mut sum = 0.0;
            for ((layer, f), b) in layers.iter_mut().zip(fractions).zip(&brightness) {
                layer[k] = f[p] * tau[p] * b;
                sum += layer[k];
            }
            let rest = i[p] - sum;
            let mut positive = 0.0;
            let mut negative = false;
            for (layer, f) in layers.iter_mut().zip(fractions) {
                layer[k] += f[p] * rest;
                if layer[k] < 0.0 {
                    layer[k] = 0.0;
                    negative = true;
                }
                positive += layer[k];
            }
            if negative {
                cut += 1;
                let scale = if positive > 0.0 { i[p] / positive } else { 0.0 };
                for layer in layers.iter_mut() {
                    layer[k] *= scale;
                }
            }
        }
        cut
    });
    (layers, cut.into_iter().sum())
}
