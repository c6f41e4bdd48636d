//! Allocation-free, `no_std` kernels of dust3d, the 3-D model of polarised Galactic dust.
//!
//! Every kernel is a function over the caller's slices: it allocates nothing, panics on nothing, knows nothing of files
//! or threads, and gives the same bits on every run. Vector kernels take a [`simd::Level`], found once by the caller.
//!
//! | module | what lives there |
//! | --- | --- |
//! | [`units`] | SI constants, intensity units and their conversion |
//! | [`simd`] | eight f64 lanes on every machine, run-time choice of AVX2 or AVX-512, vector exp, ln, sin, cos |
//! | [`fourier`] | Fourier transforms of eight sequences at once |
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
//! # A complete example
//! Everything a program without an allocator needs: memory of its own, the level of the CPU, slices. This makes the dust
//! emission of a small sky at 150 GHz from one layer, in µK_CMB.
//!
//! ```
//! use dust3d_kernels::field::{Model, line_of_sight::{ratios_into, ratios_scratch_len}};
//! use dust3d_kernels::healpix::{Nside, ring};
//! use dust3d_kernels::planck::mbb::{MbbNode, mbb_add_iqu};
//! use dust3d_kernels::{Error, simd::Level, units::{NU0_GHZ, Unit}};
//!
//! const NPIX: usize = 48;
//!
//! fn sky(level: Level) -> Result<[[f64; NPIX]; 3], Error> {
//!     let nside = Nside::new(2)?;
//!     let mut directions = [[0.0; 3]; NPIX];
//!     for (pixel, direction) in (0..).zip(&mut directions) {
//!         *direction = ring::pix2vec(nside, pixel)?;
//!     }
//!     // Polarisation fractions of the dust within 1 kpc, in the field of the paper.
//!     let (mut q, mut u) = ([0.0; NPIX], [0.0; NPIX]);
//!     let mut scratch = [0.0; ratios_scratch_len()];
//!     ratios_into(level, &Model::default(), &[0.0, 1.0], &directions, &mut [&mut q], &mut [&mut u], &mut scratch)?;
//!     // A sky of 1 MJy/sr at 353 GHz, T = 19.4 K, beta = 1.6; a band is a list of frequencies with weights.
//!     let band = [MbbNode::new(150.0, NU0_GHZ, Unit::MicroKCmb.from_mjysr(150.0)?)?];
//!     let mut out = [[0.0; NPIX]; 3];
//!     let [i, qq, uu] = &mut out;
//!     mbb_add_iqu(
//!         level,
//!         &[&band],
//!         [&[1.0; NPIX], &q, &u],
//!         &[19.4; NPIX],
//!         &[1.6; NPIX],
//!         &mut [i, qq, uu],
//!     )?;
//!     Ok(out)
//! }
//!
//! // With the feature `std` (the default) the level is found at run time; without it, choose: Level::portable().
//! let [i, q, u] = sky(Level::detect())?;
//! assert!((i[0] - 151.9865278975364).abs() < 1e-10);
//! assert!((0..NPIX).all(|p| q[p].hypot(u[p]) <= 0.2 * i[p]));
//! assert_eq!(sky(Level::portable())?[1].map(|q| q.is_finite()), [true; NPIX]);
//! # Ok::<(), Error>(())
//! ```
//!
//! More in `examples/`: `line_of_sight` (the field and the layers towards one direction), `fit_pixel` (a modified blackbody
//! through four intensities). `std` changes no result; `default-features = false` leaves a crate that needs nothing but `core`.
//!
//! # Papers
//! * **\[MKD18\]** Martínez-Solaeche, Karakci & Delabrouille, MNRAS 476, 1310 (2018): the model.
//! * **\[G05\]** Górski et al., ApJ 622, 759 (2005): HEALPix.
//! * **\[I18\]** Ishioka, J. Meteorol. Soc. Japan 96, 241 (2018): Legendre recurrence in steps of two degrees.
//! * **\[RS13\]** Reinecke & Seljebotn, A&A 554, A112 (2013): fast spherical harmonic transforms.

#![no_std]
#[cfg(feature = "std")]
extern crate std;

mod bits;
pub mod error;
pub mod field;
pub mod fit;
pub mod fourier;
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
