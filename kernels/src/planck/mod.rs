//! Planck function, modified blackbodies and bandpasses: how the dust of a layer shines at any frequency.
//!
//! | module | quantity |
//! | --- | --- |
//! | [`spectrum`] | B_ν(T), ∂B_ν/∂T, Rayleigh–Jeans factor, B_ν(T)/B_ν₀(T) |
//! | [`mbb`] | X_ν = X_ν₀ (ν/ν₀)^β B_ν(T)/B_ν₀(T) for I, Q, U, at lists of frequencies and bands in one pass |
//! | [`bandpass`] | weights of a band in any unit |
//!
//! Everything is in GHz, K and MJy/sr.

pub mod bandpass;
pub mod mbb;
pub mod spectrum;

pub use spectrum::planck_mjysr;
