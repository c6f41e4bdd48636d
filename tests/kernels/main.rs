//! Tests of the kernels, one module per topic.

mod field;
mod healpix;
mod mbb_fit;
mod pitch;
mod planck;
mod random;
mod sht;
mod simd;
mod spectra;
mod split;
mod units;
