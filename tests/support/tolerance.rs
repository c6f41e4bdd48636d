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

// Vector mathematics, 200-bit references, fused levels; portable in its own rows.
tolerances! {
    EXP: "exp", "ulp, fused", 1.0, "rounding of the reduced argument and the last sum";
    EXPM1: "expm1", "ulp, fused", 2.1, "as exp; the sum is two bits below its terms at x = 0.36";
    LN: "ln", "ulp, fused", 1.0, "quotient and two sums";
    SIN: "sin", "ulp, fused", 1.0, "last sum; the reduced argument has two parts";
    COS: "cos", "ulp, fused", 1.0, "as sin";
    POW: "pow", "ulp, fused", 1.3, "as exp: the logarithm has two parts";
    EXP_PORTABLE: "exp", "ulp, portable", 1.2, "products are rounded";
    EXPM1_PORTABLE: "expm1", "ulp, portable", 2.1, "products are rounded";
    LN_PORTABLE: "ln", "ulp, portable", 1.2, "products are rounded";
    SIN_PORTABLE: "sin", "ulp, portable", 1.2, "products are rounded";
    COS_PORTABLE: "cos", "ulp, portable", 1.2, "products are rounded";
    POW_PORTABLE: "pow", "ulp, portable", 1.5, "products are rounded";
}

// Planck function and modified blackbodies, 50-digit references.
tolerances! {
    PLANCK: "planck_into", "relative, fused, any x below 690", 1e-15, "x carries two parts";
    PLANCK_PORTABLE: "planck_into", "relative over max(1, x/3), portable", 1e-15, "x is rounded three times";
    PLANCK_SCALAR: "planck_scalar", "relative, any x below 690", 1.5e-15, "the square of e^(−x/2)";
    DERIVATIVE: "planck_derivative_into", "relative, fused, any x below 690", 1.5e-15, "as planck_into, one square more";
    DERIVATIVE_SCALAR: "planck_derivative_scalar", "relative, any x below 690", 1.5e-15, "two squares";
    RATIO: "planck_ratio_into", "relative, fused", 1.5e-15, "the cube of the ratio of frequencies; x − x₀ has two parts";
    RATIO_SCALAR: "planck_ratio_scalar", "relative", 1.5e-15, "as planck_ratio_into";
    MBB: "mbb_add", "relative over max(1, (|(3 + β) ln(ν/ν₀)| + |x − x₀|)/4), fused", 1.5e-15, "rounding of the exponent";
    MBB_INTENSITY: "mbb_intensity_into", "relative over max(1, (|β ln(ν/ν₀)| + x)/4), fused", 1.5e-15, "rounding of the exponent";
    UNIT: "Unit::from_mjysr", "relative", 2e-15, "as planck_derivative_scalar";
    BAND: "band_weights_into", "relative, band integral in every unit", 5e-15, "rounding of steps and of the sum";
}

// Fit of modified blackbodies.
tolerances! {
    MBB_FIT_EXACT: "fit_into", "T, τ relative, β absolute, noise-free", 2e-14, "rounding times the conditioning, worst at T = 60 K";
    MBB_FIT: "fit_into", "T, τ relative, β absolute, against scipy polished by Newton", 2e-14, "rounding of both";
}

// HEALPix: centres against 50 digits, weights against healpy.
tolerances! {
    HEALPIX_ANGLE: "healpix pix2ang", "ulp of θ, φ, sin θ", 2.5, "φ: a product with π/4 and a quotient; θ: the rounding of its sine";
    HEALPIX_Z: "healpix pix2vec", "ulp of z", 1.0, "one quotient in the belt; 1 − t, with t to 1.5 ulp, in the caps";
    HEALPIX_XY: "healpix pix2vec", "x, y over sin θ", 1.5e-15, "the rounding of φ, up to 8.9e-16 before 2π";
    HEALPIX_WEIGHTS: "healpix interp", "weights over nside", 2e-15, "the rounding of θ, 4e-16 before π, over the spacing of rings, about 1/nside";
}

// Spherical harmonic transforms: functions of l up to 8192 against 160 digits, relative to √((2l+1)/4π).
tolerances! {
    SHT_LEGENDRE_POLE: "sht::synthesis", "λ_lm, colatitudes 1e-11 to 0.01", 1e-10, "rounding of the recurrence's coefficients grows as the 3/2 power of l where nothing oscillates";
    SHT_LEGENDRE: "sht::synthesis", "λ_lm, colatitudes 0.01 to 1.57", 3e-13, "the same beside the equator, where the sum of two steps is small";
    SHT_WIGNER_POLE: "sht::wigner_synthesis", "X1, X2, colatitudes 1e-11 to 0.01", 1e-10, "as λ_lm";
    SHT_WIGNER: "sht::wigner_synthesis", "X1, X2, colatitudes 0.01 to 1.57", 1e-13, "as λ_lm";
    SHT_SHARED_RECURRENCE: "sht::spin2_coefficients", "X1, X2, colatitudes 0.03 to 1.57", 3e-13, "as λ_lm, divided by sin²θ";
}

// Galactic field, pitch objective, random numbers.
tolerances! {
    SIGHT: "ratios_into", "absolute, of Q/I and U/I, against the adaptive rule, any k, any edges", 1e-8, "the kink of |cos|³ between fixed nodes";
    SIGHT_MP: "ratios_into", "absolute, against mpmath", 3e-10, "as above";
    SIGHT_PORTABLE: "ratios_into", "absolute, portable against fused", 1e-15, "products are rounded";
    NORMAL: "normal::from_word", "ulp", 5.0, "polynomials of degree seven, unfused";
}

// Mode coupling.
tolerances! {
    WIGNER_3J: "wigner3j_into", "absolute, m = 0 and 2, l to 200", 1e-15, "rounding of the recurrence";
    WIGNER_3J_LARGE: "wigner3j_into", "Σ(2j+1)ff′ and f at j = 0 relative, l to 4096", 1e-14, "rounding of the recurrence over up to 8192 steps";
}

// Fourier transforms across lanes, direct sums.
tolerances! {
    FOURIER: "fourier::Fourier", "root mean square error over that of the result, n to 5000", 8e-16, "rounding of twiddles and butterflies, growing as the root of the number of passes";
    BELT: "sht::belt_spectrum_from_phases, pixels_from_belt", "root mean square error over that of the pixels, flat spectrum", 1e-15, "rounding of the transform and of e^{imφ₀}";
    CAP: "sht::cap_spectrum_from_phases, pixels_from_cap", "root mean square error over that of the pixels, flat spectrum", 6e-14, "aliasing of a window of 16 points; the highest harmonics grow twentyfold between the transforms";
    RESAMPLING: "sht::Resampling", "root mean square error over that of the series, flat spectrum, lmax to 300", 6e-14, "aliasing of a window of 16 points; the highest harmonics grow twentyfold between the transforms";
}
