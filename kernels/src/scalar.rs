//! Scalar mathematics: the only door to `libm`.
//!
//! `core` has no transcendental functions, and with `std` linked the platform's would slip in and give other bits on
//! other machines. Everything scalar goes through here; vector code uses [`crate::simd`].

pub use libm::{
    acos, asin, asinh, atan, atan2, cbrt, cos, cosh, exp, exp2, expm1, fabs as abs, floor, fma,
    hypot, log as ln, log1p as ln_1p, log2, pow, rint, sin, sincos as sin_cos, sinh, sqrt, tan,
    tanh,
};
