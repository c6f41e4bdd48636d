//! Tests of the kernels: sht.
