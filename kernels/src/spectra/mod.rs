//! Angular power spectra: windows, power-law fits, smoothing in bins of l, 2×2 square roots per multipole; and log-normal
//! fluctuations.
//!
//! A spectrum is a slice `c` with `c[l]` for l = 0 … lmax. All kernels cost O(lmax), [`binned_mean`] O(lmax²/5).

mod bins;
mod harmonics;
mod log_normal;
mod power_law;
mod roots;
mod window;

pub use bins::{bin_range, binned_mean};
pub use harmonics::{cross_spectrum, scale_by_l};
pub use log_normal::log_normal_into;
pub use power_law::{PowerLaw, fit_amplitude, fit_power_law, fit_range};
pub use roots::{Cov2, Lower2};
pub use window::{beam, beam_complement, fwhm_to_sigma};
