//! Fits: the modified blackbody of a pixel, the pitch angle of the field.

pub mod l1;
pub mod search;
