//! Tests of the kernels: healpix.
