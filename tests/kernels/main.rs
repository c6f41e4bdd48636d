//! Tests of the kernels, one module per topic.

mod belt;
mod cap;
mod column;
mod field;
mod fourier;
mod healpix;
mod math;
mod mbb_fit;
mod pitch;
mod planck;
mod random;
mod resampling;
mod root;
mod sht;
mod simd;
mod spectra;
mod split;
mod units;
