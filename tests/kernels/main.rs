//! Tests of the kernels, one module per topic.

mod simd;
