//! End-to-end tests of the `dust3d` command and library.

mod config;
mod fits;
