//! Joins neighbouring ranges on their way to the caller.

use core::ops::Range;

/// Hands ascending ranges on, joined where they touch.
pub(super) struct Emitter<F: FnMut(Range<u64>)> {
    each: F,
    pending: Range<u64>,
}

impl<F: FnMut(Range<u64>)> Emitter<F> {
    pub(super) const fn new(each: F) -> Self {
        Self {
            each,
            pending: 0..0,
        }
    }

    #[inline(always)]
    pub(super) fn push(&mut self, range: Range<u64>) {
        if range.is_empty() {
            return;
        }
        if range.start == self.pending.end && !self.pending.is_empty() {
            self.pending.end = range.end;
        } else {
            self.flush();
            self.pending = range;
        }
    }

    /// Hands on ranges of which none is empty, or touches another or those before.
    #[inline(always)]
    pub(super) fn push_apart(&mut self, start: &[u64], end: &[u64]) {
        self.flush();
        self.pending = 0..0;
        for (&start, &end) in start.iter().zip(end) {
            (self.each)(start..end);
        }
    }

    /// Hands on all but `holes`, `end` … `start` of each, from `pixels`; no two touch, or the ends of `pixels`.
    #[inline(always)]
    pub(super) fn push_around(&mut self, pixels: Range<u64>, start: &[u64], end: &[u64]) {
        self.push(pixels.start..pixels.start + 1);
        for (&start, &end) in start.iter().zip(end) {
            (self.each)(self.pending.start..end);
            self.pending.start = start;
        }
        self.pending.end = pixels.end;
    }

    #[inline(always)]
    fn flush(&mut self) {
        if !self.pending.is_empty() {
            (self.each)(self.pending.clone());
        }
    }

    pub(super) fn finish(mut self) {
        self.flush();
    }
}
