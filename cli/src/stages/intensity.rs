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

/// T_avg = Σ_p f_i T_d / Σ_p f_i and the same for β; missing pixels are left out (\[MKD18\], section 6, with the weights
/// normalised).
#[must_use]
pub fn layer_averages(fractions: &[Vec<f64>], t: &[f64], beta: &[f64]) -> LayerAverages {
    let average = |f: &[f64], x: &[f64]| {
        let [sum, weight] = parallel::sums(f.len(), |range| {
            let mut part = [0.0; 2];
            for (&f, &x) in f[range.clone()].iter().zip(&x[range]) {
                if !is_missing(x) {
                    part[0] += f * x;
                    part[1] += f;
                }
            }
            part
        });
        if weight > 0.0 { sum / weight } else { mean(x) }
    };
    LayerAverages {
        t: fractions.iter().map(|f| average(f, t)).collect(),
        beta: fractions.iter().map(|f| average(f, beta)).collect(),
    }
}

/// Mean of the pixels that are not missing.
pub(super) fn mean(x: &[f64]) -> f64 {
    let valid = x.iter().filter(|&&x| !is_missing(x));
    valid.clone().sum::<f64>() / valid.count() as f64
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
