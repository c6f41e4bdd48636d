//! Eight f64 lanes on every machine, and the run-time choice of the instructions behind them.
//!
//! A kernel is written once, generic over [`Lanes`], as a safe `#[inline(always)]` function that takes the lane type's
//! token. [`Level`] is what the CPU can do; [`dispatch!`](crate::dispatch) enters the kernel compiled for it.
//!
//! | level | lanes | fused multiply-add |
//! | --- | --- | --- |
//! | portable | `wide::f64x8`: whatever the target was compiled for | only if compiled for it |
//! | avx2 | two 256-bit registers | yes |
//! | avx512 | one 512-bit register | yes |
//!
//! There are always eight lanes and one reduction tree, so AVX2 and AVX-512 give the same bits. The portable level
//! differs by the rounding of products where the target lacks FMA.
//!
//! ```
//! use dust3d_kernels::simd::{Lanes, Level};
//! use dust3d_kernels::dispatch;
//!
//! #[inline(always)]
//! fn sum_of_squares<L: Lanes>(token: L::Token, x: &[f64; 16]) -> f64 {
//!     let (chunks, _) = x.as_chunks::<8>();
//!     let mut sum = L::splat(token, 0.0);
//!     for chunk in chunks {
//!         let v = L::load(token, chunk);
//!         sum = v.mul_add(v, sum);
//!     }
//!     sum.reduce_sum()
//! }
//!
//! let sum = dispatch!(Level::detect(), |token: L| sum_of_squares::<L>(token, &[0.5; 16]));
//! assert_eq!(sum, 4.0);
//! ```

mod aligned;
pub(crate) mod atan;
mod lanes;
mod level;
pub mod math;
mod portable;
#[allow(unsafe_code, reason = "streaming stores of the back-ends")]
mod writer;

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code, reason = "the AVX2 back-end")]
mod avx2;
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code, reason = "the AVX-512 back-end")]
mod avx512;

pub use aligned::Aligned;
pub use lanes::{Bits, Lanes, Mask};
pub use level::Level;
#[doc(hidden)]
pub use level::Tokens;
pub use portable::{PortableLanes, PortableToken};
pub use writer::Stores;
pub(crate) use writer::Writer;
#[cfg(target_arch = "x86_64")]
pub use {
    avx2::{Avx2Lanes, Avx2Token},
    avx512::{Avx512Lanes, Avx512Token},
};

/// Runs an expression compiled for a [`Level`]: `dispatch!(level, |token: L| body::<L>(token, …))`.
///
/// `L` names the lane type and `token` its token inside the expression. The functions called must be
/// `#[inline(always)]` down to the lane operations, or they are compiled without the level's instructions.
#[macro_export]
macro_rules! dispatch {
    ($level:expr, |$token:ident: $L:ident| $body:expr) => {
        match $crate::simd::Level::tokens($level) {
            #[cfg(target_arch = "x86_64")]
            $crate::simd::Tokens::Avx512($token) => {
                type $L = $crate::simd::Avx512Lanes;
                $token.vectorize(
                    #[inline(always)]
                    || $body,
                )
            }
            #[cfg(target_arch = "x86_64")]
            $crate::simd::Tokens::Avx2($token) => {
                type $L = $crate::simd::Avx2Lanes;
                $token.vectorize(
                    #[inline(always)]
                    || $body,
                )
            }
            $crate::simd::Tokens::Portable($token) => {
                type $L = $crate::simd::PortableLanes;
                $body
            }
        }
    };
}
