//! Pixels that were not observed.

/// Written in a pixel without a value; HEALPix's own convention.
pub const MISSING: f64 = -1.6375e30;

/// Is this the value of a missing pixel: NaN, or [`MISSING`] to 1e-5 (a value that went through f32)?
#[must_use]
#[inline]
pub fn is_missing(value: f64) -> bool {
    let within = (-1.6375e30 * (1.0 + 1e-5)..=-1.6375e30 * (1.0 - 1e-5)).contains(&value);
    within || value.is_nan()
}
