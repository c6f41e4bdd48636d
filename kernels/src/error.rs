//! The one error type of the kernels: small, `Copy`, without strings.

use core::fmt;

/// Why a kernel refused its input. Nothing has been written when one is returned.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// A slice has the wrong length.
    Length {
        /// Which argument.
        what: &'static str,
        /// The length the kernel needs (the least length, for scratch).
        expected: usize,
        /// The length it was given.
        got: usize,
    },
    /// A number lies outside the domain of the function.
    Domain {
        /// Which argument, and its domain.
        what: &'static str,
        /// The value given.
        value: f64,
    },
    /// `nside` is not allowed: zero, above 2^29, or not a power of two where one is needed.
    Nside {
        /// The value given.
        nside: u64,
    },
    /// A pixel number is not below 12 nside².
    Pixel {
        /// The pixel number given.
        pixel: u64,
        /// The number of pixels of the map.
        npix: u64,
    },
}

impl Error {
    /// Checks one length.
    ///
    /// # Errors
    /// [`Error::Length`] unless `got == expected`.
    #[inline]
    pub const fn check_len(what: &'static str, expected: usize, got: usize) -> Result<(), Self> {
        if expected == got {
            Ok(())
        } else {
            Err(Self::length(what, expected, got))
        }
    }

    /// Checks that scratch is long enough.
    ///
    /// # Errors
    /// [`Error::Length`] if `got < least`.
    #[inline]
    pub const fn check_scratch(what: &'static str, least: usize, got: usize) -> Result<(), Self> {
        if got >= least {
            Ok(())
        } else {
            Err(Self::length(what, least, got))
        }
    }

    /// Checks that a number lies in its domain, `holds` being the test.
    ///
    /// # Errors
    /// [`Error::Domain`] unless `holds`.
    #[inline]
    pub const fn check_domain(what: &'static str, value: f64, holds: bool) -> Result<(), Self> {
        if holds {
            Ok(())
        } else {
            Err(Self::Domain { what, value })
        }
    }

    #[cold]
    #[inline(never)]
    const fn length(what: &'static str, expected: usize, got: usize) -> Self {
        Self::Length {
            what,
            expected,
            got,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Length {
                what,
                expected,
                got,
            } => write!(f, "{what} has length {got}, needs {expected}"),
            Self::Domain { what, value } => write!(f, "{what}: {value} is out of range"),
            Self::Nside { nside } => write!(
                f,
                "Nside {nside} is not allowed here (1 to 2^29, a power of two in NESTED order)"
            ),
            Self::Pixel { pixel, npix } => {
                write!(f, "pixel {pixel} does not exist in a map of {npix} pixels")
            }
        }
    }
}

impl core::error::Error for Error {}
