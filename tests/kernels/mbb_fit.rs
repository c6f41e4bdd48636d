//! Tests of the kernels: mbb_fit.
