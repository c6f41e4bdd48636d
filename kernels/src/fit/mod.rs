//! Fits: the modified blackbody of a pixel, the pitch angle of the field, roots.

mod root;

pub use root::find_root;
