//! Emission at any frequency or over a bandpass.
//!
//! X_ν = Σ_i X_i (ν/ν₀)^β_i B_ν(T_i)/B_ν₀(T_i) for X = I, Q, U ([MKD18], sections 4.1 and 6). Three models come from one
//! run and differ in the laws: maps of T_i and β_i, one T and β per layer, or the summed layers with the observed T and β.

use crate::Error;
use crate::parallel;
use dust3d_kernels::planck::mbb::MbbScaling;
use dust3d_kernels::simd::Level;
use serde::{Deserialize, Serialize};

/// Which emission laws the layers have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Model {
    /// Maps of T and β in each layer: the model of the paper.
    #[serde(rename = "3d")]
    ThreeD,
    /// The layer's average T (scaled) and β.
    #[serde(rename = "3d-uniform")]
    Uniform,
    /// The sum of the layers, with the T and β fitted to the observations.
    #[serde(rename = "2d")]
    TwoD,
}

impl Model {
    /// All models, the paper's first.
    pub const ALL: [Self; 3] = [Self::ThreeD, Self::Uniform, Self::TwoD];

    /// `3d`, `3d-uniform` or `2d`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::ThreeD => "3d",
            Self::Uniform => "3d-uniform",
            Self::TwoD => "2d",
        }
    }
}

/// The emission law of a layer.
#[derive(Debug, Clone, Copy)]
pub enum Law<'a> {
    /// A temperature (kelvin) and spectral index per pixel.
    Maps {
        /// Kelvin.
        t: &'a [f64],
        /// Dimensionless.
        beta: &'a [f64],
    },
    /// One for the whole sky.
    Uniform {
        /// Kelvin.
        t: f64,
        /// Dimensionless.
        beta: f64,
    },
}

/// A layer with its law.
#[derive(Debug, Clone, Copy)]
pub struct Layer<'a> {
    /// I, Q, U at ν₀, MJy/sr.
    pub stokes: [&'a [f64]; 3],
    /// Its law.
    pub law: Law<'a>,
}

/// I, Q, U of one band.
pub type Stokes = [Vec<f64>; 3];

/// Adds a layer's emission in every band of `bands` to `out`, one I, Q, U per band.
///
/// # Errors
/// Those of the kernels (lengths, a temperature that is not positive).
pub fn add_layer(
    level: Level,
    bands: &MbbScaling,
    layer: &Layer<'_>,
    out: &mut [Stokes],
) -> Result<(), Error> {
    let uniform = match layer.law {
        Law::Maps { .. } => None,
        Law::Uniform { t, beta } => {
            let mut factors = vec![0.0; bands.len()];
            bands.ratios(beta, t, &mut factors)?;
            Some(factors)
        }
    };
    let mut maps: Vec<Vec<f64>> = out.iter_mut().flatten().map(std::mem::take).collect();
    let results = parallel::for_columns(&mut maps, |range, mut out| -> Result<(), Error> {
        let stokes = layer.stokes.map(|s| &s[range.clone()]);
        match (layer.law, &uniform) {
            (Law::Maps { t, beta }, _) => {
                bands.add_iqu(level, stokes, &beta[range.clone()], &t[range], &mut out)?;
            }
            (Law::Uniform { .. }, factors) => {
                let factors = factors.iter().flatten();
                for (out, factor) in out.chunks_mut(3).zip(factors) {
                    for (out, stokes) in out.iter_mut().zip(stokes) {
                        for (out, x) in out.iter_mut().zip(stokes) {
                            *out += x * factor;
                        }
                    }
                }
            }
        }
        Ok(())
    });
    for (slot, map) in out.iter_mut().flatten().zip(maps) {
        *slot = map;
    }
    results.into_iter().collect()
}
