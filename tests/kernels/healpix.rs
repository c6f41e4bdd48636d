//! Tests of the kernels: healpix.

mod brute;
mod discs;
mod edges;
mod props;
mod resample;
mod tables;
