//! Polarisation of each layer at ν₀ (\[MKD18\], section 4.2).
//!
//! Predicted: the field's polarisation fractions times the layer's intensity. Then the difference between the observed
//! and the predicted total is shared among the layers in proportion to their polarised intensity, and what exceeds
//! p_max in a layer goes to the others ([`dust3d_kernels::split`]), so that the layers add up to the observations.

use crate::Error;
use crate::parallel;
use dust3d_kernels::split::{Counts, renormalise_into, renormalise_scratch_len};
use rayon::prelude::*;

/// Q̃ (or Ũ) of every layer: `ratios` · `intensities`, in place of the ratios.
#[must_use]
pub fn predicted(mut ratios: Vec<Vec<f64>>, intensities: &[&[f64]]) -> Vec<Vec<f64>> {
    for (ratio, intensity) in ratios.iter_mut().zip(intensities) {
        ratio
            .par_iter_mut()
            .zip(*intensity)
            .for_each(|(r, i)| *r *= i);
    }
    ratios
}

/// Makes the predicted layers `q`, `u` add up to the observed maps, in place.
///
/// # Errors
/// If a map has another length than the others, or `p_max` is negative.
pub fn renormalise(
    q: &mut Vec<Vec<f64>>,
    u: &mut Vec<Vec<f64>>,
    intensities: &[&[f64]],
    (q_obs, u_obs): (&[f64], &[f64]),
    p_max: f64,
) -> Result<Counts, Error> {
    let layers = q.len();
    let mut maps = std::mem::take(q);
    maps.append(u);
    let results = parallel::for_columns(&mut maps, |range, mut maps| {
        let (q, u) = maps.split_at_mut(layers);
        let intensity: Vec<&[f64]> = intensities.iter().map(|i| &i[range.clone()]).collect();
        let mut scratch = vec![0.0; renormalise_scratch_len(layers)];
        let observed = (&q_obs[range.clone()], &u_obs[range]);
        renormalise_into(
            p_max,
            &intensity,
            observed.0,
            observed.1,
            q,
            u,
            &mut scratch,
        )
    });
    *u = maps.split_off(layers);
    *q = maps;
    let mut counts = Counts::default();
    for result in results {
        counts += result?;
    }
    Ok(counts)
}
