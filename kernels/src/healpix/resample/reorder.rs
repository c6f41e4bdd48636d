//! The same map in the other order.

use super::super::{Nside, order};
use super::check_whole;
use crate::Error;
use crate::simd::Level;

/// Writes a RING map in NESTED order. Values are copied bit for bit, missing ones too.
///
/// | argument | shape |
/// | --- | --- |
/// | `ring` | 12 nside² |
/// | `nested` | 12 nside², written |
///
/// # Errors
/// [`Error::Nside`] where Nside is not a power of two; [`Error::Length`] unless both have their length.
pub fn to_nested<T: Copy>(
    level: Level,
    nside: Nside,
    ring: &[T],
    nested: &mut [T],
) -> Result<(), Error> {
    check_whole(nside, nested.len())?;
    to_nested_range(level, nside, ring, 0, nested)
}

/// Pixels `first`, `first` + 1, … of [`to_nested`], as many as fit `nested`.
///
/// # Errors
/// As [`to_nested`], and [`Error::Pixel`] where the range leaves the map.
pub fn to_nested_range<T: Copy>(
    _level: Level,
    nside: Nside,
    ring: &[T],
    first: u64,
    nested: &mut [T],
) -> Result<(), Error> {
    let order = nside.nested_order()?;
    nside.check_map("ring", ring.len())?;
    nside.check_range(first, nested.len())?;
    for (pixel, out) in (first..).zip(nested) {
        let from = order::nest2ring_valid(nside, order, pixel);
        if let Some(&value) = ring.get(from as usize) {
            *out = value;
        }
    }
    Ok(())
}

/// Writes a NESTED map in RING order. Values are copied bit for bit, missing ones too.
///
/// | argument | shape |
/// | --- | --- |
/// | `nested` | 12 nside² |
/// | `ring` | 12 nside², written |
///
/// # Errors
/// [`Error::Nside`] where Nside is not a power of two; [`Error::Length`] unless both have their length.
pub fn to_ring<T: Copy>(
    level: Level,
    nside: Nside,
    nested: &[T],
    ring: &mut [T],
) -> Result<(), Error> {
    check_whole(nside, ring.len())?;
    to_ring_range(level, nside, nested, 0, ring)
}

/// Pixels `first`, `first` + 1, … of [`to_ring`], as many as fit `ring`.
///
/// # Errors
/// As [`to_ring`], and [`Error::Pixel`] where the range leaves the map.
pub fn to_ring_range<T: Copy>(
    _level: Level,
    nside: Nside,
    nested: &[T],
    first: u64,
    ring: &mut [T],
) -> Result<(), Error> {
    let order = nside.nested_order()?;
    nside.check_map("nested", nested.len())?;
    nside.check_range(first, ring.len())?;
    for (pixel, out) in (first..).zip(ring) {
        let from = order::ring2nest_valid(nside, order, pixel);
        if let Some(&value) = nested.get(from as usize) {
            *out = value;
        }
    }
    Ok(())
}
