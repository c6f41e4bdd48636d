//! A direction as (z, sin θ, φ).

use crate::{Error, scalar};

/// A direction: z = cos θ, sin θ ≥ 0, and the longitude φ in radians.
///
/// Both z and sin θ are kept because 1 − z has lost half its digits at θ = 1e-8 while sin θ has all of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Location {
    /// cos θ.
    pub z: f64,
    /// sin θ.
    pub sin_theta: f64,
    /// Longitude, rad, any finite value.
    pub phi: f64,
}

/// How far θ may pass π by rounding in the caller's arithmetic: 1e-5, as healpy allows.
pub(super) const THETA_MAX: f64 = core::f64::consts::PI + 1e-5;

impl Location {
    /// From colatitude and longitude, rad.
    ///
    /// # Errors
    /// [`Error::Domain`] unless 0 ≤ θ ≤ π (+1e-5, for rounding: reflected at the pole) and φ is finite.
    #[inline]
    pub fn from_ang(theta: f64, phi: f64) -> Result<Self, Error> {
        check_theta(theta)?;
        check_phi(phi)?;
        Ok(Self::from_valid_ang(theta, phi))
    }

    #[inline]
    pub(super) fn from_valid_ang(theta: f64, phi: f64) -> Self {
        let (sin, cos) = scalar::sin_cos(theta);
        Self {
            z: cos,
            sin_theta: scalar::abs(sin),
            phi,
        }
    }

    /// From a vector of any length but zero.
    ///
    /// # Errors
    /// [`Error::Domain`] if a component is not finite or all are zero.
    #[inline]
    pub fn from_vec(vector: [f64; 3]) -> Result<Self, Error> {
        check_vec(vector)?;
        Ok(Self::from_valid_vec(vector))
    }

    #[inline]
    pub(super) fn from_valid_vec([x, y, z]: [f64; 3]) -> Self {
        let largest = scalar::abs(x).max(scalar::abs(y)).max(scalar::abs(z));
        // Squares may overflow or vanish: bring the vector to about unit length first, exactly.
        let scale = if (1e-140..1e140).contains(&largest) {
            1.0
        } else if largest < 1.0 {
            SCALE_UP
        } else {
            1.0 / SCALE_UP
        };
        let (x, y, z) = (x * scale, y * scale, z * scale);
        let flat = x * x + y * y;
        let inverse = 1.0 / scalar::sqrt(flat + z * z);
        Self {
            z: z * inverse,
            sin_theta: scalar::sqrt(flat) * inverse,
            phi: scalar::atan2(y, x),
        }
    }

    /// Colatitude, rad.
    #[must_use]
    #[inline]
    pub fn theta(self) -> f64 {
        scalar::atan2(self.sin_theta, self.z)
    }

    /// Unit vector.
    #[must_use]
    #[inline]
    pub fn to_vec(self) -> [f64; 3] {
        let (sin, cos) = scalar::sin_cos(self.phi);
        [self.sin_theta * cos, self.sin_theta * sin, self.z]
    }

    /// Checks that the three numbers are a direction, to 1e-9.
    ///
    /// # Errors
    /// [`Error::Domain`] if one is not finite, sin θ < 0, or z² + sin² θ is not 1.
    #[inline]
    pub(super) fn check(self) -> Result<(), Error> {
        let norm = self.z * self.z + self.sin_theta * self.sin_theta;
        if !(scalar::abs(norm - 1.0) < 1e-9 && self.sin_theta >= 0.0) {
            return Err(domain("z² + sin² θ must be 1", norm));
        }
        check_phi(self.phi)
    }
}

/// 2⁹⁰⁰ brings 1e-308 … 1e-140 to 1e-38 … 1e131.
pub(super) const SCALE_UP: f64 = f64::from_bits((1023 + 900) << 52);

#[inline]
pub(super) fn check_theta(theta: f64) -> Result<(), Error> {
    if (0.0..=THETA_MAX).contains(&theta) {
        Ok(())
    } else {
        Err(domain("theta in 0 … π", theta))
    }
}

#[inline]
pub(super) fn check_phi(phi: f64) -> Result<(), Error> {
    if phi.is_finite() {
        Ok(())
    } else {
        Err(domain("phi must be finite", phi))
    }
}

#[inline]
pub(super) fn check_vec([x, y, z]: [f64; 3]) -> Result<(), Error> {
    for c in [x, y, z] {
        if !c.is_finite() {
            return Err(domain("vector must be finite", c));
        }
    }
    if x == 0.0 && y == 0.0 && z == 0.0 {
        return Err(domain("vector must not be zero", 0.0));
    }
    Ok(())
}

#[cold]
#[inline(never)]
pub(super) const fn domain(what: &'static str, value: f64) -> Error {
    Error::Domain { what, value }
}
