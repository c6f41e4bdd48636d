//! How maps are stored: f32 or f64.

use crate::simd::Lanes;

mod sealed {
    /// Only f32 and f64 are storage.
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// How template and parameter maps are stored: f32 or f64. Arithmetic is f64 throughout.
pub trait Sample: sealed::Sealed + Copy {
    /// Eight values.
    #[doc(hidden)]
    fn load<L: Lanes>(token: L::Token, from: &[Self; 8]) -> L;
    /// Up to eight values; beyond the end of the slice they are 1.
    #[doc(hidden)]
    #[inline(always)]
    fn load_padded<L: Lanes>(token: L::Token, from: &[Self]) -> L {
        match from.first_chunk::<8>() {
            Some(chunk) => Self::load(token, chunk),
            None => {
                let mut a = [Self::ONE; 8];
                for (a, &x) in a.iter_mut().zip(from) {
                    *a = x;
                }
                Self::load(token, &a)
            }
        }
    }
    /// Asks for values that will be needed soon; nothing where the lanes cannot.
    #[doc(hidden)]
    #[inline(always)]
    fn prefetch<L: Lanes>(_token: L::Token, _from: &[Self]) {}
    /// 1.
    #[doc(hidden)]
    const ONE: Self;
}

impl Sample for f64 {
    #[inline(always)]
    fn prefetch<L: Lanes>(token: L::Token, from: &[Self]) {
        for line in from.as_chunks::<8>().0 {
            L::prefetch(token, line);
        }
    }
    const ONE: Self = 1.0;
    #[inline(always)]
    fn load<L: Lanes>(token: L::Token, from: &[Self; 8]) -> L {
        L::load(token, from)
    }
}

impl Sample for f32 {
    const ONE: Self = 1.0;
    #[inline(always)]
    fn load<L: Lanes>(token: L::Token, from: &[Self; 8]) -> L {
        L::load_f32(token, from)
    }
}
