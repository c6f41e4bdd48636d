//! The one table of tolerances: kernel, measure, bound, why.

/// How an error is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// Units in the last place of the reference.
    Ulp,
    /// |got − reference| over |reference|.
    Relative,
    /// |got − reference|.
    Absolute,
}

/// One row of the table.
#[derive(Debug, Clone, Copy)]
pub struct Tolerance {
    /// Kernel, as the documentation names it.
    pub kernel: &'static str,
    /// How the error is measured.
    pub measure: Measure,
    /// The greatest error allowed.
    pub bound: f64,
    /// Why no less.
    pub why: &'static str,
}

impl Tolerance {
    /// Asserts that the worst error of a test keeps the bound, and that the bound could not be ten times tighter.
    ///
    /// # Panics
    /// If either does not hold.
    pub fn assert_tight(&self, worst: f64) {
        self.assert_within(worst);
        assert!(
            self.bound <= 10.0 * worst,
            "{}: worst {worst:e} {:?}; the bound {:e} is too loose",
            self.kernel,
            self.measure,
            self.bound
        );
    }

    /// Asserts that the worst error of a test keeps the bound.
    ///
    /// # Panics
    /// If it does not.
    pub fn assert_within(&self, worst: f64) {
        assert!(
            worst <= self.bound,
            "{}: worst {worst:e} {:?} over the bound {:e} ({})",
            self.kernel,
            self.measure,
            self.bound,
            self.why
        );
    }
}

// HEALPix

/// θ, φ and sin θ of pixel centres.
pub const HEALPIX_ANGLE: Tolerance = Tolerance {
    kernel: "healpix pix2ang",
    measure: Measure::Ulp,
    bound: 2.5,
    why: "φ: one product with π/4 and one quotient; θ: the rounding of sin θ and z, and atan2",
};

/// z of pixel centres.
pub const HEALPIX_Z: Tolerance = Tolerance {
    kernel: "healpix pix2vec, z",
    measure: Measure::Ulp,
    bound: 1.0,
    why: "one quotient in the belt; 1 − t with t to 1.5 ulp in the caps",
};

/// x and y of pixel centres, relative to sin θ.
pub const HEALPIX_XY: Tolerance = Tolerance {
    kernel: "healpix pix2vec, x and y over sin θ",
    measure: Measure::Absolute,
    bound: 1.5e-15,
    why: "the rounding of φ, up to 8.9e-16 before 2π",
};

/// Interpolation weights against healpy.
pub const HEALPIX_WEIGHTS: Tolerance = Tolerance {
    kernel: "healpix interpolation weights over nside",
    measure: Measure::Absolute,
    bound: 2e-15,
    why: "the rounding of θ (4e-16 before π) over the spacing of rings, about 1/nside",
};
