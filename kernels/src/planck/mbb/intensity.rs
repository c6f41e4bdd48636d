//! Intensity of one modified blackbody of given optical depth.

use super::MbbNode;
use crate::simd::math::{exp2, one_minus_exp2};
use crate::simd::{Lanes, Level};
use crate::units::TWO_H_OVER_C2;
use crate::{Error, dispatch};

/// Intensity of a modified blackbody of given optical depth.
///
/// out\[p\] = tau\[p\] · (ν/ν₀)^beta\[p\] · B_ν(t\[p\])
///
/// | argument | shape | unit | domain |
/// | --- | --- | --- | --- |
/// | `nu_ghz`, `nu0_ghz` | | GHz | 1e-30 … 1e30 |
/// | `tau`, `t`, `beta` | n_pix | at ν₀, K, 1 | T > 0; NaN = missing |
/// | `out` | n_pix | MJy/sr | overwritten |
///
/// A missing input leaves NaN. No scratch.
///
/// # Accuracy
/// A few 1e-15 relative, dominated by half an ulp of the exponent β ln(ν/ν₀) − x (tolerance table, row
/// `mbb_intensity`).
/// # Errors
/// [`Error::Length`] unless all slices are equally long; [`Error::Domain`] for the frequencies.
/// # Source
/// \[MKD18\], the single modified blackbody.
/// # Example
/// ```
/// use dust3d_kernels::{planck::{mbb::mbb_intensity_into, spectrum::planck_scalar}, simd::Level};
/// let mut i = [0.0];
/// mbb_intensity_into(Level::detect(), 353.0, 353.0, &[1e-5], &[20.0], &[1.6], &mut i)?;
/// assert!((i[0] / (1e-5 * planck_scalar(353.0, 20.0)) - 1.0).abs() < 1e-15);
/// # Ok::<(), dust3d_kernels::Error>(())
/// ```
pub fn mbb_intensity_into(
    level: Level,
    nu_ghz: f64,
    nu0_ghz: f64,
    tau: &[f64],
    t: &[f64],
    beta: &[f64],
    out: &mut [f64],
) -> Result<(), Error> {
    let node = MbbNode::new(nu_ghz, nu0_ghz, 1.0)?;
    Error::check_len("t", tau.len(), t.len())?;
    Error::check_len("beta", tau.len(), beta.len())?;
    Error::check_len("out", tau.len(), out.len())?;
    dispatch!(level, |token: L| intensity::<L>(
        token, &node, tau, t, beta, out
    ));
    Ok(())
}

#[inline(always)]
fn intensity<L: Lanes>(
    token: L::Token,
    node: &MbbNode,
    tau: &[f64],
    t: &[f64],
    beta: &[f64],
    out: &mut [f64],
) {
    let c = |v: f64| L::splat(token, v);
    let nu = node.nu_ghz;
    let front = c(TWO_H_OVER_C2 * nu * nu * nu);
    for ((out, tau), (t, beta)) in out
        .chunks_mut(8)
        .zip(tau.chunks(8))
        .zip(t.chunks(8).zip(beta.chunks(8)))
    {
        let [tau, t, beta] = [tau, t, beta].map(
            #[inline(always)]
            |from| L::load_padded(token, from, 1.0),
        );
        let inverse = L::select(t.gt(c(0.0)), c(1.0) / t, c(f64::NAN));
        let falling = c(node.decay) * inverse;
        let e = exp2(token, beta.mul_add(c(node.log2_ratio), falling));
        let d = one_minus_exp2(token, c(node.decay), inverse);
        (tau * front * e / d).store_padded(out);
    }
}
