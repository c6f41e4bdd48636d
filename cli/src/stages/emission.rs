//! Emission at any frequency or over a bandpass.
//!
//! X_ν = Σ_i X_i (ν/ν₀)^β_i B_ν(T_i)/B_ν₀(T_i) for X = I, Q, U (\[MKD18\], sections 4.1 and 6). Three models come from one
//! run and differ in the laws: maps of T_i and β_i, one T and β per layer, or the summed layers with the observed T and β.

use crate::Error;
use crate::parallel;
use dust3d_kernels::planck::mbb::{MbbLayer, MbbNode, mbb_add_uniform, mbb_layers_into};
use dust3d_kernels::simd::Level;
use dust3d_kernels::units::NU0_GHZ;
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

/// A band of one frequency.
///
/// # Errors
/// If the frequency is not positive.
pub fn monochromatic(nu_ghz: f64) -> Result<Vec<MbbNode>, Error> {
    Ok(vec![MbbNode::new(nu_ghz, NU0_GHZ, 1.0)?])
}

/// Maps for [`layers_into`], without memory as yet.
#[must_use]
pub fn blank(bands: usize) -> Vec<Stokes> {
    vec![Stokes::default(); bands]
}

/// The emission of layers of `npix` pixels in every band of `bands`: one I, Q, U of `out` per band, overwritten.
///
/// Maps of `out` are made as long as needed; give them again: pages fresh from the system cost as much as what is
/// computed on them. Layers whose laws are maps are summed first, then those of one law for the whole sky, each in
/// their order.
///
/// # Errors
/// Those of the kernels (lengths, a temperature that is not positive).
pub fn layers_into(
    level: Level,
    bands: &[Vec<MbbNode>],
    layers: &[Layer<'_>],
    npix: usize,
    out: &mut [Stokes],
) -> Result<(), Error> {
    for map in out.iter_mut().flatten() {
        map.resize(npix, 0.0);
    }
    let bands: Vec<&[MbbNode]> = bands.iter().map(Vec::as_slice).collect();
    let mut maps: Vec<Vec<f64>> = out.iter_mut().flatten().map(std::mem::take).collect();
    let results = parallel::for_columns(&mut maps, |range, mut out| {
        let mapped: Vec<MbbLayer<'_, f64, 3>> = layers
            .iter()
            .filter_map(|layer| match layer.law {
                Law::Maps { t, beta } => Some(MbbLayer {
                    templates: layer.stokes.map(|map| &map[range.clone()]),
                    t: &t[range.clone()],
                    beta: &beta[range.clone()],
                }),
                Law::Uniform { .. } => None,
            })
            .collect();
        mbb_layers_into(level, &bands, &mapped, &mut out)?;
        layers.iter().try_for_each(|layer| match layer.law {
            Law::Maps { .. } => Ok(()),
            Law::Uniform { t, beta } => {
                let stokes = layer.stokes.map(|map| &map[range.clone()]);
                mbb_add_uniform(level, &bands, stokes, t, beta, &mut out)
            }
        })
    });
    for (slot, map) in out.iter_mut().flatten().zip(maps) {
        *slot = map;
    }
    for result in results {
        result?;
    }
    Ok(())
}
