//! Modified blackbodies: templates of a layer carried to any list of frequencies and bands in one pass.
//!
//! X_ν = X_ν₀ s_ν, s_ν = (ν/ν₀)^β B_ν(T)/B_ν₀(T) for X = I, Q, U \[MKD18\], with T and β maps of the layer.
//!
//! # Method
//! With x = hν/kT,
//!
//! ```text
//! s_ν = 2^((3 + β) log₂(ν/ν₀) + (x₀ − x) log₂ e) · (1 − e^−x₀) / (1 − e^−x)
//!
//! for each eight pixels:
//!     1/T, 1 − e^−x₀                       once: shared by all frequencies
//!     for each band b:
//!         S = Σ_k a_bk s_k                 two exponentials and a division per frequency
//!         out[b][X] += X_ν₀ · S            for X = I, Q, U
//! ```
//!
//! * Numerators and denominators are between 0 and 1 and the exponent is a difference, so nothing overflows before s does
//!   and nothing vanishes that should not; 1 − e^−x keeps its digits for small x.
//! * Powers of two and not of e: log₂ e goes into the constants of a frequency, and the reduction of the argument is
//!   exact without further care.
//! * The emission law is the same for I, Q and U: evaluated once for the three.
//! * The sum over a band is taken on s, in registers: the templates are read once however many frequencies there are.
//! * At ν = ν₀ the exponent is 0 and the quotient 1 exactly, so a weight of 1 adds the template bit for bit.
//!
//! Callers with several layers should walk the sky in chunks of some thousand pixels and add all layers to one chunk, so
//! that the output stays in cache.
//!
//! # Accuracy
//! s to a few 1e-15 relative: half an ulp of the exponent, which is |(3 + β) ln(ν/ν₀) + x₀ − x|·1.1e-16, dominates.
//! Measured figures: `tests/support/tolerance.rs`, rows `mbb…`.
//!
//! # Missing values
//! A NaN in a template, T or β, and T that is not positive, give NaN in the maps they enter, at ν₀ too.

use super::spectrum::{check_frequency, decay, x_difference, x_kelvin};
use crate::simd::math::{exp2, one_minus_exp2};
use crate::simd::{Lanes, Level};
use crate::units::TWO_H_OVER_C2;
use crate::{Error, dispatch, scalar};
use core::ops::Range;

mod sealed {
    /// Only f32 and f64 are storage.
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// How template and parameter maps are stored: f32 or f64. Arithmetic is f64 throughout.
pub trait Sample: sealed::Sealed + Copy {
    /// Eight values.
    #[doc(hidden)]
    fn load<L: Lanes>(token: L::Token, from: &[Self; 8]) -> L;
    /// Up to eight values; beyond the end of the slice they are 1.
    #[doc(hidden)]
    #[inline(always)]
    fn load_padded<L: Lanes>(token: L::Token, from: &[Self]) -> L {
        match from.first_chunk::<8>() {
            Some(chunk) => Self::load(token, chunk),
            None => {
                let mut a = [Self::ONE; 8];
                for (a, &x) in a.iter_mut().zip(from) {
                    *a = x;
                }
                Self::load(token, &a)
            }
        }
    }
    /// Asks for values that will be needed soon; nothing where the lanes cannot.
    #[doc(hidden)]
    #[inline(always)]
    fn prefetch<L: Lanes>(_token: L::Token, _from: &[Self]) {}
    /// 1.
    #[doc(hidden)]
    const ONE: Self;
}

impl Sample for f64 {
    #[inline(always)]
    fn prefetch<L: Lanes>(token: L::Token, from: &[Self]) {
        for line in from.as_chunks::<8>().0 {
            L::prefetch(token, line);
        }
    }
    const ONE: Self = 1.0;
    #[inline(always)]
    fn load<L: Lanes>(token: L::Token, from: &[Self; 8]) -> L {
        L::load(token, from)
    }
}

impl Sample for f32 {
    const ONE: Self = 1.0;
    #[inline(always)]
    fn load<L: Lanes>(token: L::Token, from: &[Self; 8]) -> L {
        L::load_f32(token, from)
    }
}

/// One frequency of a band, prepared: what depends on ν alone, and its weight a.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MbbNode {
    nu_ghz: f64,
    nu0_ghz: f64,
    weight: f64,
    /// log₂(ν/ν₀).
    log2_ratio: f64,
    /// −hν/k log₂ e, K.
    decay: f64,
    /// h(ν₀ − ν)/k log₂ e, K.
    decay_difference: f64,
}

