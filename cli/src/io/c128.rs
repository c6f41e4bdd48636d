//! Spherical harmonic coefficients in files: little-endian complex128 in healpy's order, m-major, m ≥ 0.

use super::output::write_atomically;
use crate::error::{Error, Result};
use crate::kernels::Complex;
use std::path::Path;

/// Coefficients `a_lm` of one map: index m (2 lmax + 1 − m)/2 + l, m from 0 to lmax.
#[derive(Debug, Clone, PartialEq)]
pub struct Alm {
    /// Band limit.
    pub lmax: usize,
    /// (lmax + 1)(lmax + 2)/2 coefficients.
    pub values: Vec<Complex<f64>>,
}

/// Reads a `.c128` file; the band limit follows from its length.
///
/// # Errors
/// A file that cannot be read, whose length is that of no triangle, or with a value that is not finite.
pub fn read_alm(path: &Path) -> Result<Alm> {
    let bytes =
        std::fs::read(path).map_err(|cause| Error::io("read the coefficients", path, &cause))?;
    let (pairs, rest) = bytes.as_chunks::<16>();
    let lmax = lmax_of_len(pairs.len()).filter(|_| rest.is_empty()).ok_or_else(|| {
        Error::input(format!(
            "{}: {} bytes are not 16 (lmax + 1)(lmax + 2)/2 for any lmax; the file is cut short or holds something else",
            path.display(),
            bytes.len()
        ))
    })?;
    let half = |pair: &[u8; 16], part: usize| {
        let (halves, _) = pair.as_chunks::<8>();
        f64::from_le_bytes(halves[part])
    };
    let values: Vec<_> = pairs
        .iter()
        .map(|pair| Complex::new(half(pair, 0), half(pair, 1)))
        .collect();
    if let Some(index) = values.iter().position(|a| !a.is_finite()) {
        return Err(Error::input(format!(
            "{}: coefficient {index} is not finite",
            path.display()
        )));
    }
    Ok(Alm { lmax, values })
}

/// Writes a `.c128` file; nothing is left half-written.
///
/// # Errors
/// A file that cannot be written.
pub fn write_alm(path: &Path, alm: &[Complex<f64>]) -> Result<()> {
    write_atomically(path, &encode(alm))
}

/// The bytes of a `.c128` file.
pub(super) fn encode(alm: &[Complex<f64>]) -> Vec<u8> {
    alm.iter()
        .flat_map(|a| [a.re.to_le_bytes(), a.im.to_le_bytes()])
        .flatten()
        .collect()
}

fn lmax_of_len(len: usize) -> Option<usize> {
    // (lmax + 1)(lmax + 2)/2 = len; the root is exact for every length a file can have.
    let lmax = (8 * len + 1).isqrt().checked_sub(3)? / 2;
    ((lmax + 1) * (lmax + 2) / 2 == len).then_some(lmax)
}
