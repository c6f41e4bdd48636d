//! Tests of the kernels: field.
