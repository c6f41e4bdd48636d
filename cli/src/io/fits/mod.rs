//! HEALPix maps in FITS files: read as the programs of the field write them, written as they read them.
//!
//! The reader is our own: strict, streaming, and indifferent to what a damaged header announces. No library at hand is all
//! three.
//!
//! # What is read
//!
//! | | |
//! | --- | --- |
//! | place | binary tables with any number of columns and rows, images of 12 Nside² elements (or several planes of them); gzip |
//! | types | `E D I J K B L` with any repeat count; TSCALn, TZEROn, TNULLn |
//! | pixels | RING and NESTED; all, a run (FIRSTPIX … LASTPIX) or a list (INDXSCHM = EXPLICIT or OBJECT = PARTIAL) |
//! | missing | NaN, −1.6375e30, BAD_DATA, TNULLn, what a list leaves out |
//! | units | TUNITn, converted to the unit of the [`Role`](super::Role); `[unit=…]` in place of one that is wrong or ambiguous |
//! | polarisation | POLCCONV = IAU has its U turned to COSMO |
//! | coordinates | COORDSYS; equatorial and ecliptic maps are turned to Galactic through harmonic coefficients, Q and U together |
//!
//! [`Selection`] says how one map of several is named. [`mod@write`] puts maps, harmonic coefficients and spectra into files
//! that differ in no byte from run to run.

mod bandpass;
mod card;
mod choose;
mod column;
mod frame;
mod hdu;
mod header;
mod pixels;
mod place;
mod read;
mod rows;
mod select;
mod sky;
mod stream;
pub mod write;

pub(super) use bandpass::read_bandpass;
pub use frame::Frame;
pub use read::{read, read_bytes};
pub use select::Selection;
pub(super) use select::parse;
