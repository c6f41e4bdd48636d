//! End-to-end tests of the `dust3d` command and library.

mod commands;
mod config;
mod pipeline;
mod fits;
mod maps;
mod plots;
mod refusals;
mod rotation;
mod shell;
mod sht;
