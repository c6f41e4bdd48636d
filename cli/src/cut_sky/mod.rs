//! Statistics on a part of the sky: masks, spectra of weighted maps, and their mode coupling undone.
//!
//! | module | what lives there |
//! | --- | --- |
//! | [`mask`] | weights from an intensity map, apodised edges |
//! | [`pseudo`] | spectra of weighted maps, with the f_sky correction |
//! | [`master`] | band powers with the coupling of multipoles and of E with B undone |

pub mod mask;
pub mod master;
pub mod pseudo;

pub use mask::Mask;
pub use master::{BandPowers, Master};
