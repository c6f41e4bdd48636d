//! Layout of harmonic coefficients: m-major, m = 0 … lmax, for each m the degrees l = m … lmax.
//!
//! Only m ≥ 0 is stored: the maps are real, a_{l,−m} = (−1)^m conj(a_lm).

/// Number of coefficients up to `lmax` (with mmax = lmax).
#[must_use]
pub const fn len(lmax: usize) -> usize {
    (lmax + 1) * (lmax + 2) / 2
}

/// Position of (l, m), 0 ≤ m ≤ l ≤ lmax: m(2 lmax + 1 − m)/2 + l.
///
/// ```
/// use dust3d_kernels::sht::alm;
/// assert_eq!(alm::index(3, 0, 0), 0);
/// assert_eq!(alm::index(3, 1, 1), 4);
/// assert_eq!(alm::index(3, 3, 3), alm::len(3) - 1);
/// ```
#[must_use]
pub const fn index(lmax: usize, l: usize, m: usize) -> usize {
    m * (2 * lmax + 1 - m) / 2 + l
}
