//! The bisymmetric spiral (BSS) model of the regular magnetic field (\[MKD18\], section 4.2).
//!
//! B_R = B sin q, B_θ = −B cos q, B_z = 0, with
//! B = −B_0(R) cos(θ + ln(R/r_0)/tan q) exp(−|z|/z_0) for R > 1 kpc and B = 0 inside;
//! B_0(R) = b_0 R⊙/R for R > 4 kpc and b_0 R⊙/(4 kpc) inside.
//!
//! For q < 0 the arms trail, and at the Sun the field points to l ≈ 90° + q (or the opposite).
//! The *direction* of the field is that of the spiral everywhere, also where the cosine is zero: polarisation depends
//! on the direction alone, and neither on B_0 nor on the phase.

use crate::Error;
use crate::scalar::{abs, atan2, cos, exp, hypot, ln, sin_cos, tan};

/// Parameters of the spiral field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spiral {
    /// Pitch angle q in radians; q < 0 for trailing arms.
    pub pitch_rad: f64,
    /// Amplitude b_0 at the Sun's radius in µG.
    pub b0_ug: f64,
    /// Radius r_0 that sets the phase, in kpc, above zero.
    pub r0_kpc: f64,
    /// Scale height z_0 of the field in kpc, above zero.
    pub z0_kpc: f64,
    /// Distance of the Sun from the Galactic centre in kpc, above zero.
    pub r_sun_kpc: f64,
    /// The field vanishes at R ≤ this radius (kpc, zero or above).
    pub hole_kpc: f64,
    /// The amplitude grows no further inside this radius (kpc, above zero).
    pub core_kpc: f64,
}

impl Default for Spiral {
    /// \[MKD18\]: q = −33°, b_0 = 3 µG, r_0 = 10.55 kpc, z_0 = 1 kpc, R⊙ = 8.5 kpc, no field inside 1 kpc, constant
    /// amplitude inside 4 kpc.
    fn default() -> Self {
        Self {
            pitch_rad: -33.0 * core::f64::consts::PI / 180.0,
            b0_ug: 3.0,
            r0_kpc: 10.55,
            z0_kpc: 1.0,
            r_sun_kpc: 8.5,
            hole_kpc: 1.0,
            core_kpc: 4.0,
        }
    }
}

impl Spiral {
    /// The signed strength B in µG at a Galactocentric point (kpc).
    ///
    /// Zero for R ≤ `hole_kpc`. For tan q = 0 the arms are wound infinitely tight and the phase is not defined: the
    /// result is then that of θ alone.
    #[must_use]
    pub fn strength_ug(&self, [x, y, z]: [f64; 3]) -> f64 {
        let r = hypot(x, y);
        if r <= self.hole_kpc || r == 0.0 {
            return 0.0;
        }
        let tan_q = tan(self.pitch_rad);
        let winding = if tan_q == 0.0 {
            0.0
        } else {
            ln(r / self.r0_kpc) / tan_q
        };
        let amplitude =
            self.b0_ug * self.r_sun_kpc / if r > self.core_kpc { r } else { self.core_kpc };
        -amplitude * cos(atan2(y, x) + winding) * exp(-abs(z) / self.z0_kpc)
    }

    /// The unit vector (x, y, z) along B/|B| for B > 0 at a Galactocentric point, that is sin q e_R − cos q e_θ.
    ///
    /// Defined everywhere but on the axis R = 0, where the x axis is taken for e_R.
    #[must_use]
    pub fn direction(&self, [x, y, _]: [f64; 3]) -> [f64; 3] {
        let r = hypot(x, y);
        let (ex, ey) = if r > 0.0 { (x / r, y / r) } else { (1.0, 0.0) };
        let (sin_q, cos_q) = sin_cos(self.pitch_rad);
        [sin_q * ex + cos_q * ey, sin_q * ey - cos_q * ex, 0.0]
    }

    /// The field (B_x, B_y, B_z) in µG at a Galactocentric point (kpc).
    ///
    /// ```
    /// // Fully wound the other way, q = 90°, the field is radial.
    /// use dust3d_kernels::field::Spiral;
    /// let radial = Spiral { pitch_rad: core::f64::consts::FRAC_PI_2, ..Spiral::default() };
    /// let [bx, by, bz] = radial.field_ug([-8.5, 0.0, 0.0]);
    /// assert!((bx + 3.0).abs() < 1e-12 && by.abs() < 1e-12 && bz == 0.0);
    /// ```
    #[must_use]
    pub fn field_ug(&self, position_kpc: [f64; 3]) -> [f64; 3] {
        let b = self.strength_ug(position_kpc);
        self.direction(position_kpc).map(|e| b * e)
    }

    /// # Errors
    /// [`Error::Domain`] if a length is not in its domain or the pitch angle is not finite.
    pub fn check(&self) -> Result<(), Error> {
        Error::check_domain(
            "pitch_rad (finite)",
            self.pitch_rad,
            self.pitch_rad.is_finite(),
        )?;
        Error::check_domain("r0_kpc (above 0)", self.r0_kpc, self.r0_kpc > 0.0)?;
        Error::check_domain("z0_kpc (above 0)", self.z0_kpc, self.z0_kpc > 0.0)?;
        let sun = self.r_sun_kpc;
        Error::check_domain("r_sun_kpc (above 0)", sun, sun > 0.0 && sun < 1e6)?;
        let hole = self.hole_kpc;
        Error::check_domain("hole_kpc (0 or above)", hole, hole >= 0.0)?;
        Error::check_domain("core_kpc (above 0)", self.core_kpc, self.core_kpc > 0.0)
    }
}
