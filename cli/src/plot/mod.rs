//! Pictures: diagrams of numbers ([`Chart`]) and of maps ([`MapPlot`]), the whole sky in Mollweide's projection, details in the gnomonic one, and the overview of a run.
//!
//! Galactic coordinates, l = 0 in the middle and increasing to the left, as one sees the sky from inside. Every screen
//! pixel is the mean of several samples of the map, each the value of the HEALPix pixel it falls in: no interpolation
//! invents structure. Missing pixels are grey.

mod axis;
pub(crate) mod base64;
pub(crate) mod canvas;
mod chart;
mod colours;
mod graticule;
pub mod overview;
mod projection;
mod scale;
mod sky;
pub(crate) mod surface;
pub(crate) mod svg;
pub(crate) mod text;

pub use chart::{Axis, Chart, Curve, Density, Spread, Style};
pub use colours::Colours;
pub use overview::Overview;
pub use projection::View;
pub use scale::Scale;
pub use sky::MapPlot;
