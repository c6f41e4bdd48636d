//! Random a_lm from the streams of the run's seed.

use crate::Error;
use dust3d_kernels::random::Stream;
use dust3d_kernels::random::normal::white_order_into;
use dust3d_kernels::sht::alm;
use num_complex::Complex;
use rayon::prelude::*;

/// What a stream of random numbers is for. The numbers are part of the meaning of a seed: never reuse or change one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// The built-in sky.
    BuiltinSky = 0,
    /// Small scales of intensity and polarisation.
    SmallScales = 1,
    /// Temperature and spectral-index maps.
    EmissionLaws = 2,
}

/// White Gaussian a_lm (⟨|a_lm|²⟩ = 1) of one field of a layer of a stage; the same up to any l for every `lmax`.
///
/// # Errors
/// If the layer or field number is out of the generator's range.
pub fn white_alm(
    seed: u64,
    stage: Stage,
    layer: usize,
    field: u32,
    lmax: usize,
) -> Result<Vec<Complex<f64>>, Error> {
    let layer = u32::try_from(layer).unwrap_or(u32::MAX);
    let mut stream = Stream::new(seed, stage as u32, layer, field)?;
    let mut alm = vec![Complex::new(0.0, 0.0); alm::len(lmax)];
    // Words come one after the other; turning them into normals is the work.
    let words: Vec<u64> = (0..2 * alm.len()).map(|_| stream.word()).collect();
    let mut orders = Vec::with_capacity(lmax + 1);
    let mut rest = alm.as_mut_slice();
    for m in 0..=lmax {
        let order;
        (order, rest) = rest.split_at_mut(lmax + 1 - m);
        orders.push(order);
    }
    orders
        .into_par_iter()
        .enumerate()
        .try_for_each(|(m, order)| white_order_into(&words, lmax, m, order))?;
    Ok(alm)
}