impl MbbNode {
    /// The frequency `nu_ghz` of templates given at `nu0_ghz`, with weight `weight`: the factor of the unit for a single
    /// frequency, a number of [`crate::planck::bandpass::band_weights_into`] in a band, 1 for MJy/sr.
    ///
    /// # Errors
    /// [`Error::Domain`] unless both frequencies lie in 1e-30 … 1e30 GHz.
    pub fn new(nu_ghz: f64, nu0_ghz: f64, weight: f64) -> Result<Self, Error> {
        check_frequency(nu_ghz)?;
        check_frequency(nu0_ghz)?;
        let (difference, rest) = x_difference(nu_ghz, nu0_ghz);
        Ok(Self {
            nu_ghz,
            nu0_ghz,
            weight,
            log2_ratio: scalar::log2(nu_ghz / nu0_ghz),
            decay: decay(nu_ghz),
            decay_difference: (difference + rest) * core::f64::consts::LOG2_E,
        })
    }

    /// The frequency, GHz.
    #[must_use]
    pub const fn nu_ghz(&self) -> f64 {
        self.nu_ghz
    }

    /// The frequency of the templates, GHz.
    #[must_use]
    pub const fn nu0_ghz(&self) -> f64 {
        self.nu0_ghz
    }

    /// The weight in its band.
    #[must_use]
    pub const fn weight(&self) -> f64 {
        self.weight
    }

    /// s_ν = (ν/ν₀)^β B_ν(T)/B_ν₀(T), without the weight; NaN for T that is not positive.
    #[must_use]
    pub fn scaling_scalar(&self, t_kelvin: f64, beta: f64) -> f64 {
        if t_kelvin.is_nan() || t_kelvin <= 0.0 {
            return f64::NAN;
        }
        let x = x_kelvin(self.nu_ghz).0 / t_kelvin;
        let x0 = x_kelvin(self.nu0_ghz).0 / t_kelvin;
        let exponent = (beta + 3.0) * self.log2_ratio + self.decay_difference / t_kelvin;
        scalar::exp2(exponent) * (scalar::expm1(-x0) / scalar::expm1(-x))
    }
}

/// Vectors worked on together: their chains of operations are independent, the constants of a frequency are loaded once
/// for all, and what is kept of them stays in the nearest cache.
const BLOCK: usize = 4;

/// Maps are asked for so many pixels ahead: hardware does not look beyond a page, which is 512 of them.
const AHEAD: usize = 128;

/// What the frequencies share at up to 8 · [`BLOCK`] pixels.
struct Block<L> {
    /// Vectors in use.
    used: usize,
    /// 1/T, NaN where T is not positive.
    inverse_t: [L; BLOCK],
    /// 3 + β.
    slope: [L; BLOCK],
    /// 1 − e^−x₀.
    d0: [L; BLOCK],
}

impl<L: Lanes> Block<L> {
    #[inline(always)]
    fn new<E: Sample>(token: L::Token, decay0: f64, t: &[E], beta: &[E]) -> Self {
        let c = |v: f64| L::splat(token, v);
        let mut block = Self {
            used: t.len().div_ceil(8).min(BLOCK),
            inverse_t: [c(0.0); BLOCK],
            slope: [c(0.0); BLOCK],
            d0: [c(0.0); BLOCK],
        };
        for ((((inverse_t, slope), d0), t), beta) in block
            .inverse_t
            .iter_mut()
            .zip(&mut block.slope)
            .zip(&mut block.d0)
            .zip(t.chunks(8))
            .zip(beta.chunks(8))
        {
            let t = E::load_padded::<L>(token, t);
            *inverse_t = L::select(t.gt(c(0.0)), c(1.0) / t, c(f64::NAN));
            *slope = E::load_padded::<L>(token, beta) + c(3.0);
            *d0 = one_minus_exp2(token, c(decay0), *inverse_t);
        }
        block
    }

    /// Σ_k a_k s_k of the vectors in use.
    #[inline(always)]
    fn band(&self, token: L::Token, band: &[MbbNode], sums: &mut [L; BLOCK]) {
        if let Some((first, others)) = band.split_first() {
            // The first is no addition to zero: at ν₀ with weight 1 the sum is 1.
            self.node(
                token,
                first,
                sums,
                #[inline(always)]
                |s, weight, _| s * weight,
            );
            for node in others {
                self.node(
                    token,
                    node,
                    sums,
                    #[inline(always)]
                    |s, weight, sum| s.mul_add(weight, sum),
                );
            }
        }
    }

