//! Tests of the kernels: spectra.
