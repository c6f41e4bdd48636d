//! The one table of tolerances: kernel, measure, bound, why.

/// A bound on an error, held by the tests.
#[derive(Debug, Clone, Copy)]
pub struct Tolerance {
    /// The kernel or quantity.
    pub kernel: &'static str,
    /// What is measured, against what.
    pub measure: &'static str,
    /// The largest error allowed.
    pub bound: f64,
    /// Where the error comes from.
    pub why: &'static str,
}

impl Tolerance {
    /// Holds a measured largest error to the bound.
    ///
    /// # Panics
    /// If it is above the bound, or ten times below it: then the table should say so.
    pub fn hold(&self, worst: f64) {
        assert!(
            worst <= self.bound,
            "{}: {} is {worst:.3e}, above {:.3e} ({})",
            self.kernel,
            self.measure,
            self.bound,
            self.why
        );
        assert!(
            worst >= 0.1 * self.bound,
            "{}: {} is {worst:.3e}, the bound {:.3e} could be tighter",
            self.kernel,
            self.measure,
            self.bound
        );
    }
}

macro_rules! tolerances {
    ($($name:ident: $kernel:literal, $measure:literal, $bound:literal, $why:literal;)*) => {$(
        #[doc = concat!($kernel, ": ", $measure, ". ", $why)]
        pub const $name: Tolerance = Tolerance {
            kernel: $kernel,
            measure: $measure,
            bound: $bound,
            why: $why,
        };
    )*};
}

// HEALPix: centres against 50 digits, weights against healpy.
tolerances! {
    HEALPIX_ANGLE: "healpix pix2ang", "ulp of θ, φ, sin θ", 2.5, "φ: a product with π/4 and a quotient; θ: the rounding of its sine";
    HEALPIX_Z: "healpix pix2vec", "ulp of z", 1.0, "one quotient in the belt; 1 − t, with t to 1.5 ulp, in the caps";
    HEALPIX_XY: "healpix pix2vec", "x, y over sin θ", 1.5e-15, "the rounding of φ, up to 8.9e-16 before 2π";
    HEALPIX_WEIGHTS: "healpix interp", "weights over nside", 2e-15, "the rounding of θ, 4e-16 before π, over the spacing of rings, about 1/nside";
}
