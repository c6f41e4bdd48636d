//! Mode coupling: what a mask does to power spectra (MASTER, \[H02\]; polarisation, \[K01\], \[B05\]).
//!
//! The spectra of weighted maps, averaged over skies of spectra C, are C̃_l = Σ_l′ M_ll′ C_l′. With W the spectrum of the
//! weight map,
//!
//! | matrix | couples | M_ll′ / (2l′+1) = Σ_j (2j+1)/4π W_j × |
//! | --- | --- | --- |
//! | [`tt`](CouplingRow::tt) | TT | (l l′ j; 0 0 0)² |
//! | [`te`](CouplingRow::te) | TE, TB | (l l′ j; 0 0 0)(l l′ j; 2 −2 0) |
//! | [`same`](CouplingRow::same) | EE to EE, BB to BB, EB | (l l′ j; 2 −2 0)², l + l′ + j even |
//! | [`other`](CouplingRow::other) | EE to BB, BB to EE | (l l′ j; 2 −2 0)², l + l′ + j odd |
//!
//! (EB to EB is same − other.) A row costs about l′ + l terms an element, the matrix (2/3) lmax³ for each kind of symbol.
//! The sum over j ends where `mask` does: a spectrum of the weight up to 2 lmax makes it exact.
//!
//! * **\[H02\]** Hivon et al., ApJ 567, 2 (2002).
//! * **\[K01\]** Kogut et al., ApJS 148, 161 (2003), appendix; **\[B05\]** Brown, Castro & Taylor, MNRAS 360, 1262 (2005).

use super::wigner3j::{wigner3j_into, wigner3j_len};
use crate::Error;
use core::f64::consts::PI;

/// A row of each matrix, l fixed: element l′ for l′ = 0 … lmax.
#[derive(Debug)]
pub struct CouplingRow<'a> {
    /// TT from TT.
    pub tt: &'a mut [f64],
    /// TE from TE.
    pub te: &'a mut [f64],
    /// EE from EE.
    pub same: &'a mut [f64],
    /// EE from BB.
    pub other: &'a mut [f64],
}

/// Values of scratch that [`coupling_row_into`] needs for a row of lmax + 1 elements.
#[must_use]
pub const fn coupling_scratch_len(lmax: usize) -> usize {
    2 * (2 * lmax + 1)
}

/// Fills in row `l` of the matrices of a weight map with the spectrum `mask` (`mask[j]` = W_j, taken as zero beyond).
///
/// All four rows have lmax + 1 elements; `scratch` has at least [`coupling_scratch_len`]`(lmax)`, its contents do not
/// matter. Elements of polarisation with l or l′ below 2 are zero.
///
/// # Errors
/// [`Error::Length`] where the rows differ in length or scratch is too short; [`Error::Domain`] for l above lmax.
pub fn coupling_row_into(
    l: usize,
    mask: &[f64],
    row: CouplingRow<'_>,
    scratch: &mut [f64],
) -> Result<(), Error> {
    let n = row.tt.len();
    let Some(lmax) = n.checked_sub(1) else {
        return Error::check_len("row of TT", 1, 0);
    };
    Error::check_len("row of TE", n, row.te.len())?;
    Error::check_len("row of EE", n, row.same.len())?;
    Error::check_len("row of EE from BB", n, row.other.len())?;
    Error::check_scratch("scratch", coupling_scratch_len(lmax), scratch.len())?;
    Error::check_domain("l up to lmax", l as f64, l <= lmax)?;
    let (scalar, spin) = scratch.split_at_mut(2 * lmax + 1);
    let CouplingRow {
        tt,
        te,
        same,
        other,
    } = row;
    let elements = tt.iter_mut().zip(te).zip(same).zip(other).enumerate();
    for (l2, (((tt, te), same), other)) in elements {
        let len = wigner3j_len(l, l2);
        let (Some(scalar), Some(spin)) = (scalar.get_mut(..len), spin.get_mut(..len)) else {
            break; // len is at most 2 lmax + 1
        };
        wigner3j_into(l, l2, 0, scalar)?;
        wigner3j_into(l, l2, 2, spin)?;
        let first = l.abs_diff(l2);
        let mut sums = [0.0; 4];
        // From the least j on, l + l′ + j is even, odd, even, …
        let terms = scalar.iter().zip(spin.iter()).zip(mask.iter().skip(first));
        for (i, ((f0, f2), w)) in terms.enumerate() {
            let w = (2 * (first + i) + 1) as f64 * w;
            if i % 2 == 0 {
                sums[0] += w * f0 * f0;
                sums[1] += w * f0 * f2;
                sums[2] += w * f2 * f2;
            } else {
                sums[3] += w * f2 * f2;
            }
        }
        let factor = (2 * l2 + 1) as f64 / (4.0 * PI);
        *tt = factor * sums[0];
        *te = factor * sums[1];
        *same = factor * sums[2];
        *other = factor * sums[3];
    }
    Ok(())
}
