//! Pixel ↔ direction, and neighbours, in NESTED order; Nside a power of two up to 2²⁹.
//!
//! Every function answers [`Error::Nside`] for any other Nside.

use super::faces::FacePixel;
use super::points::{self, Order};
use super::{Location, Nside, neighbours as around, ring, vector};
use crate::Error;
use crate::simd::Level;

/// NESTED order of 4^k pixels a face.
#[derive(Clone, Copy)]
pub(super) struct Nested {
    order: u32,
}

impl Nested {
    /// # Errors
    /// [`Error::Nside`] where Nside is not a power of two.
    #[inline]
    pub(super) const fn of(nside: Nside) -> Result<Self, Error> {
        match nside.nested_order() {
            Ok(order) => Ok(Self { order }),
            Err(e) => Err(e),
        }
    }
}

impl Order for Nested {
    const NESTED: bool = true;

    #[inline]
    fn location(self, nside: Nside, pixel: u64) -> Location {
        ring::location_valid(
            nside,
            FacePixel::from_nested(self.order, pixel).to_ring(nside),
        )
    }

    #[inline]
    fn pixel(self, nside: Nside, location: Location) -> u64 {
        FacePixel::from_location(nside, location).to_nested(self.order)
    }

    #[inline]
    fn neighbours(self, nside: Nside, pixel: u64) -> [u64; 8] {
        let at = FacePixel::from_nested(self.order, pixel);
        around::of(nside, at, |p| p.to_nested(self.order))
    }

    fn neighbours_by_vectors(
        self,
        level: Level,
        nside: Nside,
        pixels: &[u64],
        out: [&mut [u64]; 8],
    ) -> bool {
        vector::nested_neighbours(level, nside, self, pixels, out)
    }
}

/// The pixel that holds the direction (θ, φ), rad.
///
/// # Errors
/// [`Error::Nside`]; [`Error::Domain`] unless 0 ≤ θ ≤ π and φ is finite.
#[inline]
pub fn ang2pix(nside: Nside, theta: f64, phi: f64) -> Result<u64, Error> {
    Ok(Nested::of(nside)?.pixel(nside, Location::from_ang(theta, phi)?))
}

/// The pixel that holds the direction of a vector of any length.
///
/// # Errors
/// [`Error::Nside`]; [`Error::Domain`] if the vector is zero or not finite.
#[inline]
pub fn vec2pix(nside: Nside, vector: [f64; 3]) -> Result<u64, Error> {
    Ok(Nested::of(nside)?.pixel(nside, Location::from_vec(vector)?))
}

/// The pixel that holds a direction given as (z, sin θ, φ).
///
/// # Errors
/// [`Error::Nside`]; [`Error::Domain`] unless z² + sin² θ is 1 to 1e-9, sin θ ≥ 0 and φ is finite.
#[inline]
pub fn loc2pix(nside: Nside, location: Location) -> Result<u64, Error> {
    let order = Nested::of(nside)?;
    location.check()?;
    Ok(order.pixel(nside, location))
}

/// (θ, φ) of a pixel's centre, rad; 0 ≤ φ < 2π.
///
/// # Errors
/// [`Error::Nside`]; [`Error::Pixel`] if there is no such pixel.
///
/// ```
/// use dust3d_kernels::healpix::{Nside, nested};
/// let nside = Nside::new(2)?;
/// let (theta, phi) = nested::pix2ang(nside, 17)?;
/// assert_eq!(nested::ang2pix(nside, theta, phi)?, 17);
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
/// [`Error::Nside`]; [`Error::Pixel`] if there is no such pixel.
#[inline]
pub fn pix2vec(nside: Nside, pixel: u64) -> Result<[f64; 3], Error> {
    Ok(pix2loc(nside, pixel)?.to_vec())
}

/// (z, sin θ, φ) of a pixel's centre; 0 ≤ φ < 2π.
///
/// # Errors
/// [`Error::Nside`]; [`Error::Pixel`] if there is no such pixel.
#[inline]
pub fn pix2loc(nside: Nside, pixel: u64) -> Result<Location, Error> {
    let order = Nested::of(nside)?;
    nside.check_pixel(pixel)?;
    Ok(order.location(nside, pixel))
}

/// The pixels to the SW, W, NW, N, NE, E, SE and S; see [`ring::neighbours`].
///
/// # Errors
/// [`Error::Nside`]; [`Error::Pixel`] if there is no such pixel.
#[inline]
pub fn neighbours(nside: Nside, pixel: u64) -> Result<[Option<u64>; 8], Error> {
    let order = Nested::of(nside)?;
    nside.check_pixel(pixel)?;
    Ok(around::as_options(order.neighbours(nside, pixel)))
}

/// [`ang2pix`] of every element.
///
/// # Errors
/// [`Error::Length`] unless all slices are equally long; else as [`ang2pix`]. Nothing is written then.
pub fn ang2pix_into(
    level: Level,
    nside: Nside,
    theta: &[f64],
    phi: &[f64],
    pixels: &mut [u64],
) -> Result<(), Error> {
    points::ang2pix(level, Nested::of(nside)?, nside, theta, phi, pixels)
}

/// [`vec2pix`] of every element of the slices x, y, z.
///
/// # Errors
/// [`Error::Length`] unless all slices are equally long; else as [`vec2pix`]. Nothing is written then.
pub fn vec2pix_into(
    level: Level,
    nside: Nside,
    xyz: [&[f64]; 3],
    pixels: &mut [u64],
) -> Result<(), Error> {
    points::vec2pix(level, Nested::of(nside)?, nside, xyz, pixels)
}

/// [`pix2ang`] of every element.
///
/// # Errors
/// [`Error::Length`] unless all slices are equally long; else as [`pix2ang`]. Nothing is written then.
pub fn pix2ang_into(
    level: Level,
    nside: Nside,
    pixels: &[u64],
    theta: &mut [f64],
    phi: &mut [f64],
) -> Result<(), Error> {
    points::pix2ang(level, Nested::of(nside)?, nside, pixels, theta, phi)
}

/// [`pix2vec`] of every element, into the slices x, y, z.
///
/// # Errors
/// [`Error::Length`] unless all slices are equally long; else as [`pix2vec`]. Nothing is written then.
pub fn pix2vec_into(
    level: Level,
    nside: Nside,
    pixels: &[u64],
    xyz: [&mut [f64]; 3],
) -> Result<(), Error> {
    points::pix2vec(level, Nested::of(nside)?, nside, pixels, xyz)
}

/// [`neighbours`] of every element: one slice for each of SW, W, NW, N, NE, E, SE, S, with
/// [`NO_PIXEL`](super::NO_PIXEL) where there is none.
///
/// # Errors
/// [`Error::Length`] unless all slices are equally long; else as [`neighbours`]. Nothing is written then.
pub fn neighbours_into(
    level: Level,
    nside: Nside,
    pixels: &[u64],
    neighbours: [&mut [u64]; 8],
) -> Result<(), Error> {
    points::neighbours(level, Nested::of(nside)?, nside, pixels, neighbours)
}
