//! Polarisation of the layers: residual sharing and the polarisation-fraction cap (\[MKD18\], section 4.2).
//!
//! | module | what |
//! | --- | --- |
//! | [`residual`] | the observation's residual shared among the layers of one pixel |
//! | [`cap`] | no layer above p_max: neighbour passes, then the nearest feasible split |
//! | [`maps`] | both over ranges of pixels |

pub mod cap;
mod dual;
pub mod maps;
pub mod residual;

pub use cap::Outcome;
pub use maps::{Counts, renormalise_into, renormalise_scratch_len};
