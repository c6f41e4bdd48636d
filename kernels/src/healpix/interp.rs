//! Bilinear interpolation between the rings above and below a direction.
//!
//! On either ring the two nearest centres west and east share the ring's weight linearly in φ; the rings share it linearly
//! in θ. North of the first ring (south of the last) the opposite two pixels of that ring stand in for the pole, where the
//! value is the mean of its four pixels. This is the interpolation of the HEALPix facilities (`get_interp_weights`).
//!
//! Weights are ≥ 0 and sum to 1. Pixels come as north-west, north-east, south-west, south-east.

use super::layout::{self, ring_above};
use super::location::{check_phi, check_theta};
use super::{Location, Nside, faces, order, vector};
use crate::simd::Level;
use crate::{Error, scalar};
use core::f64::consts::PI;

/// Four pixels and their weights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stencil {
    /// Pixel numbers; two may be equal next to a pole.
    pub pixels: [u64; 4],
    /// Weights, ≥ 0, with sum 1.
    pub weights: [f64; 4],
}

/// The part of a stencil that is the same all along a circle of latitude.
#[derive(Debug, Clone, Copy)]
pub(super) struct RingPair {
    north: HalfRing,
    south: HalfRing,
    /// Weight of the southern ring.
    weight: f64,
    pole: Pole,
    npix: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Pole {
    None,
    North,
    South,
}

/// What a stencil needs to know of a ring.
#[derive(Debug, Clone, Copy)]
struct HalfRing {
    first: u64,
    quarter: f64,
    len: u64,
    shift: f64,
}

impl HalfRing {
    fn of(nside: Nside, ring: u64) -> Self {
        let n = nside.get();
        let quarter = layout::quarter_length(n, ring);
        Self {
            first: layout::first_pixel(n, ring),
            quarter: quarter as f64,
            len: 4 * quarter,
            shift: if layout::is_shifted(n, ring) {
                0.5
            } else {
                0.0
            },
        }
    }

    fn source(self, map: &[f64], weight: f64) -> Option<Source<'_>> {
        let first = usize::try_from(self.first).ok()?;
        let end = first.checked_add(usize::try_from(self.len).ok()?)?;
        Some(Source {
            values: map.get(first..end)?,
            quarter: self.quarter,
            shift: self.shift,
            weight,
        })
    }

    /// The centres west and east of a longitude of `turns` quarter turns, and the weight of the eastern one.
    #[inline]
    fn around(self, turns: f64) -> (u64, u64, f64) {
        let at = turns * self.quarter - self.shift;
        // −½ … 0 lies between the last pixel and the first; rounding may reach the end.
        let (west, weight) = if at < 0.0 {
            (self.len - 1, at + 1.0)
        } else {
            let west = at as u64;
            (west.min(self.len - 1), at - west as f64)
        };
        let east = if west + 1 == self.len { 0 } else { west + 1 };
        (self.first + west, self.first + east, weight)
    }
}

/// A ring of a map and its share of the interpolation.
#[derive(Debug, Clone, Copy)]
pub(super) struct Source<'a> {
    /// Values from west to east; not empty.
    pub(super) values: &'a [f64],
    /// Pixels in a quarter turn.
    pub(super) quarter: f64,
    /// Place of longitude 0 before the first centre, in spacings.
    pub(super) shift: f64,
    /// Weight of the ring.
    pub(super) weight: f64,
}

impl Source<'_> {
    /// The values at the centres `west` and `west` + 1; −1 is the last one.
    #[inline(always)]
    pub(super) fn neighbours(&self, west: f64) -> (f64, f64) {
        let last = self.values.len().saturating_sub(1);
        let west = if west < 0.0 {
            last
        } else {
            (west as usize).min(last)
        };
        let east = if west == last { 0 } else { west + 1 };
        let value = |k: usize| self.values.get(k).copied().unwrap_or(0.0);
        (value(west), value(east))
    }
}

