//! End-to-end tests of the `dust3d` command and library.

mod commands;
mod config;
mod fits;
mod maps;
mod pipeline;
mod plots;
mod properties;
mod realisations;
mod refusals;
mod report;
mod rotation;
mod shell;
mod sht;
