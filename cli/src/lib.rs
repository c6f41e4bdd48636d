//! The std layer of dust3d, the 3-D model of polarised Galactic dust: configuration, input and output, pictures, and the
//! stages of the pipeline, with threads. The kernels beneath it are `no_std` and live in [`dust3d_kernels`].
//!
//! | module | what lives there |
//! | --- | --- |
//! | [`command`] | the command line |
//! | [`config`] | every key of a configuration, its default and range |
//! | [`io`] | maps, observations, run directories, manifests |
//! | [`plot`] | pictures of maps |
//! | [`progress`] | who listens to a run |
//! | [`pipeline`], [`stages`] | the stages and their order |
//! | [`store`] | maps between stages, in memory or on disk |
//! | [`replay`] | a finished run's emission in any band |
//! | [`report`] | the figures, tables and verdict of a finished run |
//! | [`cut_sky`] | masks and spectra of a part of the sky |
//! | [`sht`] | spherical harmonic transforms |
//! | [`error`] | the one error type |
//!
//! # A complete example
//! A run of the built-in sky, from the configuration to a map in the caller's hands. With your own maps, the only
//! difference is `Some(Inputs::read(&config)?)` in place of `None`.
//!
//! ```
//! use dust3d::config::Draft;
//! use dust3d::io::{Run, RunDir};
//! use dust3d::kernels::simd::Level;
//! use dust3d::progress::Silent;
//! use dust3d::pipeline;
//!
//! # let place = std::env::temp_dir().join(format!("dust3d-doc-{}", std::process::id()));
//! # let dir = place.as_path();
//! // Defaults, then a file (`.file(path)`), then single keys: later ones win, and everything is checked at the end.
//! let config = Draft::new().put("nside", 8)?.put("seed", 42)?.set("frequencies=[95, 353]")?.finish()?;
//!
//! // The directory appears under its name when it is complete, or not at all.
//! let out = RunDir::create(dir, false)?;
//! // In the thread pool of the caller; a `Progress` of your own hears of every stage.
//! let manifest = pipeline::run(&config, None, &out, Level::detect(), &Silent)?;
//! let manifest = out.finish(manifest)?;
//! assert_eq!(manifest.layers, Some(6));
//!
//! // And read it back: every map by its name, checked against the hash in the manifest.
//! let run = Run::open(dir)?;
//! let q = run.map("emission/3d_95GHz_Q")?;
//! assert_eq!((q.nside, q.values.len()), (8, 768));
//! let parts: f64 = (1..=6).map(|i| run.map(&format!("templates/I_{i}")).map_or(f64::NAN, |map| map.values[0])).sum();
//! let total = run.map("emission/3d_353GHz_I")?.values[0];
//! assert!((parts / total - 1.0).abs() < 1e-12);
//! # std::fs::remove_dir_all(dir).ok();
//! # Ok::<(), dust3d::Error>(())
//! ```
//!
//! Single stages are plain functions from maps to maps ([`stages`]); transforms are reusable plans:
//!
//! ```
//! use dust3d::kernels::{Complex, healpix::Nside, sht::alm, simd::Level};
//! use dust3d::sht::{Analysis, ShtPlan};
//!
//! let (nside, lmax) = (Nside::new(16)?, 32);
//! let mut plan = ShtPlan::new(nside, lmax, Level::detect())?;
//! let mut dipole = vec![Complex::new(0.0, 0.0); alm::len(lmax)];
//! dipole[alm::index(lmax, 1, 0)] = Complex::new(1.0, 0.0);
//! let mut map = vec![0.0; nside.npix() as usize];
//! plan.synthesis(&dipole, &mut map)?;
//! let mut back = dipole.clone();
//! plan.analysis(&map, &mut back, &Analysis::default())?;
//! assert!(dipole.iter().zip(&back).all(|(a, b)| (a - b).norm() < 1e-6));
//! # Ok::<(), dust3d::Error>(())
//! ```
//!
//! More in `examples/`: `synthesise_map` (a random polarised sky, written as FITS), `one_frequency` (a run, layer by layer, at
//! one frequency).

pub mod command;
pub mod config;
pub mod cut_sky;
pub mod error;
pub mod io;
pub mod parallel;
pub mod pipeline;
pub mod plot;
pub mod progress;
pub mod random;
pub mod replay;
pub mod report;
pub mod sht;
pub mod stages;
pub mod store;

pub use config::Config;
pub use dust3d_kernels as kernels;
pub use error::{Error, ErrorKind, Result};
