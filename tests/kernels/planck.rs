//! Tests of the kernels: planck.
