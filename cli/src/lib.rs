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
