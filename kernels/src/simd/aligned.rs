//! Vectors of eight on cache lines of their own.

/// N vectors of eight, each on its own cache line: unaligned ones would straddle two, at half the speed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Aligned<const N: usize>(pub [[f64; 8]; N]);

impl<const N: usize> Default for Aligned<N> {
    fn default() -> Self {
        Self([[0.0; 8]; N])
    }
}

impl<const N: usize> core::ops::Deref for Aligned<N> {
    type Target = [[f64; 8]; N];
    #[inline(always)]
    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl<const N: usize> core::ops::DerefMut for Aligned<N> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}
