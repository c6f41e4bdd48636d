//! The stages of the model: plain functions from maps to maps, in the order of the paper.
//!
//! | stage | \[MKD18\] | what it makes |
//! | --- | --- | --- |
//! | [`builtin_sky`] | – | observations from nothing, for a machine without data |
//! | [`observations`] | 3 | the observed maps on the working grid, fitted where needed |
//! | [`fractions`] | 4.1 | the share of the dust in each layer |
//! | [`intensity`] | 4.1 | intensity of each layer |
//! | [`field`] | 4.2 | polarisation fractions of each layer from the galactic field |
//! | [`pitch`] | 4.2 | the pitch angle of the field |
//! | [`polarisation`] | 4.2 | Q, U of each layer: predicted, then made to add up to the observed |
//! | [`small_scales`] | 5 | random fluctuations beyond the observed resolution: the templates |
//! | [`laws`] | 6 | temperature and spectral index of each layer |
//! | [`emission`] | 4.1, 6 | maps at any frequency |
//!
//! [`regrid`] changes Nside, [`mirror`] makes the south of the north. \[MKD18\] = Martínez-Solaeche, Karakci & Delabrouille, MNRAS 476, 1310 (2018).

pub mod builtin_sky;
pub mod emission;
pub mod field;
pub mod fractions;
pub mod intensity;
pub mod laws;
pub mod mirror;
pub mod observations;
pub mod pitch;
pub mod polarisation;
pub mod regrid;
pub mod small_scales;
