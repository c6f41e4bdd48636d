//! Workloads shared by the benchmarks.

pub mod emission;
