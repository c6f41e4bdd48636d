//! The resolution of a map.

use crate::{Error, scalar};
use core::f64::consts::PI;
use core::fmt;

/// Resolution of a HEALPix grid: 12 Nside² pixels, 1 ≤ Nside ≤ 2²⁹.
///
/// ```
/// use dust3d_kernels::healpix::Nside;
/// let nside = Nside::from_npix(49_152)?;
/// assert_eq!((nside.get(), nside.order(), nside.nrings()), (64, Some(6), 255));
/// assert!(Nside::new(0).is_err());
/// # Ok::<(), dust3d_kernels::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Nside(u32);

impl Nside {
    /// The greatest resolution: a pixel number still fits a signed 64-bit integer, and half a pixel an f64 angle.
    pub const MAX: Self = Self(1 << 29);

    /// A grid of 12 `nside`² pixels.
    ///
    /// # Errors
    /// [`Error::Nside`] unless 1 ≤ `nside` ≤ 2²⁹.
    pub const fn new(nside: u64) -> Result<Self, Error> {
        if nside == 0 || nside > Self::MAX.get() {
            return Err(Error::Nside { nside });
        }
        Ok(Self(nside as u32))
    }

    /// The grid with `npix` pixels.
    ///
    /// # Errors
    /// [`Error::Nside`] (with the nearest `nside` below) unless `npix` is 12 Nside² for an allowed Nside.
    pub fn from_npix(npix: u64) -> Result<Self, Error> {
        let root = isqrt(npix / 12);
        let nside = Self::new(root)?;
        if nside.npix() == npix {
            Ok(nside)
        } else {
            Err(Error::Nside { nside: root })
        }
    }

    /// The number itself.
    #[must_use]
    #[inline]
    pub const fn get(self) -> u64 {
        self.0 as u64
    }

    /// The number as f64, exactly.
    #[inline]
    pub(super) const fn as_f64(self) -> f64 {
        self.0 as f64
    }

    /// Number of pixels, 12 Nside².
    #[must_use]
    #[inline]
    pub const fn npix(self) -> u64 {
        12 * self.get() * self.get()
    }

    /// log₂ Nside, or None where Nside is not a power of two.
    #[must_use]
    #[inline]
    pub const fn order(self) -> Option<u32> {
        if self.0.is_power_of_two() {
            Some(self.0.trailing_zeros())
        } else {
            None
        }
    }

    /// log₂ Nside.
    ///
    /// # Errors
    /// [`Error::Nside`] where Nside is not a power of two: NESTED order does not exist.
    #[inline]
    pub const fn nested_order(self) -> Result<u32, Error> {
        match self.order() {
            Some(order) => Ok(order),
            None => Err(Error::Nside { nside: self.get() }),
        }
    }

    /// Number of rings, 4 Nside − 1.
    #[must_use]
    #[inline]
    pub const fn nrings(self) -> u64 {
        4 * self.get() - 1
    }

    /// Solid angle of every pixel, sr.
    #[must_use]
    pub const fn pixel_area(self) -> f64 {
        4.0 * PI / self.npix() as f64
    }

    /// Square root of the pixel area, rad.
    #[must_use]
    pub fn resolution(self) -> f64 {
        scalar::sqrt(PI / 3.0) / self.as_f64()
    }

    /// The greatest distance from a pixel's centre to its corners, over all pixels, rad.
    ///
    /// It is reached in the first ring south of the polar cap's edge: from (z, φ) = (2/3, π/4N) to
    /// the corner at φ = 0, z = 1 − (1 − 1/N)²/3.
    #[must_use]
    pub fn max_pixel_radius(self) -> f64 {
        let n = self.as_f64();
        let t = (1.0 - 1.0 / n) * (1.0 - 1.0 / n) / 3.0;
        let (sin, cos) = scalar::sin_cos(PI / (4.0 * n));
        let (z_centre, s_centre) = (2.0 / 3.0, scalar::sqrt(5.0) / 3.0);
        let (z_corner, s_corner) = (1.0 - t, scalar::sqrt(t * (2.0 - t)));
        let (dx, dy, dz) = (
            s_centre * cos - s_corner,
            s_centre * sin,
            z_centre - z_corner,
        );
        2.0 * scalar::asin(0.5 * scalar::sqrt(dx * dx + dy * dy + dz * dz))
    }

    /// Checks a pixel number.
    ///
    /// # Errors
    /// [`Error::Pixel`] unless `pixel` < 12 Nside².
    #[inline]
    pub const fn check_pixel(self, pixel: u64) -> Result<(), Error> {
        if pixel < self.npix() {
            Ok(())
        } else {
            Err(self.bad_pixel(pixel))
        }
    }

    /// Checks pixel numbers, and that `got` outputs of the kind `what` are as many.
    ///
    /// # Errors
    /// [`Error::Pixel`] with the first pixel that is not below 12 Nside².
    pub(super) fn check_pixels(self, pixels: &[u64]) -> Result<(), Error> {
        // One comparison of the maximum: the search for the culprit is not in the loop.
        let npix = self.npix();
        let greatest = pixels.iter().fold(0, |m, &p| if p > m { p } else { m });
        if greatest < npix {
            return Ok(());
        }
        match pixels.iter().find(|&&p| p >= npix) {
            Some(&pixel) => Err(self.bad_pixel(pixel)),
            None => Ok(()),
        }
    }

    /// Checks the length of a whole map.
    ///
    /// # Errors
    /// [`Error::Length`] unless `got` = 12 Nside².
    #[inline]
    pub(super) fn check_map(self, what: &'static str, got: usize) -> Result<(), Error> {
        Error::check_len(
            what,
            usize::try_from(self.npix()).unwrap_or(usize::MAX),
            got,
        )
    }

    /// Checks that pixels `first` … `first + len − 1` exist.
    ///
    /// # Errors
    /// [`Error::Pixel`] with the first that does not.
    #[inline]
    pub(super) fn check_range(self, first: u64, len: usize) -> Result<(), Error> {
        let npix = self.npix();
        if first > npix || len as u64 > npix - first {
            return Err(self.bad_pixel(if first > npix { first } else { npix }));
        }
        Ok(())
    }

    #[cold]
    #[inline(never)]
    const fn bad_pixel(self, pixel: u64) -> Error {
        Error::Pixel {
            pixel,
            npix: self.npix(),
        }
    }
}

impl fmt::Display for Nside {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// ⌊√v⌋ for v < 2⁶². The f64 root is off by one at most; whole numbers settle it.
#[inline]
pub(super) fn isqrt(v: u64) -> u64 {
    let root = scalar::sqrt(v as f64) as u64;
    if root * root > v {
        root - 1
    } else if (root + 1) * (root + 1) <= v {
        root + 1
    } else {
        root
    }
}