    /// Puts the s of one frequency into the sums.
    #[inline(always)]
    fn node(
        &self,
        token: L::Token,
        node: &MbbNode,
        sums: &mut [L; BLOCK],
        join: impl Fn(L, L, L) -> L,
    ) {
        let c = |v: f64| L::splat(token, v);
        let (log2_ratio, decay) = (c(node.log2_ratio), c(node.decay));
        let (difference, weight) = (c(node.decay_difference), c(node.weight));
        for (((sum, inverse_t), slope), d0) in sums
            .iter_mut()
            .zip(&self.inverse_t)
            .zip(&self.slope)
            .zip(&self.d0)
            .take(self.used)
        {
            let exponent = slope.mul_add(log2_ratio, difference * *inverse_t);
            let d = one_minus_exp2(token, decay, *inverse_t);
            let s = exp2(token, exponent) * (*d0 / d);
            *sum = join(s, weight, *sum);
        }
    }
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
    let n = t.len();
    Error::check_len("beta", n, beta.len())?;
    for template in templates {
        Error::check_len("template", n, template.len())?;
    }
    check_outputs(bands.len() * S, n, out)?;
    let Some(nu0_ghz) = common_reference(bands)? else {
        return Ok(());
    };
    let decay0 = decay(nu0_ghz);
    dispatch!(level, |token: L| add_stokes::<L, E, S>(
        token, bands, decay0, templates, t, beta, out
    ));
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

/// ν₀ of all nodes; none if there is no node.
fn common_reference(bands: &[&[MbbNode]]) -> Result<Option<f64>, Error> {
    let mut found = None;
    for node in bands.iter().copied().flatten() {
        match found {
            None => found = Some(node.nu0_ghz),
            Some(nu0) if nu0 == node.nu0_ghz => {}
            Some(_) => {
                return Err(Error::Domain {
                    what: "reference frequency must be the same for all bands",
                    value: node.nu0_ghz,
                });
            }
        }
    }
    Ok(found)
}

#[inline(always)]
fn add_stokes<L: Lanes, E: Sample, const S: usize>(
    token: L::Token,
    bands: &[&[MbbNode]],
    decay0: f64,
    templates: [&[E]; S],
    t: &[E],
    beta: &[E],
    out: &mut [&mut [f64]],
) {
    let n = t.len();
    let mut sums = [L::splat(token, 0.0); BLOCK];
    for start in (0..n).step_by(8 * BLOCK) {
        let range = start..n.min(start + 8 * BLOCK);
        let ahead = start + AHEAD..start + AHEAD + 8 * BLOCK;
        E::prefetch::<L>(token, part(t, &ahead));
        E::prefetch::<L>(token, part(beta, &ahead));
        for template in templates {
            E::prefetch::<L>(token, part(template, &ahead));
        }
        let block = Block::<L>::new(token, decay0, part(t, &range), part(beta, &range));
        for (band, maps) in bands.iter().zip(out.chunks_mut(S.max(1))) {
            if band.is_empty() {
                continue;
            }
            block.band(token, band, &mut sums);
            for (template, map) in templates.iter().zip(maps) {
                let from = part(template, &range);
                let to = map.get_mut(range.clone()).unwrap_or(&mut []);
                add_products::<L, E>(token, &sums, from, to);
            }
        }
    }
}

/// to += from · sums.
#[inline(always)]
fn add_products<L: Lanes, E: Sample>(
    token: L::Token,
    sums: &[L; BLOCK],
    from: &[E],
    to: &mut [f64],
) {
    let (from, from_rest) = from.as_chunks::<8>();
    let (to, to_rest) = to.as_chunks_mut::<8>();
    for ((from, to), sum) in from.iter().zip(to.iter_mut()).zip(sums) {
        E::load::<L>(token, from)
            .mul_add(*sum, L::load(token, to))
            .store(to);
    }
    if let Some(sum) = sums.get(from.len())
        && !to_rest.is_empty()
    {
        E::load_padded::<L>(token, from_rest)
            .mul_add(*sum, L::load_padded(token, to_rest, 0.0))
            .store_padded(to_rest);
    }
}

/// The pixels `range` of a map; none if it has none of them.
#[inline(always)]
fn part<'a, E>(map: &'a [E], range: &Range<usize>) -> &'a [E] {
    map.get(range.clone()).unwrap_or(&[])
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
