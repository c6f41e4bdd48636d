//! Spherical harmonic transforms: everything but the memory and the threads.
//!
//! A map and its coefficients are linked by
//! f(θ, φ) = Σ_lm a_lm λ_lm(θ) e^{imφ}, λ_lm = √((2l+1)/4π · (l−m)!/(l+m)!) P_lm(cos θ) with the (−1)^m of Condon and
//! Shortley. On rings of equal colatitude this splits in two stages \[RS13\]: *Legendre*, for every m,
//! F_m(θ) = Σ_l a_lm λ_lm(θ), and *rings*, a Fourier transform along φ for every ring. These modules hold the Legendre
//! stage in both directions, the passage from F_m to the pixels of rings, and the tables of both
//! ([`fourier`](crate::fourier) the transforms between); the caller brings memory and threads.
//!
//! | file | what |
//! | --- | --- |
//! | `alm` | layout of a_lm |
//! | `rings` | eight ring pairs as one [`RingBlock`]: colatitudes, polar limit |
//! | `double` | logarithms and products in twice the digits, for the tables |
//! | `recurrence` | two-degree recurrence of \[I18\], its coefficients for one m |
//! | `start` | first value s^m as mantissa and scale, however small |
//! | `legendre` | spin 0 (and spin 2 away from the poles): what both directions share |
//! | `synthesis`, `adjoint` | their inner loops |
//! | `mixing` | a_lm ↔ coefficients of the recurrence's basis; E, B ↔ two scalar-like sets |
//! | `wigner` | spin 2 near the poles, by spin-weighted functions |
//! | `wigner_adjoint` | its transpose |
//! | `resampling` | F_m on few equidistant rings → a fine grid |
//! | `window` | fine grid → F_m on the rings of the map |
//! | `ring_spectrum` | F_m ↔ harmonics of rings: shift of the first pixel, pairs of rings |
//! | `belt` | … of rings of equal length, eight at once, and their pixels |
//! | `cap`, `cap_pixels` | … of the others, by quarters, and their pixels |
//!
//! # Cost
//! Per pair of degrees and pair of rings: 2 FMA of recurrence and 4 per real-valued map; spin 2 counts as two maps
//! with one recurrence (10 FMA) except near the poles (24 FMA).

mod adjoint;
pub mod alm;
mod belt;
mod cap;
mod cap_pixels;
mod double;
mod legendre;
mod mixing;
mod recurrence;
mod resampling;
mod ring_spectrum;
mod rings;
mod start;
mod synthesis;
mod wigner;
mod wigner_adjoint;
mod window;

pub use crate::simd::{Aligned, Stores};
pub use adjoint::{Line, adjoint, adjoint_scratch_len};
pub use belt::{
    belt_from_pixels, belt_spectrum_from_phases, phases_from_belt_spectrum, pixels_from_belt,
};
pub use cap::{
    CAP_MAPS, CapRing, CapRings, cap_factors, cap_length, cap_room, cap_spectrum_from_phases,
    phases_from_cap_spectrum,
};
pub use cap_pixels::{CapWindow, cap_from_pixels, pixels_from_cap};
pub use legendre::{Coefficient, PhaseBlock, PhaseIndex};
pub use mixing::{
    mixing_scratch_len, scalar_coefficients, scalar_from_sums, spin_factor_len, spin_factor_table,
    spin2_coefficients, spin2_from_sums,
};
pub use recurrence::{Step, epsilon_len, epsilon_table, start_norms, step_count, step_table};
pub use resampling::{
    Carrier, ORDERS, Resampling, equidistant_carriers, grid_from_phases, phases_from_grid,
    resampling_factors, resampling_lengths,
};
pub use ring_spectrum::{PhaseTable, PhaseTile, RingShapes, phase_table, phase_table_len};
pub use rings::{RingBlock, equidistant_ring_blocks, healpix_ring, ring_block_count, ring_blocks};
pub use synthesis::synthesis;
pub use wigner::{
    WignerStep, wigner_coefficients, wigner_from_sums, wigner_norms, wigner_step_count,
    wigner_step_table, wigner_synthesis,
};
pub use wigner_adjoint::{wigner_adjoint, wigner_adjoint_scratch_len};
pub use window::{MARGIN, RingTaps, TAPS, add_to_fine, phases_from_fine, ring_taps};
