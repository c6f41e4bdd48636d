//! Residual sharing and cap over ranges of pixels.

use super::cap::{Outcome, pixel_scratch_len, renormalise_pixel};
use crate::Error;

/// Pixels by outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Pixels in which some layer was above its cap and now none is; infeasible ones are not among them.
    pub capped: u64,
    /// Pixels that no split brings under the caps.
    pub infeasible: u64,
    /// Pixels with an input that is not finite.
    pub missing: u64,
}

impl core::ops::AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.capped += other.capped;
        self.infeasible += other.infeasible;
        self.missing += other.missing;
    }
}

/// Length of the scratch of [`renormalise_into`].
#[must_use]
pub const fn renormalise_scratch_len(n_layers: usize) -> usize {
    pixel_scratch_len(n_layers) + 3 * n_layers
}

/// Shares the residual and caps the polarisation of every pixel of a range.
///
/// | argument | shape | unit | what |
/// | --- | --- | --- | --- |
/// | `p_max` | 1 | 1 | largest polarisation fraction, 0 or above |
/// | `intensity` | N slices of n_pix | MJy/sr | I^i ≥ 0 |
/// | `q_obs`, `u_obs` | n_pix | MJy/sr | the observation |
/// | `q`, `u` | N slices of n_pix | MJy/sr | in: the prediction (Q̃, Ũ)^i; out: the split |
/// | `scratch` | ≥ [`renormalise_scratch_len`]`(N)` | | contents ignored, left dirty |
///
/// Pixels do not know of each other, so threads may take ranges. A pixel with an input that is not finite becomes NaN
/// in all layers. N may be any number above zero.
///
/// # Accuracy
/// That of [`renormalise_pixel`].
/// # Errors
/// [`Error::Length`] or [`Error::Domain`]; nothing has been written then.
/// # Source
/// \[MKD18\], section 4.2; the redistribution made precise in [`super::cap`].
pub fn renormalise_into(
    p_max: f64,
    intensity: &[&[f64]],
    q_obs: &[f64],
    u_obs: &[f64],
    q: &mut [&mut [f64]],
    u: &mut [&mut [f64]],
    scratch: &mut [f64],
) -> Result<Counts, Error> {
    let (n, pixels) = (intensity.len(), q_obs.len());
    Error::check_domain(
        "p_max (0 or above)",
        p_max,
        p_max >= 0.0 && p_max.is_finite(),
    )?;
    Error::check_scratch("intensity (layers)", 1, n)?;
    Error::check_len("q (layers)", n, q.len())?;
    Error::check_len("u (layers)", n, u.len())?;
    Error::check_len("u_obs", pixels, u_obs.len())?;
    for map in intensity {
        Error::check_len("a layer of intensity", pixels, map.len())?;
    }
    for map in q.iter().chain(u.iter()) {
        Error::check_len("a layer of q or u", pixels, map.len())?;
    }
    Error::check_scratch("scratch", renormalise_scratch_len(n), scratch.len())?;
    let (layers, work) = scratch.split_at_mut(3 * n);
    let (i_pixel, layers) = layers.split_at_mut(n);
    let (q_pixel, u_pixel) = layers.split_at_mut(n);
    let mut counts = Counts::default();
    for (pixel, (&q_obs, &u_obs)) in q_obs.iter().zip(u_obs).enumerate() {
        let value = |map: &[f64]| map.get(pixel).copied().unwrap_or(f64::NAN);
        for (x, map) in i_pixel.iter_mut().zip(intensity) {
            *x = value(map);
        }
        for (x, map) in q_pixel.iter_mut().zip(&*q) {
            *x = value(map);
        }
        for (x, map) in u_pixel.iter_mut().zip(&*u) {
            *x = value(map);
        }
        match renormalise_pixel(p_max, i_pixel, [q_obs, u_obs], q_pixel, u_pixel, work) {
            Outcome::Kept => {}
            Outcome::Capped => counts.capped += 1,
            Outcome::Infeasible => counts.infeasible += 1,
            Outcome::Missing => counts.missing += 1,
        }
        let put = |maps: &mut [&mut [f64]], values: &[f64]| {
            for (map, &value) in maps.iter_mut().zip(values) {
                if let Some(x) = map.get_mut(pixel) {
                    *x = value;
                }
            }
        };
        put(q, q_pixel);
        put(u, u_pixel);
    }
    Ok(counts)
}
