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
