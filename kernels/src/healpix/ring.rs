//! Pixel ↔ direction, and neighbours, in RING order; every Nside from 1 to 2²⁹.

use super::faces::{Edges, FacePixel};
use super::layout::{self, RingPixel};
use super::points::{self, Order};
use super::{Location, Nside, neighbours as around, vector};
use crate::Error;
use crate::simd::Level;

/// RING order.
#[derive(Clone, Copy)]
pub(super) struct Ringwise;

impl Order for Ringwise {
    const NESTED: bool = false;

    #[inline]
    fn location(self, nside: Nside, pixel: u64) -> Location {
        location_valid(nside, layout::locate_valid(nside, pixel))
    }

    #[inline]
    fn pixel(self, nside: Nside, location: Location) -> u64 {
        layout::pixel_number(nside, place(nside, location))
    }

    #[inline]
    fn neighbours(self, nside: Nside, pixel: u64) -> [u64; 8] {
        let at = FacePixel::from_ring(nside, layout::locate_valid(nside, pixel));
        around::of(nside, at, |p| layout::pixel_number(nside, p.to_ring(nside)))
    }

    fn neighbours_by_vectors(
        self,
        level: Level,
        nside: Nside,
        pixels: &[u64],
        out: [&mut [u64]; 8],
    ) -> bool {
        vector::fits(nside) && vector::ring_neighbours(level, nside, pixels, out)
    }
}

/// The centre of a place on a ring.
#[inline]
pub(super) fn location_valid(nside: Nside, at: RingPixel) -> Location {
    let n = nside.get();
    let (z, sin_theta) = layout::latitude(nside, at.ring);
    Location {
        z,
        sin_theta,
        phi: layout::longitude(
            layout::quarter_length(n, at.ring),
            layout::is_shifted(n, at.ring),
            at.index,
        ),
    }
}

/// The place on a ring of the pixel that holds a direction.
#[inline]
fn place(nside: Nside, location: Location) -> RingPixel {
    let n = nside.get();
    match Edges::of(nside, location) {
        Edges::Belt { rising, falling } => {
            // rising − falling counts rings from the equator, rising + falling half pixels of longitude from φ = −π/4.
            let ring = 2 * n + rising - falling;
            let twice = rising + falling + 1 + 7 * n;
            let index = (twice - u64::from(layout::is_shifted(n, ring))) / 2;
            RingPixel {
                ring,
                index: index % (4 * n),
            }
        }
        Edges::Cap {
            south,
            quarter,
            west,
            east,
        } => {
            let from_pole = west + east + 1;
            RingPixel {
                ring: if south { 4 * n - from_pole } else { from_pole },
                index: quarter * from_pole + west,
            }
        }
    }
}

/// The pixel that holds the direction (θ, φ), rad.
///
/// # Errors
/// [`Error::Domain`] unless 0 ≤ θ ≤ π and φ is finite.
///
/// ```
/// use dust3d_kernels::healpix::{Nside, ring};
/// assert_eq!(ring::ang2pix(Nside::new(1)?, 0.0, 2.0)?, 1);
/// # Ok::<(), dust3d_kernels::Error>(())
/// ```
#[inline]
pub fn ang2pix(nside: Nside, theta: f64, phi: f64) -> Result<u64, Error> {
    Ok(Ringwise.pixel(nside, Location::from_ang(theta, phi)?))
}

/// The pixel that holds the direction of a vector of any length.
///
/// # Errors
/// [`Error::Domain`] if the vector is zero or not finite.
#[inline]
pub fn vec2pix(nside: Nside, vector: [f64; 3]) -> Result<u64, Error> {
    Ok(Ringwise.pixel(nside, Location::from_vec(vector)?))
}

/// The pixel that holds a direction given as (z, sin θ, φ).
///
/// # Errors
/// [`Error::Domain`] unless z² + sin² θ is 1 to 1e-9, sin θ ≥ 0 and φ is finite.
#[inline]
pub fn loc2pix(nside: Nside, location: Location) -> Result<u64, Error> {
    location.check()?;
    Ok(Ringwise.pixel(nside, location))
}

