//! Eight pixels a vector.
//!
//! Pixel numbers, ring numbers and coordinates on faces are whole numbers below 2⁵², and are carried as f64, where
//! products, quotients and roots are single instructions; only the interleaving of NESTED bits and the numbers of
//! [RING pixels in NESTED order](renumber) work on words. This holds up to [`LIMIT`]; finer grids take the scalar kernels.
//!
//! Both halves of the sky and all three zones go through the same instructions, with selections at the few places where
//! they differ; square roots and quotients, which only the caps need, are passed over when no lane is in a cap. A lane's
//! result never depends on its neighbours, so the bits do not depend on how a slice is cut.
//!
//! Directions need no inverse functions but one: in the caps √(3 (1 − |z|)) = √6 sin(θ′/2), with θ′ from the nearer
//! pole, and in the belt z = sin(π/2 − θ), so that a pixel number takes a single sine of an angle below π/4, and a centre
//! a single arcsine. Nothing cancels, at the poles or at the equator.

mod around;
mod estimate;
mod grid;
mod place;
mod points;
mod quads;
mod renumber;
mod rim;
mod slices;
mod stencil;
mod zone;

pub(super) use around::{nested_neighbours, ring_neighbours};
pub(super) use points::{ang2pix, nest2ring, pix2ang, pix2vec, vec2pix};
pub(super) use quads::{LEVELS, Near, Quads, quads};
pub(super) use renumber::ring2nest;
pub(super) use rim::{Arc, Arcs, Disc, arcs};
pub(super) use stencil::stencils;

use super::Nside;

/// The greatest Nside of the vector kernels: 12 Nside² and the rings' square roots stay exact by a wide margin.
const LIMIT: u64 = 1 << 22;

/// Is the grid coarse enough for the vector kernels?
#[inline]
pub(super) const fn fits(nside: Nside) -> bool {
    nside.get() <= LIMIT
}