impl RingPair {
    /// The rings around the circle through a location of colatitude `theta`.
    pub(super) fn around(nside: Nside, location: Location, theta: f64) -> Self {
        let above = ring_above(nside, location.z, location.sin_theta);
        let last = nside.nrings();
        let (north, south) = (above.max(1), (above + 1).min(last));
        let theta_of = |ring| {
            let (z, sin_theta) = layout::latitude(nside, ring);
            scalar::atan2(sin_theta, z)
        };
        let (pole, weight) = if above == 0 {
            (Pole::North, theta / theta_of(1))
        } else if above >= last {
            // The colatitude from the south pole, without π − θ.
            let from_pole = scalar::atan2(location.sin_theta, -location.z);
            (Pole::South, 1.0 - from_pole / theta_of(1))
        } else {
            let from = theta_of(north);
            (Pole::None, (theta - from) / (theta_of(south) - from))
        };
        Self {
            north: HalfRing::of(nside, north),
            south: HalfRing::of(nside, south),
            weight: weight.clamp(0.0, 1.0),
            pole,
            npix: nside.npix(),
        }
    }

    /// The two rings with their values and weights, north first; none next to a pole.
    pub(super) fn sources<'a>(&self, map: &'a [f64]) -> Option<[Source<'a>; 2]> {
        if self.pole != Pole::None {
            return None;
        }
        Some([
            self.north.source(map, 1.0 - self.weight)?,
            self.south.source(map, self.weight)?,
        ])
    }

    /// The stencil at a longitude of `turns` quarter turns, 0 ≤ `turns` < 4.
    #[inline]
    pub(super) fn stencil(&self, turns: f64) -> Stencil {
        let (south, north) = (self.weight, 1.0 - self.weight);
        let (nw, ne, n_east) = self.north.around(turns);
        let (sw, se, s_east) = self.south.around(turns);
        match self.pole {
            Pole::None => Stencil {
                pixels: [nw, ne, sw, se],
                weights: [
                    (1.0 - n_east) * north,
                    n_east * north,
                    (1.0 - s_east) * south,
                    s_east * south,
                ],
            },
            Pole::North => {
                let quarter = 0.25 * north;
                Stencil {
                    pixels: [(sw + 2) & 3, (se + 2) & 3, sw, se],
                    weights: [
                        quarter,
                        quarter,
                        (1.0 - s_east) * south + quarter,
                        s_east * south + quarter,
                    ],
                }
            }
            Pole::South => {
                let quarter = 0.25 * south;
                // npix is a multiple of four, so the last four pixels are numbered by their low two bits.
                let opposite = |pixel: u64| ((pixel + 2) & 3) + self.npix - 4;
                Stencil {
                    pixels: [nw, ne, opposite(nw), opposite(ne)],
                    weights: [
                        (1.0 - n_east) * north + quarter,
                        n_east * north + quarter,
                        quarter,
                        quarter,
                    ],
                }
            }
        }
    }
}

#[inline]
fn stencil_at(nside: Nside, location: Location, theta: f64) -> Stencil {
    RingPair::around(nside, location, theta).stencil(faces::quarter_turns(location.phi))
}

#[inline]
fn to_nested(nside: Nside, order: u32, stencil: Stencil) -> Stencil {
    Stencil {
        pixels: stencil
            .pixels
            .map(|p| order::ring2nest_valid(nside, order, p)),
        ..stencil
    }
}

#[inline]
fn checked(nside: Nside, theta: f64, phi: f64) -> Result<Stencil, Error> {
    let location = Location::from_ang(theta, phi)?;
    Ok(stencil_at(nside, location, theta.min(PI)))
}

/// The stencil of the direction (θ, φ), rad, in RING order.
///
/// # Errors
/// [`Error::Domain`] unless 0 ≤ θ ≤ π and φ is finite.
///
/// ```
/// use dust3d_kernels::healpix::{Nside, interp};
/// let nside = Nside::new(8)?;
/// let pole = interp::ring(nside, 0.0, 0.0)?;
/// assert_eq!(pole.weights, [0.25; 4]);
/// # Ok::<(), dust3d_kernels::Error>(())
/// ```
#[inline]
pub fn ring(nside: Nside, theta: f64, phi: f64) -> Result<Stencil, Error> {
    checked(nside, theta, phi)
}

