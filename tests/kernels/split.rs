//! Tests of the kernels: split.
