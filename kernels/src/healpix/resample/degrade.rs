//! Area averages.
//!
//! A pixel at (x, y) of a face holds the pixels (kx … kx + k − 1, ky … ky + k − 1) of the map k times finer. Circles of
//! constant x + y are runs of consecutive RING pixels, so a mean is 2k − 1 short runs, whatever k. The next pixel on the
//! coarse ring has its runs k pixels farther on the same fine rings:
//!
//! ```text
//! every stretch of a coarse ring in one face, in blocks:
//!     every fine ring that crosses it, from the north:  first pixel of the run of the first coarse pixel
//!         every coarse pixel:  add the run, k pixels on from the one before
//! ```
//!
//! So ring numbers are computed once a block, and every fine ring is read from west to east.

use super::super::faces::FacePixel;
use super::super::layout::{first_pixel, quarter_length};
use super::super::missing::{MISSING, is_missing};
use super::super::{Nside, location::domain};
use super::stretch::Stretch;
use super::{check_whole, copy_range};
use crate::Error;
use crate::simd::Level;

/// Averages a RING map over the pixels of a coarser grid.
///
/// out\[p\] = mean of the values in p that are not missing; [`MISSING`] where all are.
///
/// | argument | shape | domain |
/// | --- | --- | --- |
/// | `nside_in`, `nside_out` | | `nside_out` divides `nside_in` |
/// | `map` | 12 `nside_in`² | any, missing values allowed; infinite ones spread |
/// | `out` | 12 `nside_out`² | written |
///
/// Values are added from west to east along each fine ring, the sums of the rings from north to south: the same bits on
/// every run, whichever level.
///
/// # Errors
/// [`Error::Length`] unless both maps have their length; [`Error::Domain`] unless `nside_out` divides `nside_in`.
pub fn degrade_ring(
    level: Level,
    nside_in: Nside,
    nside_out: Nside,
    map: &[f64],
    out: &mut [f64],
) -> Result<(), Error> {
    check_whole(nside_out, out.len())?;
    degrade_ring_range(level, nside_in, nside_out, map, 0, out)
}

/// Pixels `first`, `first` + 1, … of [`degrade_ring`], as many as fit `out`.
///
/// # Errors
/// As [`degrade_ring`], and [`Error::Pixel`] where the range leaves the map.
pub fn degrade_ring_range(
    _level: Level,
    nside_in: Nside,
    nside_out: Nside,
    map: &[f64],
    first: u64,
    out: &mut [f64],
) -> Result<(), Error> {
    nside_in.check_map("map", map.len())?;
    nside_out.check_range(first, out.len())?;
    let fact = nside_in.get() / nside_out.get();
    if fact * nside_out.get() != nside_in.get() {
        return Err(domain(
            "nside_out must divide nside_in",
            nside_out.get() as f64,
        ));
    }
    if fact == 1 {
        copy_range(map, first, out);
        return Ok(());
    }
    let mut rest = out;
    let mut stretch = Stretch::from_pixel(nside_out, first);
    while !rest.is_empty() {
        let (here, after) = rest.split_at_mut(rest.len().min(stretch.len as usize));
        let mut coarse = stretch.west;
        for block in here.chunks_mut(BLOCK) {
            means(nside_in, fact, coarse, map, block);
            coarse.x += block.len() as u64;
            coarse.y = coarse.y.saturating_sub(block.len() as u64);
        }
        rest = after;
        stretch = stretch.next(nside_out);
    }
    Ok(())
}

/// Coarse pixels whose sums are kept at a time.
const BLOCK: usize = 64;

/// Means over consecutive coarse pixels of one ring and face, at most [`BLOCK`], the westernmost at `west`.
fn means(nside: Nside, fact: u64, west: FacePixel, map: &[f64], out: &mut [f64]) {
    let mut totals = [Sum::default(); BLOCK];
    for from_north in 0..2 * fact - 1 {
        // x + y counts from the south.
        let height = 2 * fact - 2 - from_north;
        let x_west = height.saturating_sub(fact - 1);
        let count = fact.min(height + 1) - x_west;
        let fine = FacePixel {
            face: west.face,
            x: west.x * fact + x_west,
            y: west.y * fact + height - x_west,
        }
        .to_ring(nside);
        let len = 4 * quarter_length(nside.get(), fine.ring);
        let first = first_pixel(nside.get(), fine.ring);
        let mut index = fine.index;
        for total in totals.iter_mut().take(out.len()) {
            // Face 4 reaches across φ = 0.
            let before_end = count.min(len - index);
            let mut sum = Sum::default();
            sum.add(map, first + index, before_end);
            if before_end < count {
                sum.add(map, first, count - before_end);
            }
            total.value += sum.value;
            total.count += sum.count;
            index += fact;
            if index >= len {
                index -= len;
            }
        }
    }
    for (out, total) in out.iter_mut().zip(totals) {
        *out = if total.count > 0.0 {
            total.value / total.count
        } else {
            MISSING
        };
    }
}

#[derive(Clone, Copy, Default)]
struct Sum {
    value: f64,
    count: f64,
}

impl Sum {
    #[inline]
    fn add(&mut self, map: &[f64], first: u64, len: u64) {
        let Some(run) = super::part(map, first, len as usize) else {
            return;
        };
        for &value in run {
            let missing = is_missing(value);
            self.value += if missing { 0.0 } else { value };
            self.count += if missing { 0.0 } else { 1.0 };
        }
    }
}
