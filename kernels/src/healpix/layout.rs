//! The rings of a map: where they lie, and which pixels are on them.
//!
//! Ring i = 1 … 4N − 1 from the north (\[G05\], §4). Polar caps, i < N (the south mirrors it):
//!
//! z = 1 − i²/(3N²), 4i pixels from 2i(i − 1), φⱼ = (j + ½) π/(2i);
//!
//! belt, N ≤ i ≤ 3N:
//!
//! z = 4/3 − 2i/(3N), 4N pixels from 2N(N − 1) + 4N(i − N), φⱼ = (j + s/2) π/(2N), s = 1 where i − N is even.
//!
//! sin θ in the caps is √(t (2 − t)) with t = 1 − |z| = i²/(3N²), which loses no digit at the pole.

use super::Nside;
use super::nside::isqrt;
use crate::{Error, scalar};
use core::f64::consts::FRAC_PI_4;

/// One ring of pixels at a common latitude.
///
/// ```
/// use dust3d_kernels::healpix::{Nside, layout::Ring};
/// let ring = Ring::new(Nside::new(2)?, 2)?;
/// assert_eq!((ring.first_pixel(), ring.len()), (4, 8));
/// assert_eq!(ring.z(), 2.0 / 3.0);
/// assert_eq!(ring.phi0(), core::f64::consts::PI / 8.0);
/// # Ok::<(), dust3d_kernels::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ring {
    nside: Nside,
    ring: u64,
    first: u64,
    quarter: u64,
    shifted: bool,
    z: f64,
    sin_theta: f64,
}

/// Ring number from 1 and the pixel's place on it from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RingPixel {
    /// 1 … 4 Nside − 1 from the north.
    pub ring: u64,
    /// 0 … length − 1 from φ = 0 eastward.
    pub index: u64,
}

/// A quarter of the length of ring 1 ≤ `ring` < 4n.
#[inline]
pub(super) const fn quarter_length(n: u64, ring: u64) -> u64 {
    if ring < n {
        ring
    } else if ring > 3 * n {
        4 * n - ring
    } else {
        n
    }
}

/// Does the first pixel's centre lie half a pixel east of φ = 0 (else on it)?
#[inline]
pub(super) const fn is_shifted(n: u64, ring: u64) -> bool {
    ring < n || ring > 3 * n || (ring - n).is_multiple_of(2)
}

/// The first pixel of ring 1 ≤ `ring` < 4n.
#[inline]
pub(super) const fn first_pixel(n: u64, ring: u64) -> u64 {
    if ring < n {
        2 * ring * (ring - 1)
    } else if ring > 3 * n {
        let from_south = 4 * n - ring;
        12 * n * n - 2 * from_south * (from_south + 1)
    } else {
        2 * n * (n - 1) + 4 * n * (ring - n)
    }
}

/// (z, sin θ) of ring 1 ≤ `ring` < 4n.
#[inline]
pub(super) fn latitude(nside: Nside, ring: u64) -> (f64, f64) {
    let (n, nf) = (nside.get(), nside.as_f64());
    if ring >= n && ring <= 3 * n {
        // Numerator and denominator are whole: one rounding.
        let z = (2.0 * (2.0 * nf - ring as f64)) / (3.0 * nf);
        return (z, scalar::sqrt((1.0 - z) * (1.0 + z)));
    }
    let from_pole = quarter_length(n, ring) as f64;
    let t = (from_pole * from_pole) / (3.0 * nf * nf);
    let z = if ring < n { 1.0 - t } else { t - 1.0 };
    (z, scalar::sqrt(t * (2.0 - t)))
}

/// The number of a place on a ring.
#[inline]
pub(super) const fn pixel_number(nside: Nside, at: RingPixel) -> u64 {
    first_pixel(nside.get(), at.ring) + at.index
}

/// The longitude of the centre `index` pixels after the first, on a ring of 4 `quarter` pixels.
#[inline]
pub(super) fn longitude(quarter: u64, shifted: bool, index: u64) -> f64 {
    (2 * index + shifted as u64) as f64 * FRAC_PI_4 / quarter as f64
}

/// Ring and place of a pixel that exists.
///
/// In a cap, ring i holds 2i(i − 1) ≤ p < 2i(i + 1), so i = (1 + ⌊√(2p + 1)⌋)/2, in whole numbers.
#[inline]
pub(super) fn locate_valid(nside: Nside, pixel: u64) -> RingPixel {
    let (n, npix) = (nside.get(), nside.npix());
    let cap = 2 * n * (n - 1);
    if pixel < cap {
        let ring = u64::midpoint(isqrt(2 * pixel + 1), 1);
        RingPixel {
            ring,
            index: pixel - 2 * ring * (ring - 1),
        }
    } else if pixel < npix - cap {
        let in_belt = pixel - cap;
        let row = in_belt / (4 * n);
        RingPixel {
            ring: n + row,
            index: in_belt - row * 4 * n,
        }
    } else {
        let from_end = npix - pixel;
        let from_south = u64::midpoint(isqrt(2 * from_end - 1), 1);
        RingPixel {
            ring: 4 * n - from_south,
            index: 2 * from_south * (from_south + 1) - from_end,
        }
    }
}

