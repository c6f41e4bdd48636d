//! Tests of the kernels: pitch.
