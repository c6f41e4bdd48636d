//! Dust density, bisymmetric spiral field and line-of-sight ratios (\[MKD18\], sections 3.2 and 4.2).
//!
//! | module | what |
//! | --- | --- |
//! | [`density`] | n_d(R, z), the smooth dust disc |
//! | [`column`] | column density of distance shells |
//! | [`spiral`] | the bisymmetric spiral (BSS) field: vector and direction |
//! | [`line_of_sight`] | Q_m/I_m and U_m/I_m of distance layers, for one pitch angle or many |
//!
//! Galactocentric frame: x from the Sun towards the centre (l = 0), y towards l = 90°, z to the north Galactic pole,
//! the Sun at (−R⊙, 0, 0); R² = x² + y², θ = atan2(y, x), so θ = π at the Sun.

pub mod column;
pub mod density;
pub mod line_of_sight;
mod mesh;
mod panel;
pub mod spiral;

pub use density::Density;
pub use line_of_sight::{Grains, Model};
pub use spiral::Spiral;

pub(crate) use mesh::{Panels, Turn};
pub(crate) use panel::{Depolarisation, polarise};
