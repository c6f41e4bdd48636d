//! Spherical harmonic transforms of HEALPix maps (RING order): [`ShtPlan`].
//!
//! A plan is made once for an Nside and lmax and used for any number of transforms: it holds rings, recurrence tables,
//! Fourier transforms and workspace. Coefficients are laid out as healpy does (m-major, [`kernels::sht::alm`](crate::kernels::sht::alm)), polarisation
//! is COSMO, E and B have healpy's signs.
//!
//! | method | what |
//! | --- | --- |
//! | [`synthesis`](ShtPlan::synthesis), [`synthesis_spin2`](ShtPlan::synthesis_spin2) | a_lm → map |
//! | [`adjoint_synthesis`](ShtPlan::adjoint_synthesis), … | Σ_p map(p) Y*_lm(p), the exact transpose |
//! | [`analysis`](ShtPlan::analysis), … | map → a_lm: quadrature with Jacobi iterations |
//! | [`analysis_to_accuracy`](ShtPlan::analysis_to_accuracy), … | map → a_lm: least squares by conjugate gradients |
//! | [`rotate_alms`] | a_lm → a_lm in other coordinates |
//! | `…_batch`, `…_mixed` | several maps, or scalar maps and spin-2 pairs, sharing recurrences; the same bits as one by one |
//!
//! Work is divided among the threads of the rayon pool of the caller; with one thread nothing leaves the calling one.
//! Results do not depend on the number of threads. [`Harmonics`] holds the coefficients of I, Q, U together.

mod analysis;
mod batch;
mod caps;
mod equidistant;
mod group;
mod harmonics;
mod legendre;
mod orders;
mod plan;
mod ring_stage;
mod rotation;
mod weights;
mod workers;

pub use analysis::{Analysis, Converged};
pub use harmonics::{Harmonics, Spectra, StokesView};
pub use plan::ShtPlan;
pub use rotation::rotate_alms;
