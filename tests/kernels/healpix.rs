//! Tests of the kernels: healpix.

mod brute;
mod edges;
mod props;
mod resample;
mod tables;
