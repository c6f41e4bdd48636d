//! Pixel numbers from one order to the other.
//!
//! Through (face, x, y): RING → NESTED is a square root at most (to find the ring in a cap), NESTED → RING none.

use super::faces::FacePixel;
use super::{Nside, layout, vector};
use crate::Error;
use crate::simd::Level;

#[inline]
pub(super) fn ring2nest_valid(nside: Nside, order: u32, pixel: u64) -> u64 {
    FacePixel::from_ring(nside, layout::locate_valid(nside, pixel)).to_nested(order)
}

#[inline]
pub(super) fn nest2ring_valid(nside: Nside, order: u32, pixel: u64) -> u64 {
    layout::pixel_number(nside, FacePixel::from_nested(order, pixel).to_ring(nside))
}

/// The NESTED number of a RING pixel.
///
/// # Errors
/// [`Error::Nside`] where Nside is not a power of two; [`Error::Pixel`] if there is no such pixel.
///
/// ```
/// use dust3d_kernels::healpix::{Nside, nest2ring, ring2nest};
/// let nside = Nside::new(2)?;
/// assert_eq!(ring2nest(nside, 0)?, 3); // the pole is the last pixel of face 0
/// assert_eq!(nest2ring(nside, 3)?, 0);
/// # Ok::<(), dust3d_kernels::Error>(())
/// ```
#[inline]
pub fn ring2nest(nside: Nside, pixel: u64) -> Result<u64, Error> {
    let order = nside.nested_order()?;
    nside.check_pixel(pixel)?;
    Ok(ring2nest_valid(nside, order, pixel))
}

/// The RING number of a NESTED pixel.
///
/// # Errors
/// [`Error::Nside`] where Nside is not a power of two; [`Error::Pixel`] if there is no such pixel.
#[inline]
pub fn nest2ring(nside: Nside, pixel: u64) -> Result<u64, Error> {
    let order = nside.nested_order()?;
    nside.check_pixel(pixel)?;
    Ok(nest2ring_valid(nside, order, pixel))
}

/// [`ring2nest`] of every element.
///
/// # Errors
/// [`Error::Length`] unless the slices are equally long; else as [`ring2nest`]. Nothing is written then.
pub fn ring2nest_into(
    level: Level,
    nside: Nside,
    ring: &[u64],
    nested: &mut [u64],
) -> Result<(), Error> {
    let order = nside.nested_order()?;
    Error::check_len("nested", ring.len(), nested.len())?;
    if vector::fits(nside) && vector::ring2nest(level, nside, ring, nested) {
        return Ok(());
    }
    nside.check_pixels(ring)?;
    for (&pixel, out) in ring.iter().zip(nested) {
        *out = ring2nest_valid(nside, order, pixel);
    }
    Ok(())
}

/// [`nest2ring`] of every element.
///
/// # Errors
/// [`Error::Length`] unless the slices are equally long; else as [`nest2ring`]. Nothing is written then.
pub fn nest2ring_into(
    level: Level,
    nside: Nside,
    nested: &[u64],
    ring: &mut [u64],
) -> Result<(), Error> {
    let order = nside.nested_order()?;
    Error::check_len("ring", nested.len(), ring.len())?;
    if vector::fits(nside) && vector::nest2ring(level, nside, nested, ring) {
        return Ok(());
    }
    nside.check_pixels(nested)?;
    for (&pixel, out) in nested.iter().zip(ring) {
        *out = nest2ring_valid(nside, order, pixel);
    }
    Ok(())
}
