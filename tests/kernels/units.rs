//! Tests of the kernels: units.
