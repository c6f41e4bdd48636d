//! FITS files out: maps, harmonic coefficients, spectra.
//!
//! Every function gives the bytes of a whole file to a sink, in order, a block or a row at a time. They depend on the
//! arguments alone: there is no date in them.

mod cards;
mod harmonics;
mod map;
mod provenance;
mod table;

pub use harmonics::{alm, spectra};
pub use map::{MapColumn, MapTable, map};
pub use provenance::Provenance;
