//! The configuration of a run: its keys, their defaults, how they are read and what they may be.
//!
//! A configuration is TOML ([`DEFAULT_TOML`] is complete and commented). [`Draft`] gathers a file, `key=value` overrides
//! and command-line flags, on top of a [`Preset`] if one is named, and [`Draft::finish`] makes of them a [`Config`] that is checked and has every value resolved.
//! Library users may as well fill in the plain structs and call [`Config::resolve`].

mod check;
mod draft;
mod frequency;
mod keys;
mod preset;

pub use draft::Draft;
pub use frequency::{MICRON_100_GHZ, parse_frequency};
pub use keys::{
    Config, Cube, Dtype, FieldConfig, Fit, Inputs, Keep, Laws, Layers, Monotone, Output,
    Polarisation, SmallScales, TeFilter,
};
pub use preset::Preset;

/// The complete default configuration with a comment on every key; reading it gives [`Config::default`].
pub const DEFAULT_TOML: &str = include_str!("default.toml");
