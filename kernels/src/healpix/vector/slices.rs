//! Slices as vectors of eight, the last one padded.

/// A slice to read.
pub(super) struct Reads<'a, T> {
    chunks: &'a [[T; 8]],
    tail: [T; 8],
}

impl<'a, T: Copy + Default> Reads<'a, T> {
    /// The vectors of a slice; what is missing of the last is zero.
    #[inline(always)]
    pub(super) fn new(slice: &'a [T]) -> Self {
        let (chunks, rest) = slice.as_chunks();
        let mut tail = [T::default(); 8];
        for (t, &r) in tail.iter_mut().zip(rest) {
            *t = r;
        }
        Self { chunks, tail }
    }

    /// Vector k, below the number of vectors.
    #[inline(always)]
    pub(super) fn get(&self, k: usize) -> &[T; 8] {
        match self.chunks.get(k) {
            Some(chunk) => chunk,
            None => &self.tail,
        }
    }
}

/// A slice to write.
pub(super) struct Writes<'a, T> {
    chunks: &'a mut [[T; 8]],
    rest: &'a mut [T],
    tail: [T; 8],
}

impl<'a, T: Copy + Default> Writes<'a, T> {
    #[inline(always)]
    pub(super) fn new(slice: &'a mut [T]) -> Self {
        let (chunks, rest) = slice.as_chunks_mut();
        Self {
            chunks,
            rest,
            tail: [T::default(); 8],
        }
    }

    /// Vector k, below the number of vectors.
    #[inline(always)]
    pub(super) fn get(&mut self, k: usize) -> &mut [T; 8] {
        match self.chunks.get_mut(k) {
            Some(chunk) => chunk,
            None => &mut self.tail,
        }
    }

    /// Writes what the last vector holds of the slice.
    #[inline(always)]
    pub(super) fn finish(self) {
        for (r, t) in self.rest.iter_mut().zip(self.tail) {
            *r = t;
        }
    }
}

/// How many vectors a slice of this length makes.
#[inline(always)]
pub(super) const fn count(len: usize) -> usize {
    len.div_ceil(8)
}
