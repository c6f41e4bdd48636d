//! Fits: the modified blackbody of a pixel, the pitch angle of the field, roots.
//!
//! | module | what is fitted |
//! | --- | --- |
//! | [`mbb`] | optical depth, temperature and spectral index of every pixel |
//! | [`l1`] | objective of the pitch angle of the field |
//! | [`search`] | minimum of a function of one variable: scan and golden section |

pub mod l1;
pub mod mbb;
mod root;
pub mod search;

pub use root::find_root;