/// (θ, φ) of a pixel's centre, rad; 0 ≤ φ < 2π.
///
/// # Errors
/// [`Error::Pixel`] if there is no such pixel.
///
/// ```
/// use dust3d_kernels::healpix::{Nside, ring};
/// let (theta, phi) = ring::pix2ang(Nside::new(1)?, 4)?;
/// assert_eq!((theta, phi), (core::f64::consts::FRAC_PI_2, 0.0));
/// # Ok::<(), dust3d_kernels::Error>(())
/// ```
#[inline]
pub fn pix2ang(nside: Nside, pixel: u64) -> Result<(f64, f64), Error> {
    let location = pix2loc(nside, pixel)?;
    Ok((location.theta(), location.phi))
}

/// The unit vector to a pixel's centre.
///
/// # Errors
/// [`Error::Pixel`] if there is no such pixel.
#[inline]
pub fn pix2vec(nside: Nside, pixel: u64) -> Result<[f64; 3], Error> {
    Ok(pix2loc(nside, pixel)?.to_vec())
}

/// (z, sin θ, φ) of a pixel's centre; 0 ≤ φ < 2π.
///
/// # Errors
/// [`Error::Pixel`] if there is no such pixel.
#[inline]
pub fn pix2loc(nside: Nside, pixel: u64) -> Result<Location, Error> {
    nside.check_pixel(pixel)?;
    Ok(Ringwise.location(nside, pixel))
}

/// The pixels to the SW, W, NW, N, NE, E, SE and S.
///
/// At the eight corners where only three faces meet there is no diagonal neighbour: three pixels at each lack one (at
/// Nside 1, every pixel lacks two).
///
/// # Errors
/// [`Error::Pixel`] if there is no such pixel.
#[inline]
pub fn neighbours(nside: Nside, pixel: u64) -> Result<[Option<u64>; 8], Error> {
    nside.check_pixel(pixel)?;
    Ok(around::as_options(Ringwise.neighbours(nside, pixel)))
}

/// [`ang2pix`] of every element.
///
/// # Errors
/// [`Error::Length`] unless all slices are equally long; [`Error::Domain`] as [`ang2pix`]. Nothing is written then.
pub fn ang2pix_into(
    level: Level,
    nside: Nside,
    theta: &[f64],
    phi: &[f64],
    pixels: &mut [u64],
) -> Result<(), Error> {
    points::ang2pix(level, Ringwise, nside, theta, phi, pixels)
}

/// [`vec2pix`] of every element of the slices x, y, z.
///
/// # Errors
/// [`Error::Length`] unless all slices are equally long; [`Error::Domain`] as [`vec2pix`]. Nothing is written then.
pub fn vec2pix_into(
    level: Level,
    nside: Nside,
    xyz: [&[f64]; 3],
    pixels: &mut [u64],
) -> Result<(), Error> {
    points::vec2pix(level, Ringwise, nside, xyz, pixels)
}

/// [`pix2ang`] of every element.
///
/// # Errors
/// [`Error::Length`] unless all slices are equally long; [`Error::Pixel`] for the first pixel that does not exist.
/// Nothing is written then.
pub fn pix2ang_into(
    level: Level,
    nside: Nside,
    pixels: &[u64],
    theta: &mut [f64],
    phi: &mut [f64],
) -> Result<(), Error> {
    points::pix2ang(level, Ringwise, nside, pixels, theta, phi)
}

/// [`pix2vec`] of every element, into the slices x, y, z.
///
/// # Errors
/// [`Error::Length`] unless all slices are equally long; [`Error::Pixel`] for the first pixel that does not exist.
/// Nothing is written then.
pub fn pix2vec_into(
    level: Level,
    nside: Nside,
    pixels: &[u64],
    xyz: [&mut [f64]; 3],
) -> Result<(), Error> {
    points::pix2vec(level, Ringwise, nside, pixels, xyz)
}

/// [`neighbours`] of every element: one slice for each of SW, W, NW, N, NE, E, SE, S, with
/// [`NO_PIXEL`](super::NO_PIXEL) where there is none.
///
/// # Errors
/// [`Error::Length`] unless all slices are equally long; [`Error::Pixel`] for the first pixel that does not exist.
/// Nothing is written then.
pub fn neighbours_into(
    level: Level,
    nside: Nside,
    pixels: &[u64],
    neighbours: [&mut [u64]; 8],
) -> Result<(), Error> {
    points::neighbours(level, Ringwise, nside, pixels, neighbours)
}
