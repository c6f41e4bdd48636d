//! Angular power spectra: windows, power-law fits, smoothing in bins of l, 2×2 square roots per multipole, mode coupling
//! by masks; and log-normal fluctuations.
//!
//! A spectrum is a slice `c` with `c[l]` for l = 0 … lmax. All kernels cost O(lmax), but [`binned_mean`] O(lmax²/5) and
//! [`coupling_row_into`] O(lmax²).

mod bins;
mod coupling;
mod harmonics;
mod log_normal;
mod power_law;
mod roots;
mod wigner3j;
mod window;

pub use bins::{bin_range, binned_mean};
pub use coupling::{CouplingRow, coupling_row_into, coupling_scratch_len};
pub use harmonics::{cross_spectrum, scale_by_l};
pub use log_normal::log_normal_into;
pub use power_law::{PowerLaw, fit_amplitude, fit_power_law, fit_range};
pub use roots::{Cov2, Lower2};
pub use wigner3j::{wigner3j_into, wigner3j_len};
pub use window::{beam, beam_complement, fwhm_to_sigma};