/// Ring and place of a pixel.
///
/// # Errors
/// [`Error::Pixel`] if there is no such pixel.
///
/// ```
/// use dust3d_kernels::healpix::{Nside, layout};
/// let at = layout::locate(Nside::new(2)?, 13)?;
/// assert_eq!((at.ring, at.index), (3, 1));
/// # Ok::<(), dust3d_kernels::Error>(())
/// ```
#[inline]
pub fn locate(nside: Nside, pixel: u64) -> Result<RingPixel, Error> {
    nside.check_pixel(pixel)?;
    Ok(locate_valid(nside, pixel))
}

/// The last ring whose centres do not lie south of z: 0 (none) … 4N − 1.
///
/// `sin_theta` belongs to z; it alone counts in the caps. Within rounding of a ring, either answer may come.
#[inline]
pub(super) fn ring_above(nside: Nside, z: f64, sin_theta: f64) -> u64 {
    let (n, nf) = (nside.get(), nside.as_f64());
    let za = scalar::abs(z);
    if za <= 2.0 / 3.0 {
        return (nf * (2.0 - 1.5 * z)) as u64;
    }
    let from_pole = (nf * sin_theta * scalar::sqrt(3.0 / (1.0 + za))) as u64;
    if z > 0.0 {
        from_pole.min(n)
    } else {
        4 * n - 1 - from_pole.min(n)
    }
}

impl Ring {
    /// Ring `ring` from the north.
    ///
    /// # Errors
    /// [`Error::Domain`] unless 1 ≤ `ring` ≤ 4 Nside − 1.
    #[inline]
    pub fn new(nside: Nside, ring: u64) -> Result<Self, Error> {
        if ring == 0 || ring > nside.nrings() {
            return Err(super::location::domain(
                "ring in 1 … 4 Nside − 1",
                ring as f64,
            ));
        }
        Ok(Self::valid(nside, ring))
    }

    #[inline]
    pub(super) fn valid(nside: Nside, ring: u64) -> Self {
        let n = nside.get();
        let (z, sin_theta) = latitude(nside, ring);
        Self {
            nside,
            ring,
            first: first_pixel(n, ring),
            quarter: quarter_length(n, ring),
            shifted: is_shifted(n, ring),
            z,
            sin_theta,
        }
    }

    /// All rings from north to south.
    pub fn all(nside: Nside) -> impl DoubleEndedIterator<Item = Self> + Clone {
        (1..nside.nrings() + 1).map(move |ring| Self::valid(nside, ring))
    }

    /// The ring of a pixel.
    ///
    /// # Errors
    /// [`Error::Pixel`] if there is no such pixel.
    #[inline]
    pub fn of_pixel(nside: Nside, pixel: u64) -> Result<Self, Error> {
        Ok(Self::valid(nside, locate(nside, pixel)?.ring))
    }

    /// Its number, from 1 at the north pole.
    #[must_use]
    #[inline]
    pub const fn number(self) -> u64 {
        self.ring
    }

    /// Its first pixel, in RING order.
    #[must_use]
    #[inline]
    pub const fn first_pixel(self) -> u64 {
        self.first
    }

    /// Its number of pixels; a multiple of four, never zero.
    #[must_use]
    #[inline]
    #[expect(clippy::len_without_is_empty, reason = "no ring is empty")]
    pub const fn len(self) -> u64 {
        4 * self.quarter
    }

    /// Its pixels.
    #[must_use]
    #[inline]
    pub const fn pixels(self) -> core::ops::Range<u64> {
        self.first..self.first + self.len()
    }

    /// Does its first centre lie half a pixel east of φ = 0 (else on φ = 0)?
    #[must_use]
    #[inline]
    pub const fn is_shifted(self) -> bool {
        self.shifted
    }

    /// cos θ.
    #[must_use]
    #[inline]
    pub const fn z(self) -> f64 {
        self.z
    }

    /// sin θ, to full relative precision at the poles.
    #[must_use]
    #[inline]
    pub const fn sin_theta(self) -> f64 {
        self.sin_theta
    }

    /// θ, rad.
    #[must_use]
    #[inline]
    pub fn theta(self) -> f64 {
        scalar::atan2(self.sin_theta, self.z)
    }

    /// Longitude of its first centre, rad: 0 or half a pixel.
    #[must_use]
    #[inline]
    pub fn phi0(self) -> f64 {
        self.phi(0)
    }

    /// Longitude of the centre `index` pixels after the first, rad. In 0 ≤ φ < 2π for `index` < [`len`](Self::len).
    #[must_use]
    #[inline]
    pub fn phi(self, index: u64) -> f64 {
        longitude(self.quarter, self.shifted, index.min(self.len()))
    }

    /// The ring at the opposite latitude (itself on the equator).
    #[must_use]
    #[inline]
    pub fn mirrored(self) -> Self {
        Self::valid(self.nside, 4 * self.nside.get() - self.ring)
    }
}
