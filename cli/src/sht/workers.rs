//! Work shared among the threads of the caller's pool, each with its own scratch.

use dust3d_kernels::sht::{Coefficient, Line, PhaseBlock};
use num_complex::Complex;
use std::sync::Mutex;

/// Runs `work` on every item, on all threads of the current rayon pool, heaviest items first if so ordered.
///
/// Each thread takes the next item when it is free and uses its own element of `scratch`, which grows to the number of
/// threads. Items must be independent: their order of execution is not defined.
pub(super) fn share<S, I, T>(scratch: &mut Vec<S>, items: I, work: impl Fn(&mut S, T) + Sync)
where
    S: Default + Send,
    I: Iterator<Item = T> + Send,
    T: Send,
{
    let threads = rayon::current_num_threads().max(1);
    if scratch.len() < threads {
        scratch.resize_with(threads, S::default);
    }
    if threads == 1 {
        if let Some(own) = scratch.first_mut() {
            items.for_each(|item| work(own, item));
        }
        return;
    }
    let queue = Mutex::new(items);
    let next = || queue.lock().ok().and_then(|mut q| q.next());
    let run = |own: &mut S| {
        while let Some(item) = next() {
            work(own, item);
        }
    };
    rayon::in_place_scope(|scope| {
        let mut own = scratch.iter_mut().take(threads);
        let mine = own.next();
        for own in own {
            let run = &run;
            scope.spawn(move |_| run(own));
        }
        if let Some(mine) = mine {
            run(mine);
        }
    });
}

/// The first `need` elements, with room made for them. What is there stays and is of no consequence.
pub(super) fn room<T: Clone + Default>(all: &mut Vec<T>, need: usize) -> &mut [T] {
    if all.len() < need {
        all.reserve_exact(need - all.len());
        all.resize(need, T::default());
    }
    &mut all[..need]
}

/// What one worker needs, grown on first use and kept.
#[derive(Default)]
pub(super) struct Scratch {
    /// Tables of the order in hand, where the plan does not keep them.
    pub(super) tables: super::orders::OrderTables,
    pub(super) coefficients: Vec<Coefficient>,
    /// Scratch of the adjoint's kernels.
    pub(super) lines: Vec<Line>,
    pub(super) mixing: Vec<Complex<f64>>,
    /// The same with zeros around it.
    pub(super) padded: Vec<f64>,
    /// Phases of eight orders in the Legendre stage.
    pub(super) rows: Vec<PhaseBlock>,
    pub(super) resampling: super::equidistant::ResamplingRoom,
    /// Tiles of one block.
    pub(super) places: Vec<usize>,
}
