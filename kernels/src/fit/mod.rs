//! Fits: the modified blackbody of a pixel, the pitch angle of the field, roots.
//!
//! | module | what is fitted |
//! | --- | --- |
//! | [`mbb`] | optical depth, temperature and spectral index of every pixel |

pub mod mbb;
mod root;

pub use root::find_root;
