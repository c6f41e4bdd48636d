//! The smooth dust disc: n_d(R, z) = n_0 exp(−R/h_R) sech²(z/h_z) (\[MKD18\], section 3.2), with n_0 = 1.
//!
//! The logarithm is what the line-of-sight integrals use: 250 scale heights up, n_d itself underflows.

use crate::Error;
use crate::scalar::{abs, exp, ln_1p};

/// Scales of the dust disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Density {
    /// Radial scale length h_R in kpc, above zero.
    pub h_r_kpc: f64,
    /// Scale height h_z in kpc, above zero.
    pub h_z_kpc: f64,
}

impl Default for Density {
    /// h_R = 3 kpc, h_z = 0.1 kpc (\[MKD18\]).
    fn default() -> Self {
        Self {
            h_r_kpc: 3.0,
            h_z_kpc: 0.1,
        }
    }
}

impl Density {
    /// ln n_d at cylindrical radius `r_kpc` and height `z_kpc`; never underflows.
    ///
    /// # Accuracy
    /// A few ulp of the larger of R/h_R, 2|z|/h_z and 1.
    #[must_use]
    pub fn ln(&self, r_kpc: f64, z_kpc: f64) -> f64 {
        // sech x = 2 e^−|x| / (1 + e^−2|x|): no overflow at any height.
        let x = abs(z_kpc) / self.h_z_kpc;
        -r_kpc / self.h_r_kpc + 2.0 * (core::f64::consts::LN_2 - x - ln_1p(exp(-2.0 * x)))
    }

    /// n_d at cylindrical radius `r_kpc` and height `z_kpc`: 1 at the Galactic centre, zero where it underflows.
    ///
    /// ```
    /// let n = dust3d_kernels::field::Density::default().value(3.0, 0.0);
    /// assert!((n - (-1f64).exp()).abs() < 1e-15);
    /// ```
    #[must_use]
    pub fn value(&self, r_kpc: f64, z_kpc: f64) -> f64 {
        exp(self.ln(r_kpc, z_kpc))
    }

    /// # Errors
    /// [`Error::Domain`] unless both scales are above zero (infinity is allowed: no decrease).
    pub fn check(&self) -> Result<(), Error> {
        Error::check_domain("h_r_kpc (above 0)", self.h_r_kpc, self.h_r_kpc > 0.0)?;
        Error::check_domain("h_z_kpc (above 0)", self.h_z_kpc, self.h_z_kpc > 0.0)
    }
}
