//! Tests of the kernels: random.
