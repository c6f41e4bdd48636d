//! Allocation-free, `no_std` kernels of dust3d, the 3-D model of polarised Galactic dust.
//!
//! Every kernel is a function over the caller's slices: it allocates nothing, panics on nothing, knows nothing of files
//! or threads, and gives the same bits on every run. Vector kernels take a [`simd::Level`], found once by the caller.
//!
//! | module | what lives there |
//! | --- | --- |
//! | [`units`] | SI constants, intensity units and their conversion |
//! | [`simd`] | eight f64 lanes on every machine, run-time choice of AVX2 or AVX-512, vector exp, ln, sin, cos |
//! | [`healpix`] | pixel numbers, angles, neighbours, rings, interpolation, discs |
//! | [`planck`] | Planck function, modified blackbodies, bandpasses |
//! | [`sht`] | spherical harmonic transforms, spin 0 and 2: the Legendre stage and ring phases |
//! | [`field`] | dust density, bisymmetric spiral field, line-of-sight integrals |
//! | [`fit`] | modified-blackbody fit of a pixel, pitch-angle objective, scan and refinement |
//! | [`split`] | sharing of polarisation residuals among layers, polarisation-fraction cap |
//! | [`random`] | reproducible streams and normal deviates |
//! | [`spectra`] | 2×2 square roots per multipole, power-law fits, windows |
//!
//! # Conventions
//! RING order unless said otherwise, Galactic coordinates, COSMO polarisation, radians, kpc, kelvin, GHz, MJy/sr.
//!
//! # Papers
//! * **\[MKD18\]** Martínez-Solaeche, Karakci & Delabrouille, MNRAS 476, 1310 (2018): the model.
//! * **\[G05\]** Górski et al., ApJ 622, 759 (2005): HEALPix.
//! * **\[I18\]** Ishioka, J. Meteorol. Soc. Japan 96, 241 (2018): Legendre recurrence in steps of two degrees.
//! * **\[RS13\]** Reinecke & Seljebotn, A&A 554, A112 (2013): fast spherical harmonic transforms.

#![no_std]
#[cfg(feature = "std")]
extern crate std;

pub mod error;
pub mod field;
pub mod fit;
pub mod healpix;
pub mod planck;
pub mod random;
pub mod scalar;
pub mod sht;
pub mod simd;
pub mod spectra;
pub mod split;
pub mod units;

pub use error::Error;
pub use num_complex::Complex;
