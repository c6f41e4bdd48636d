//! The twelve base faces, each an Nside × Nside grid of (x, y).
//!
//! Face f = 0–3 touches the north pole, 4–7 lie on the equator, 8–11 touch the south pole; x grows to the north-east, y
//! to the north-west, and (0, 0) is the southernmost pixel of a face. \[G05\], §4–5. NESTED order interleaves the bits
//! of y and x below the face number; RING order counts along circles of constant x + y.
//!
//! Both orders, the neighbours and the bilinear grid go through this one description; it holds for every Nside, power of
//! two or not.

use super::layout::{self, RingPixel};
use super::{Location, Nside};
use crate::bits::{gather_bits, spread_bits};
use crate::scalar;
use core::f64::consts::FRAC_2_PI;

/// Stands for a neighbour that does not exist in outputs of [`neighbours_into`](super::ring::neighbours_into):
/// `u64::MAX`, the bits of −1.
pub const NO_PIXEL: u64 = u64::MAX;

/// A pixel of a face.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FacePixel {
    pub(super) face: u64,
    pub(super) x: u64,
    pub(super) y: u64,
}

/// φ in quarter turns, 0 ≤ t < 4.
#[inline]
pub(super) fn quarter_turns(phi: f64) -> f64 {
    let t = phi * FRAC_2_PI;
    // Exact but for the last subtraction of a tiny negative t, which rounds up to 4.
    let t = t - 4.0 * scalar::floor(0.25 * t);
    if t < 4.0 { t } else { 0.0 }
}

/// Where a direction lies among the pixel edges, which are straight in (φ, z) in the belt and in (φ/√(1−|z|), 1/√(1−|z|))
/// in the caps: the number of edges of either kind passed (\[G05\], §5, Eqs. 19–22).
#[derive(Debug, Clone, Copy)]
pub(super) enum Edges {
    /// |z| ≤ 2/3: rising and falling edges passed, 0 … 5 Nside.
    Belt { rising: u64, falling: u64 },
    /// |z| > 2/3: edges passed east of the quarter's western and west of its eastern meridian; their sum is
    /// less than Nside.
    Cap {
        south: bool,
        quarter: u64,
        west: u64,
        east: u64,
    },
}

impl Edges {
    #[inline]
    pub(super) fn of(nside: Nside, location: Location) -> Self {
        let n = nside.as_f64();
        let Location { z, sin_theta, phi } = location;
        let za = scalar::abs(z);
        let t = quarter_turns(phi);
        if za <= 2.0 / 3.0 {
            let along = n * (0.5 + t);
            let across = n * (z * 0.75);
            // `as` takes a −1e-16 of rounding to 0. At |z| = 2/3 the two differ by Nside; rounded apart, they would
            // name a ring that the belt does not have.
            let (rising, falling) = ((along - across) as u64, (along + across) as u64);
            Self::Belt {
                rising: rising.min(falling + nside.get()),
                falling: falling.min(rising + nside.get()),
            }
        } else {
            // √(3 (1 − |z|)) without the cancellation.
            let height = n * sin_theta * scalar::sqrt(3.0 / (1.0 + za));
            let quarter = scalar::floor(t);
            let within = t - quarter;
            let west = ((within * height) as u64).min(nside.get() - 1);
            let east = (((1.0 - within) * height) as u64).min(nside.get() - 1 - west);
            Self::Cap {
                south: z < 0.0,
                quarter: quarter as u64,
                west,
                east,
            }
        }
    }
}

impl FacePixel {
    /// The pixel of NESTED number `pixel` < 12·4^order.
    #[inline]
    pub(super) const fn from_nested(order: u32, pixel: u64) -> Self {
        let within = pixel & ((1 << (2 * order)) - 1);
        Self {
            face: pixel >> (2 * order),
            x: gather_bits(within),
            y: gather_bits(within >> 1),
        }
    }

    #[inline]
    pub(super) const fn to_nested(self, order: u32) -> u64 {
        (self.face << (2 * order)) | spread_bits(self.x) | (spread_bits(self.y) << 1)
    }

    /// The pixel that holds a direction.
    #[inline]
    pub(super) fn from_location(nside: Nside, location: Location) -> Self {
        let n = nside.get();
        match Edges::of(nside, location) {
            Edges::Belt { rising, falling } => Self::from_belt(n, rising, falling),
            Edges::Cap {
                south: false,
                quarter,
                west,
                east,
            } => Self {
                face: quarter,
                x: n - 1 - east,
                y: n - 1 - west,
            },
            Edges::Cap {
                south: true,
                quarter,
                west,
                east,
            } => Self {
                face: quarter + 8,
                x: west,
                y: east,
            },
        }
    }

    /// The pixel after `rising` and `falling` edges of the belt.
    #[inline]
    const fn from_belt(n: u64, rising: u64, falling: u64) -> Self {
        let (row_rising, row_falling) = (rising / n, falling / n);
        let face = if row_rising == row_falling {
            4 + (row_rising & 3)
        } else if row_rising < row_falling {
            row_rising & 3
        } else {
            8 + (row_falling & 3)
        };
        Self {
            face,
            x: falling - row_falling * n,
            y: n - 1 - (rising - row_rising * n),
        }
    }

    /// The pixel at a place on a ring.
    #[inline]
    pub(super) fn from_ring(nside: Nside, at: RingPixel) -> Self {
        let n = nside.get();
        let RingPixel { ring, index } = at;
        if ring < n {
            let quarter = index / ring;
            let west = index - quarter * ring;
            // west + east + 1 = ring
            Self {
                face: quarter,
                x: n - ring + west,
                y: n - 1 - west,
            }
        } else if ring > 3 * n {
            let ring = 4 * n - ring;
            let quarter = index / ring;
            let west = index - quarter * ring;
            Self {
                face: quarter + 8,
                x: west,
                y: ring - 1 - west,
            }
        } else {
            // Twice the longitude of the centre in pixels, whole; odd where the ring is shifted.
            let shifted = ((ring - n) & 1) ^ 1;
            let twice = 2 * index + shifted;
            Self::from_belt(
                n,
                (twice + ring - n - 1) / 2,
                (twice + 3 * n - ring - 1) / 2,
            )
        }
    }

    /// The place on its ring. \[G05\], §4.1: ring F₁ N − v − 1, with v = x + y and F₁ = ⌊f/4⌋ + 2, and longitude from
    /// F₂ = 2 (f mod 4) − (⌊f/4⌋ mod 2) + 1 and h = x − y.
    #[inline]
    pub(super) const fn to_ring(self, nside: Nside) -> RingPixel {
        let n = nside.get();
        let row = self.face / 4;
        let f2 = 2 * (self.face & 3) + 1 - (row & 1);
        let ring = (row + 2) * n - self.x - self.y - 1;
        let quarter = layout::quarter_length(n, ring);
        let shifted = layout::is_shifted(n, ring) as u64;
        // F₂ nr + h = twice the longitude; 8 nr keeps it positive (face 4 reaches across φ = 0).
        let twice = (f2 + 8) * quarter + self.x - self.y - shifted;
        let index = twice / 2;
        let turn = 4 * quarter;
        RingPixel {
            ring,
            index: if index >= turn { index - turn } else { index },
        }
    }
}
