//! Spectra averaged over neighbouring multipoles.

use crate::Error;

/// The bin of `l`: the multipoles within 4 + ⌊l/10⌋ of it, 2 … `lmax`, as a half-open range.
#[must_use]
pub fn bin_range(l: usize, lmax: usize) -> core::ops::Range<usize> {
    let half = 4 + l / 10;
    l.saturating_sub(half).max(2)..(l + half).min(lmax) + 1
}

/// `out[l]` = Σ (2l′+1) c\[l′\] / Σ (2l′+1) over [`bin_range`]; zero for l < 2.
///
/// # Errors
/// [`Error::Length`] unless both slices have the same length.
pub fn binned_mean(c: &[f64], out: &mut [f64]) -> Result<(), Error> {
    Error::check_len("binned spectrum", c.len(), out.len())?;
    let lmax = c.len().saturating_sub(1);
    for (l, out) in out.iter_mut().enumerate() {
        *out = 0.0;
        if l < 2 {
            continue;
        }
        let range = bin_range(l, lmax);
        let (mut sum, mut weight) = (0.0, 0.0);
        for (l, &c) in c.iter().enumerate().take(range.end).skip(range.start) {
            let w = 2.0 * l as f64 + 1.0;
            sum += w * c;
            weight += w;
        }
        *out = sum / weight;
    }
    Ok(())
}
