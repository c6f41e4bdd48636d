//! Results written through the caches or past them.
//!
//! A store to a line that is not in cache reads it first, and later pushes out another. Where whole lines are written and
//! the results are larger than the caches, so that nobody finds them there, streaming stores save both: a third of the
//! traffic of what is written once and read once. They may become visible late, even to a thread that has been told that
//! the work is done; a fence orders them. [`Writer`] holds the memory until its fence.

use super::aligned::Aligned;
use super::lanes::Lanes;

/// How results are written. Their bits are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stores {
    /// Through the caches: for what is read soon.
    #[default]
    Cached,
    /// Past the caches: for results too large for them.
    Streamed,
}

/// Entries by their number.
pub(crate) trait Entries<const N: usize> {
    fn entry(&mut self, at: usize) -> Option<&mut Aligned<N>>;
}

impl<const N: usize> Entries<N> for [Aligned<N>] {
    #[inline(always)]
    fn entry(&mut self, at: usize) -> Option<&mut Aligned<N>> {
        self.get_mut(at)
    }
}

/// K at a time, wherever they are.
impl<const N: usize, const K: usize> Entries<N> for [&mut [Aligned<N>; K]] {
    #[inline(always)]
    fn entry(&mut self, at: usize) -> Option<&mut Aligned<N>> {
        self.get_mut(at / K)?.get_mut(at % K)
    }
}

/// Memory to be written, and nothing else done with it until the writer is dropped.
pub(crate) struct Writer<'a, L: Lanes, T: ?Sized> {
    token: L::Token,
    to: &'a mut T,
    stores: Stores,
}

impl<'a, L: Lanes, T: ?Sized> Writer<'a, L, T> {
    #[inline(always)]
    pub(crate) fn new(token: L::Token, to: &'a mut T, stores: Stores) -> Self {
        Self { token, to, stores }
    }

    /// Writes entry `at`; None if there is no such entry.
    #[inline(always)]
    pub(crate) fn put<const N: usize>(&mut self, at: usize, values: [L; N]) -> Option<()>
    where
        T: Entries<N>,
    {
        let to = self.to.entry(at)?;
        match self.stores {
            Stores::Cached => {
                for k in 0..N {
                    values[k].store(&mut to[k]);
                }
            }
            // SAFETY: the memory is borrowed for as long as the writer lives, and its end is a fence.
            Stores::Streamed => unsafe { L::stream(values, to) },
        }
        Some(())
    }
}

impl<L: Lanes, T: ?Sized> Drop for Writer<'_, L, T> {
    #[inline(always)]
    fn drop(&mut self) {
        if self.stores == Stores::Streamed {
            L::fence(self.token);
        }
    }
}
