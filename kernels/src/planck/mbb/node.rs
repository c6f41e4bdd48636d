//! One frequency of a band: what depends on ν and ν₀ alone, once.

use crate::planck::spectrum::{check_frequency, decay, x_difference, x_kelvin};
use crate::{Error, scalar};

/// One frequency of a band, prepared: what depends on ν alone, and its weight a.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MbbNode {
    pub(super) nu_ghz: f64,
    pub(super) nu0_ghz: f64,
    pub(super) weight: f64,
    /// log₂(ν/ν₀).
    pub(super) log2_ratio: f64,
    /// −hν/k log₂ e, K.
    pub(super) decay: f64,
    /// h(ν₀ − ν)/k log₂ e, K.
    pub(super) decay_difference: f64,
}

impl MbbNode {
    /// The frequency `nu_ghz` of templates given at `nu0_ghz`, with weight `weight`: the factor of the unit for a single
    /// frequency, a number of [`crate::planck::bandpass::band_weights_into`] in a band, 1 for MJy/sr.
    ///
    /// # Errors
    /// [`Error::Domain`] unless both frequencies lie in 1e-30 … 1e30 GHz.
    pub fn new(nu_ghz: f64, nu0_ghz: f64, weight: f64) -> Result<Self, Error> {
        check_frequency(nu_ghz)?;
        check_frequency(nu0_ghz)?;
        let (difference, rest) = x_difference(nu_ghz, nu0_ghz);
        Ok(Self {
            nu_ghz,
            nu0_ghz,
            weight,
            log2_ratio: scalar::log2(nu_ghz / nu0_ghz),
            decay: decay(nu_ghz),
            decay_difference: (difference + rest) * core::f64::consts::LOG2_E,
        })
    }

    /// The frequency, GHz.
    #[must_use]
    pub const fn nu_ghz(&self) -> f64 {
        self.nu_ghz
    }

    /// The frequency of the templates, GHz.
    #[must_use]
    pub const fn nu0_ghz(&self) -> f64 {
        self.nu0_ghz
    }

    /// The weight in its band.
    #[must_use]
    pub const fn weight(&self) -> f64 {
        self.weight
    }

    /// s_ν = (ν/ν₀)^β B_ν(T)/B_ν₀(T), without the weight; NaN for T that is not positive.
    #[must_use]
    pub fn scaling_scalar(&self, t_kelvin: f64, beta: f64) -> f64 {
        if t_kelvin.is_nan() || t_kelvin <= 0.0 {
            return f64::NAN;
        }
        let x = x_kelvin(self.nu_ghz).0 / t_kelvin;
        let x0 = x_kelvin(self.nu0_ghz).0 / t_kelvin;
        let exponent = (beta + 3.0) * self.log2_ratio + self.decay_difference / t_kelvin;
        scalar::exp2(exponent) * (scalar::expm1(-x0) / scalar::expm1(-x))
    }
}

/// ν₀ of all nodes; none if there is no node.
pub(super) fn common_reference(bands: &[&[MbbNode]]) -> Result<Option<f64>, Error> {
    let mut found = None;
    for node in bands.iter().copied().flatten() {
        match found {
            None => found = Some(node.nu0_ghz),
            Some(nu0) if nu0 == node.nu0_ghz => {}
            Some(_) => {
                return Err(Error::Domain {
                    what: "reference frequency must be the same for all bands",
                    value: node.nu0_ghz,
                });
            }
        }
    }
    Ok(found)
}
