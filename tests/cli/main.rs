//! End-to-end tests of the `dust3d` command and library.

mod commands;
mod config;
mod emit_bands;
mod export;
mod fits;
mod manual;
mod maps;
mod pipeline;
mod plots;
mod presets;
mod properties;
mod realisations;
mod refusals;
mod report;
mod rotation;
mod shell;
mod sht;
