//! Work over the pixels of maps, split among the threads of the current pool.
//!
//! Maps are cut into runs of [`CHUNK`] pixels whatever the number of threads, and sums are made chunk by chunk and then
//! over the chunks in order, so results do not depend on the number of threads.

use rayon::prelude::*;
use std::ops::Range;

/// Pixels per piece of work: a few hundred kilobytes over the maps of a stage.
pub const CHUNK: usize = 4096;

/// The pixel ranges that a map of `npix` pixels is cut into.
pub fn ranges(npix: usize) -> impl Iterator<Item = Range<usize>> {
    (0..npix.div_ceil(CHUNK)).map(move |k| k * CHUNK..((k + 1) * CHUNK).min(npix))
}

/// For each range of [`ranges`], the slices of all maps over it.
pub fn columns<'a>(maps: &'a mut [Vec<f64>]) -> Vec<Vec<&'a mut [f64]>> {
    let count = maps
        .iter()
        .map(|m| m.len().div_ceil(CHUNK))
        .max()
        .unwrap_or(0);
    let mut columns: Vec<Vec<&'a mut [f64]>> =
        (0..count).map(|_| Vec::with_capacity(maps.len())).collect();
    for map in maps {
        for (column, piece) in columns.iter_mut().zip(map.chunks_mut(CHUNK)) {
            column.push(piece);
        }
    }
    columns
}

/// Runs `work(range, slices of all maps over the range)` for every range, and returns the results in order.
pub fn for_columns<R: Send>(
    maps: &mut [Vec<f64>],
    work: impl Fn(Range<usize>, Vec<&mut [f64]>) -> R + Sync,
) -> Vec<R> {
    let npix = maps.first().map_or(0, Vec::len);
    columns(maps)
        .into_par_iter()
        .zip(ranges(npix).collect::<Vec<_>>())
        .map(|(column, range)| work(range, column))
        .collect()
}

/// Fills a new map of `npix` pixels chunk by chunk.
pub fn map(npix: usize, work: impl Fn(Range<usize>, &mut [f64]) + Sync) -> Vec<f64> {
    let mut out = vec![0.0; npix];
    out.par_chunks_mut(CHUNK)
        .enumerate()
        .for_each(|(k, piece)| {
            let start = k * CHUNK;
            work(start..start + piece.len(), piece);
        });
    out
}

/// Sums of N quantities over the pixels: `work` gives those of one range.
pub fn sums<const N: usize>(
    npix: usize,
    work: impl Fn(Range<usize>) -> [f64; N] + Sync + Send,
) -> [f64; N] {
    let partial: Vec<[f64; N]> = ranges(npix)
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(work)
        .collect();
    partial.into_iter().fold([0.0; N], |mut sum, part| {
        for (s, p) in sum.iter_mut().zip(part) {
            *s += p;
        }
        sum
    })
}
