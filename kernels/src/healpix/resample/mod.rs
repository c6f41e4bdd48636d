//! Whole maps to another resolution or order.
//!
//! | function | result |
//! | --- | --- |
//! | [`degrade_ring`] | mean over the pixels of a finer map inside each pixel |
//! | [`upgrade_bilinear_ring`] | bilinear interpolation at the pixel centres |
//! | [`to_nested`], [`to_ring`] | the same map in the other order |
//!
//! Each has a `…_range` form that computes a run of output pixels, so that threads can share a map; the bits do not
//! depend on how it is cut. Missing values ([`missing`](super::missing)) are left out of means and interpolation; what is
//! left shares the weight, and where nothing is left the result is [`MISSING`](super::missing::MISSING). Equal
//! resolutions copy bit for bit.

mod degrade;
mod reorder;
mod stretch;
mod tiles;
mod upgrade;

pub use degrade::{degrade_ring, degrade_ring_range};
pub use reorder::{to_nested, to_nested_range, to_ring, to_ring_range};
pub use upgrade::{upgrade_bilinear_ring, upgrade_bilinear_ring_range};

use super::Nside;

/// The part of a map that a range names; the caller has checked that it exists.
#[inline]
fn part(map: &[f64], first: u64, len: usize) -> Option<&[f64]> {
    let first = usize::try_from(first).ok()?;
    map.get(first..first.checked_add(len)?)
}

/// Copies a range of an equally fine map.
fn copy_range(map: &[f64], first: u64, out: &mut [f64]) {
    if let Some(from) = part(map, first, out.len()) {
        out.copy_from_slice(from);
    }
}

/// Whole maps are ranges that start at 0.
fn check_whole(nside: Nside, got: usize) -> Result<(), crate::Error> {
    nside.check_map("out", got)
}
