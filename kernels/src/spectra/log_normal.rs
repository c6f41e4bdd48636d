//! Log-normal fluctuations of a positive field.
//!
//! x exp(κ g − κ²/2), g of unit variance: positive where x is, of mean x over realisations of a Gaussian g.

use crate::simd::math::exp;
use crate::simd::{Lanes, Level};
use crate::{Error, dispatch};

/// `out` = `field` · exp(`amplitude` `g` − `shift`): for g of mean 0 and variance 1, κ and κ²/2.
///
/// | argument | shape | domain |
/// | --- | --- | --- |
/// | `field`, `g`, `out` | equal | any; the result is finite where the arguments are and the exponent < 700 |
///
/// Accuracy: 2e-16 relative and the rounding of the exponent.
///
/// # Errors
/// [`Error::Length`] unless the slices have one length.
pub fn log_normal_into(
    level: Level,
    field: &[f64],
    g: &[f64],
    amplitude: f64,
    shift: f64,
    out: &mut [f64],
) -> Result<(), Error> {
    Error::check_len("g", field.len(), g.len())?;
    Error::check_len("out", field.len(), out.len())?;
    dispatch!(level, |token: L| body::<L>(
        token, field, g, amplitude, shift, out
    ));
    Ok(())
}

#[inline(always)]
fn body<L: Lanes>(
    token: L::Token,
    field: &[f64],
    g: &[f64],
    amplitude: f64,
    shift: f64,
    out: &mut [f64],
) {
    let amplitude = L::splat(token, amplitude);
    let minus_shift = L::splat(token, -shift);
    for ((field, g), out) in field.chunks(8).zip(g.chunks(8)).zip(out.chunks_mut(8)) {
        let exponent = L::load_padded(token, g, 0.0).mul_add(amplitude, minus_shift);
        (L::load_padded(token, field, 0.0) * exp::<L>(token, exponent)).store_padded(out);
    }
}
