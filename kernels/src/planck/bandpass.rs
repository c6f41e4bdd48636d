//! Bandpasses: a table of frequencies and weights becomes the weights of the emission kernel, in any unit.
//!
//! A bandpass is a table (ν, w), w the response to power as PySM3 takes it, integrated by the trapezoid rule. What a
//! map of the band holds is, with I_ν in MJy/sr,
//!
//! | unit | value |
//! | --- | --- |
//! | MJy/sr | ∫ w I_ν dν / ∫ w dν |
//! | K_RJ | ∫ w I_ν dν / ∫ w (2kν²/c²) dν |
//! | K_CMB | ∫ w I_ν dν / ∫ w (∂B_ν/∂T)(T_CMB) dν |
//!
//! and the other units by powers of ten. All are linear in I_ν, so a band is a list of numbers a_k with value Σ a_k I_ν_k:
//! [`band_weights_into`] gives the a_k, [`crate::planck::mbb`] sums. Cost: once per band.

use crate::Error;
use crate::planck::spectrum;
use crate::units::{T_CMB, Unit, UnitKind};

/// The a_k of a band: its value in `unit` is Σ_k a_k I_ν_k with I in MJy/sr.
///
/// | argument | shape | unit | domain |
/// | --- | --- | --- | --- |
/// | `nu_ghz` | n ≥ 1 | GHz | increasing |
/// | `weight` | n | any | finite, of positive integral |
/// | `out` | n | | overwritten |
///
/// A table of one frequency is that frequency, whatever its (positive) weight. Scaling all weights changes nothing.
///
/// # Errors
/// [`Error::Length`] for an empty table or unequal lengths; [`Error::Domain`] for frequencies that are out of range or
/// do not increase, for weights that are not finite, and for a band without a positive integral.
///
/// # Source
/// \[MKD18\] leaves bands open; these are the conventions of PySM3 (Thorne et al., MNRAS 469, 2821, 2017), without its
/// removal of points of small weight.
///
/// # Example
/// ```
/// use dust3d_kernels::{planck::bandpass::band_weights_into, units::Unit};
/// let mut a = [0.0; 3];
/// band_weights_into(Unit::MJySr, &[340.0, 350.0, 370.0], &[1.0, 2.0, 1.0], &mut a)?;
/// // ∫w dν = 15 + 30: the weights of a constant sum to one.
/// assert_eq!(a, [5.0 / 45.0, 30.0 / 45.0, 10.0 / 45.0]);
/// # Ok::<(), dust3d_kernels::Error>(())
/// ```
pub fn band_weights_into(
    unit: Unit,
    nu_ghz: &[f64],
    weight: &[f64],
    out: &mut [f64],
) -> Result<(), Error> {
    let n = nu_ghz.len();
    if n == 0 {
        return Error::check_scratch("bandpass table", 1, 0);
    }
    Error::check_len("bandpass weights", n, weight.len())?;
    Error::check_len("out", n, out.len())?;
    for (k, &nu) in nu_ghz.iter().enumerate() {
        spectrum::check_frequency(nu)?;
        if k > 0 && nu_ghz.get(k - 1).is_none_or(|&before| before >= nu) {
            return Err(Error::Domain {
                what: "bandpass frequencies must increase",
                value: nu,
            });
        }
    }
    if let Some(&bad) = weight.iter().find(|w| !w.is_finite()) {
        return Err(Error::Domain {
            what: "bandpass weights must be finite",
            value: bad,
        });
    }
    // Largest weight 1, so that no scale of the table can over- or underflow.
    let largest = weight.iter().fold(0.0, |m: f64, w| m.max(w.abs()));
    let step = |k: usize| -> f64 {
        if n == 1 {
            return 1.0;
        }
        let at = |k: usize| nu_ghz.get(k).copied().unwrap_or(f64::NAN);
        0.5 * (at((k + 1).min(n - 1)) - at(k.saturating_sub(1)))
    };
    let mut total = 0.0;
    for (k, (&nu, &w)) in nu_ghz.iter().zip(weight).enumerate() {
        total += step(k) * (w / largest) * unit_brightness(unit, nu);
    }
    if !(total > 0.0 && total.is_finite()) {
        return Err(Error::Domain {
            what: "bandpass must have a positive integral",
            value: total,
        });
    }
    for (k, (out, &w)) in out.iter_mut().zip(weight).enumerate() {
        *out = step(k) * (w / largest) * unit.per_base() / total;
    }
    Ok(())
}

/// 1 MJy/sr, K_RJ or K_CMB in MJy/sr.
fn unit_brightness(unit: Unit, nu_ghz: f64) -> f64 {
    match unit.kind() {
        UnitKind::Brightness => 1.0,
        UnitKind::RayleighJeans => spectrum::rayleigh_jeans_scalar(nu_ghz),
        UnitKind::Cmb => spectrum::planck_derivative_scalar(nu_ghz, T_CMB),
    }
}
