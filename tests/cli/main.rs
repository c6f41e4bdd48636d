//! End-to-end tests of the `dust3d` command and library.

mod commands;
mod config;
mod fits;
mod maps;
mod plots;
mod refusals;
mod shell;
mod sht;
