//! Modified blackbodies: templates of layers carried to any list of frequencies and bands in one pass.
//!
//! X_ν = Σ_layers X_ν₀ s_ν, s_ν = (ν/ν₀)^β B_ν(T)/B_ν₀(T) for X = I, Q, U \[MKD18\], with T and β maps of the layer.
//!
//! | module | |
//! | --- | --- |
//! | `node` | [`MbbNode`], a frequency of a band |
//! | `sample` | [`Sample`], f32 or f64 |
//! | `layers` | [`mbb_layers_into`], [`mbb_add_stokes`] and shorter forms, [`mbb_add_uniform`] |
//! | `strip` | what they do: a strip of pixels of all layers at all bands |
//! | `intensity` | [`mbb_intensity_into`]: from an optical depth |
//!
//! # Method
//! With x = hν/kT,
//!
//! ```text
//! s_ν = 2^((3 + β) log₂(ν/ν₀) + (x₀ − x) log₂ e) · (1 − e^−x₀) / (1 − e^−x)
//!
//! for each strip of 64 pixels:
//!     for each layer:
//!         1/T, 3 + β, 1 − e^−x₀, X_ν₀          once: shared by all bands, side by side in the nearest cache
//!     for each band b, 32 pixels at a time:
//!         for each layer:
//!             S = Σ_k a_bk s_k                 two exponentials and a division per frequency
//!             sum[X] += X_ν₀ · S               for X = I, Q, U
//!         out[b][X] = sum[X]
//! ```
//!
//! * Numerators and denominators are between 0 and 1 and the exponent is a difference, so nothing overflows before s does
//!   and nothing vanishes that should not; 1 − e^−x keeps its digits for small x.
//! * Powers of two and not of e: log₂ e goes into the constants of a frequency, and the reduction of the argument is
//!   exact without further care.
//! * The emission law is the same for I, Q and U: evaluated once for the three.
//! * The sum over a band is taken on s, in registers.
//! * Every input is read once and every output written once, however many layers and bands there are. Maps of a power of
//!   two of pixels lie at the same place of a page and so compete for the same few ways of the cache: what the bands
//!   share is copied out of them, and bands are written one after the other, three maps at a time.
//! * Memory works while this computes: maps are asked for a strip ahead of use, those of the layers spread over the bands. With one
//!   band nothing is shared, and nothing is copied.
//! * At ν = ν₀ the exponent is 0 and the quotient 1 exactly, so a weight of 1 adds the template bit for bit.
//!
//! # Accuracy
//! s to a few 1e-15 relative: half an ulp of the exponent, which is |(3 + β) ln(ν/ν₀) + x₀ − x|·1.1e-16, dominates.
//! Measured figures: `tests/support/tolerance.rs`, rows `mbb…`. Sums over layers are taken in their order: the result is
//! that of adding one layer after the other, bit for bit, and a pixel's does not depend on its place in the map.
//!
//! # Missing values
//! A NaN in a template, T or β, and T that is not positive, give NaN in the maps they enter, at ν₀ too.

mod intensity;
mod layers;
mod node;
mod sample;
mod strip;

pub use intensity::mbb_intensity_into;
pub use layers::{
    MbbLayer, mbb_add, mbb_add_iqu, mbb_add_stokes, mbb_add_uniform, mbb_layers_into,
};
pub use node::MbbNode;
pub use sample::Sample;
