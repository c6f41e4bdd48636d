//! Layers summed: all at once, or one added to what is there.

use super::node::common_reference;
use super::strip::{GROUP, sum_layers};
use super::{MbbNode, Sample};
use crate::planck::spectrum::decay;
use crate::simd::{Lanes, Level};
use crate::{Error, dispatch};

/// A layer: its templates at ν₀ and its law.
#[derive(Debug, Clone, Copy)]
pub struct MbbLayer<'a, E, const S: usize> {
    /// S maps of n_pix at ν₀, MJy/sr; for `S = 3`, I, Q, U. NaN = missing.
    pub templates: [&'a [E]; S],
    /// n_pix temperatures, K. T > 0; else NaN in every map.
    pub t: &'a [E],
    /// n_pix spectral indices.
    pub beta: &'a [E],
}

/// The sum of layers at any number of frequencies and bands, `S` Stokes parameters at once.
///
/// out\[S b + X\]\[p\] = Σ_layers templates\[X\]\[p\] · Σ_k a_bk (ν_bk/ν₀)^beta\[p\] B_ν(t\[p\])/B_ν₀(t\[p\])
///
/// | argument | shape | unit | domain |
/// | --- | --- | --- | --- |
/// | `bands` | n_band lists of [`MbbNode`], all of one ν₀ | | an empty list gives 0 |
/// | `layers` | any number of [`MbbLayer`], f32 or f64 | | summed in their order |
/// | `out` | n_band × S maps of n_pix, those of a band together | unit of the weights | overwritten |
///
/// The bits are those of zeros to which [`mbb_add_stokes`] adds layer after layer, the time is much less: every map is
/// passed once. No scratch; 25 kB of stack for `S = 3`. Fastest where maps begin at a multiple of 64 bytes.
///
/// # Accuracy
/// A few 1e-15 of each s (tolerance table, row `mbb_add`).
/// # Errors
/// [`Error::Length`] unless all maps are equally long and there are as many outputs as bands; [`Error::Domain`] if the
/// frequencies do not share their ν₀.
/// # Source
/// \[MKD18\], sections 4.1 and 6: the sum over the layers, each with its scaling law.
/// # Example
/// ```
/// use dust3d_kernels::{planck::mbb::{MbbLayer, MbbNode, mbb_layers_into}, simd::Level};
/// let near = MbbLayer { templates: [&[1.0_f32, 2.0]], t: &[20.0, 18.0], beta: &[1.5, 1.6] };
/// let far = MbbLayer { templates: [&[0.5_f32, 0.25]], t: &[19.0, 17.0], beta: &[1.6, 1.7] };
/// let reference = [MbbNode::new(353.0, 353.0, 1.0)?];
/// let mut map = [0.0; 2];
/// mbb_layers_into(Level::detect(), &[&reference], &[near, far], &mut [&mut map])?;
/// assert_eq!(map, [1.5, 2.25]);
/// # Ok::<(), dust3d_kernels::Error>(())
/// ```
pub fn mbb_layers_into<E: Sample, const S: usize>(
    level: Level,
    bands: &[&[MbbNode]],
    layers: &[MbbLayer<'_, E, S>],
    out: &mut [&mut [f64]],
) -> Result<(), Error> {
    sum(level, bands, layers, false, out)
}

/// One layer added to maps at any number of frequencies and bands, `S` Stokes parameters at once.
///
/// out\[S b + X\]\[p\] += templates\[X\]\[p\] · Σ_k a_bk (ν_bk/ν₀)^beta\[p\] B_ν(t\[p\])/B_ν₀(t\[p\])
///
/// | argument | shape | unit | domain |
/// | --- | --- | --- | --- |
/// | `bands` | n_band lists of [`MbbNode`], all of one ν₀ | | an empty list adds nothing |
/// | `templates` | S × n_pix, f32 or f64 | MJy/sr | NaN = missing |
/// | `t`, `beta` | n_pix, f32 or f64 | K, 1 | T > 0; else NaN in every map |
/// | `out` | n_band × S maps of n_pix, those of a band together | unit of the weights | accumulated, not cleared |
///
/// For `S = 3` the templates are I, Q, U. No scratch.
///
/// # Accuracy
/// A few 1e-15 of each s (tolerance table, row `mbb_add`); the reference bit for bit at ν = ν₀ with weight 1.
/// # Errors
/// [`Error::Length`] unless all maps are equally long and there are as many outputs as bands; [`Error::Domain`] if the
/// frequencies do not share their ν₀.
/// # Source
/// \[MKD18\], the scaling laws of the layers.
/// # Example
/// ```
/// use dust3d_kernels::{planck::mbb::{MbbNode, mbb_add_stokes}, simd::Level};
/// let i_ref = [1.0_f32, 2.0];
/// let (t, beta) = ([20.0_f32, 18.0], [1.5_f32, 1.6]);
/// let reference = [MbbNode::new(353.0, 353.0, 1.0)?];
/// let mut map = [0.0; 2];
/// mbb_add_stokes(Level::detect(), &[&reference], [&i_ref], &t, &beta, &mut [&mut map])?;
/// assert_eq!(map, [1.0, 2.0]);
/// # Ok::<(), dust3d_kernels::Error>(())
/// ```
pub fn mbb_add_stokes<E: Sample, const S: usize>(
    level: Level,
    bands: &[&[MbbNode]],
    templates: [&[E]; S],
    t: &[E],
    beta: &[E],
    out: &mut [&mut [f64]],
) -> Result<(), Error> {
    sum(level, bands, &[MbbLayer { templates, t, beta }], true, out)
}

fn sum<E: Sample, const S: usize>(
    level: Level,
    bands: &[&[MbbNode]],
    layers: &[MbbLayer<'_, E, S>],
    mut add: bool,
    out: &mut [&mut [f64]],
) -> Result<(), Error> {
    let n = match (layers.first(), out.first()) {
        (Some(layer), _) => layer.t.len(),
        (None, map) => map.map_or(0, |map| map.len()),
    };
    for layer in layers {
        Error::check_len("t", n, layer.t.len())?;
        Error::check_len("beta", n, layer.beta.len())?;
        for template in layer.templates {
            Error::check_len("template", n, template.len())?;
        }
    }
    check_outputs(bands.len() * S, n, out)?;
    let nu0_ghz = common_reference(bands)?;
    if !add && (layers.is_empty() || nu0_ghz.is_none()) {
        out.iter_mut().for_each(|map| map.fill(0.0));
    }
    let Some(nu0_ghz) = nu0_ghz else {
        return Ok(());
    };
    let decay0 = decay(nu0_ghz);
    for group in layers.chunks(GROUP) {
        dispatch!(level, |token: L| sum_layers::<L, E, S>(
            token, bands, decay0, group, add, out
        ));
        add = true;
    }
    Ok(())
}

/// Are there `count` maps of `n` pixels?
fn check_outputs(count: usize, n: usize, out: &[&mut [f64]]) -> Result<(), Error> {
    Error::check_len("maps of out", count, out.len())?;
    for map in out {
        Error::check_len("map of out", n, map.len())?;
    }
    Ok(())
}

/// I, Q, U of one layer added to maps at any number of frequencies and bands: [`mbb_add_stokes`] for `S = 3`.
///
/// # Errors
/// As [`mbb_add_stokes`].
pub fn mbb_add_iqu<E: Sample>(
    level: Level,
    bands: &[&[MbbNode]],
    iqu: [&[E]; 3],
    t: &[E],
    beta: &[E],
    out: &mut [&mut [f64]],
) -> Result<(), Error> {
    mbb_add_stokes::<E, 3>(level, bands, iqu, t, beta, out)
}

/// One template added to one map at one frequency: [`mbb_add_stokes`] for one node.
///
/// out\[p\] += a · template\[p\] · (ν/ν₀)^beta\[p\] · B_ν(t\[p\])/B_ν₀(t\[p\])
///
/// # Errors
/// [`Error::Length`] unless all slices are equally long.
pub fn mbb_add<E: Sample>(
    level: Level,
    node: &MbbNode,
    template: &[E],
    t: &[E],
    beta: &[E],
    out: &mut [f64],
) -> Result<(), Error> {
    let band = core::slice::from_ref(node);
    mbb_add_stokes::<E, 1>(level, &[band], [template], t, beta, &mut [out])
}

/// A layer of one temperature and one index added to maps: the law is a number, the kernel a multiplication.
///
/// out\[S b + X\]\[p\] += templates\[X\]\[p\] · Σ_k a_bk s_k(t, beta). Arguments, errors and treatment of missing values as
/// [`mbb_add_stokes`].
///
/// # Errors
/// As [`mbb_add_stokes`].
pub fn mbb_add_uniform<E: Sample, const S: usize>(
    level: Level,
    bands: &[&[MbbNode]],
    templates: [&[E]; S],
    t_kelvin: f64,
    beta: f64,
    out: &mut [&mut [f64]],
) -> Result<(), Error> {
    let n = templates.first().map_or(0, |template| template.len());
    for template in templates {
        Error::check_len("template", n, template.len())?;
    }
    check_outputs(bands.len() * S, n, out)?;
    common_reference(bands)?;
    for (band, maps) in bands.iter().zip(out.chunks_mut(S.max(1))) {
        let mut sum = 0.0;
        for node in *band {
            sum += node.weight * node.scaling_scalar(t_kelvin, beta);
        }
        for (template, map) in templates.iter().zip(maps.iter_mut()) {
            dispatch!(level, |token: L| add_scaled::<L, E>(
                token, sum, template, map
            ));
        }
    }
    Ok(())
}

/// out += a·x.
#[inline(always)]
fn add_scaled<L: Lanes, E: Sample>(token: L::Token, a: f64, x: &[E], out: &mut [f64]) {
    let a = L::splat(token, a);
    for (x, out) in x.chunks(8).zip(out.chunks_mut(8)) {
        E::load_padded::<L>(token, x)
            .mul_add(a, L::load_padded(token, out, 0.0))
            .store_padded(out);
    }
}