/// The stencil of a direction given as (z, sin θ, φ), in RING order.
///
/// # Errors
/// [`Error::Domain`] unless z² + sin² θ is 1 to 1e-9, sin θ ≥ 0 and φ is finite.
#[inline]
pub fn ring_at(nside: Nside, location: Location) -> Result<Stencil, Error> {
    location.check()?;
    Ok(stencil_at(nside, location, location.theta()))
}

/// The stencil of the direction (θ, φ), rad, in NESTED order.
///
/// # Errors
/// [`Error::Nside`] where Nside is not a power of two; [`Error::Domain`] unless 0 ≤ θ ≤ π and φ is finite.
#[inline]
pub fn nested(nside: Nside, theta: f64, phi: f64) -> Result<Stencil, Error> {
    let order = nside.nested_order()?;
    Ok(to_nested(nside, order, checked(nside, theta, phi)?))
}

/// The stencil of checked angles, in either order.
#[inline]
pub(super) fn stencil_of_angles(nside: Nside, nested: bool, theta: f64, phi: f64) -> Stencil {
    let location = Location::from_valid_ang(theta, phi);
    let stencil = stencil_at(nside, location, theta.min(PI));
    match nside.order() {
        Some(order) if nested => to_nested(nside, order, stencil),
        _ => stencil,
    }
}

/// [`ring`] of every element: four slices of pixels and four of weights.
///
/// # Errors
/// [`Error::Length`] unless all slices are equally long; [`Error::Domain`] as [`ring`]. Nothing is written then.
pub fn ring_into(
    level: Level,
    nside: Nside,
    theta: &[f64],
    phi: &[f64],
    pixels: [&mut [u64]; 4],
    weights: [&mut [f64]; 4],
) -> Result<(), Error> {
    fill(level, nside, theta, phi, pixels, weights, false)
}

/// [`nested`] of every element: four slices of pixels and four of weights.
///
/// # Errors
/// [`Error::Length`] unless all slices are equally long; else as [`nested`]. Nothing is written then.
pub fn nested_into(
    level: Level,
    nside: Nside,
    theta: &[f64],
    phi: &[f64],
    pixels: [&mut [u64]; 4],
    weights: [&mut [f64]; 4],
) -> Result<(), Error> {
    nside.nested_order()?;
    fill(level, nside, theta, phi, pixels, weights, true)
}

fn fill(
    level: Level,
    nside: Nside,
    theta: &[f64],
    phi: &[f64],
    mut pixels: [&mut [u64]; 4],
    mut weights: [&mut [f64]; 4],
    nested: bool,
) -> Result<(), Error> {
    Error::check_len("phi", theta.len(), phi.len())?;
    for plane in &pixels {
        Error::check_len("pixels", theta.len(), plane.len())?;
    }
    for plane in &weights {
        Error::check_len("weights", theta.len(), plane.len())?;
    }
    if vector::fits(nside) {
        // Planes of borrowed slices, lent on.
        let pixels = pixels.each_mut().map(|plane| &mut **plane);
        let weights = weights.each_mut().map(|plane| &mut **plane);
        if vector::stencils(level, nside, theta, phi, pixels, weights, nested) {
            return Ok(());
        }
    }
    for (&theta, &phi) in theta.iter().zip(phi) {
        check_theta(theta)?;
        check_phi(phi)?;
    }
    let [p0, p1, p2, p3] = pixels;
    let [w0, w1, w2, w3] = weights;
    let pixels = p0.iter_mut().zip(p1).zip(p2).zip(p3);
    let weights = w0.iter_mut().zip(w1).zip(w2).zip(w3);
    let points = theta.iter().zip(phi);
    for (((&theta, &phi), (((p0, p1), p2), p3)), (((w0, w1), w2), w3)) in
        points.zip(pixels).zip(weights)
    {
        let stencil = stencil_of_angles(nside, nested, theta, phi);
        [*p0, *p1, *p2, *p3] = stencil.pixels;
        [*w0, *w1, *w2, *w3] = stencil.weights;
    }
    Ok(())
}
