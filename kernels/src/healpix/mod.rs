//! HEALPix: equal-area pixels on rings of constant latitude (\[G05\]).
//!
//! | module | what lives there |
//! | --- | --- |
//! | [`layout`] | the rings: first pixel, length, latitude, first longitude |
//! | [`ring`], [`nested`] | pixel ↔ direction and neighbours, in either order |
//! | [`interp`] | bilinear interpolation weights |
//! | [`disc`] | the pixels of a disc, as ranges of pixel numbers |
//! | [`resample`] | whole maps to another resolution or order |
//! | [`missing`] | the value of a pixel that was not observed |
//!
//! Directions are (θ, φ) in radians, θ from the north pole; vectors; or a [`Location`], (z, sin θ, φ), which keeps its
//! digits next to the poles, where z = cos θ alone loses half of them.
//!
//! RING order exists for every Nside from 1 to 2²⁹. NESTED order needs a power of two and answers
//! [`Error::Nside`](crate::Error::Nside) otherwise.
//!
//! Functions on slices are called `…_into`; they check all of their input first and write nothing if any of it is bad.
//!
//! # Accuracy
//! Angles and coordinates of a pixel centre are those of exact arithmetic to a few units in the last place (rows
//! `healpix_*` of the tolerance table), at every Nside and up to the poles; a pixel centre therefore comes back to its
//! own pixel, up to Nside 2²⁹. A direction goes to the pixel that holds it unless it lies within its own rounding of an
//! edge, where either neighbour may be the answer.

pub mod disc;
mod faces;
pub mod interp;
pub mod layout;
mod location;
pub mod missing;
mod neighbours;
pub mod nested;
mod nside;
mod order;
mod points;
pub mod resample;
pub mod ring;
mod vector;

pub use faces::NO_PIXEL;
pub use location::Location;
pub use nside::Nside;
pub use order::{nest2ring, nest2ring_into, ring2nest, ring2nest_into};
