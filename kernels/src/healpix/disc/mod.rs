//! The pixels of a disc, as ranges of pixel numbers.
//!
//! A centre at (z, s = sin θ, φ) lies within r of (z₀, s₀, φ₀) where the squared chord
//!
//! (z − z₀)² + (s − s₀)² + 4 s s₀ sin²((φ − φ₀)/2) ≤ 4 sin²(r/2),
//!
//! a form that keeps its digits for small discs and at the poles. On a ring it is solved for φ; RING ranges come ring by
//! ring, at a cost of one arcsine a ring. NESTED ranges come from a walk down the quadtree that drops quads farther away
//! than their radius, takes those wholly inside, and opens the others: a cost per pixel of the rim. It begins with the
//! twelve faces, or, for a disc within one face, with a few pixels about as large as the disc.
//!
//! Nothing is allocated: ranges are handed to the caller's closure in ascending order, disjoint, neighbouring ones joined.

mod emit;
mod nested;
mod ring;
mod window;

pub use nested::nested_ranges;
pub use ring::ring_ranges;
pub(super) use window::Window;

use crate::scalar;

/// Which pixels belong to a disc.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Inclusion {
    /// Those whose centre lies within the radius.
    #[default]
    Centres,
    /// All that overlap with it, and a few that nearly do.
    ///
    /// A pixel is left out only if its centre is farther away than the radius plus the greatest pixel radius, or none of
    /// the sub-pixels that decide (`fact` times finer: in RING order those along its border, at the ends of every ring;
    /// in NESTED order all) has its centre within the radius plus the greatest sub-pixel radius. These are the rules of
    /// healpy's `query_disc(inclusive=True, fact=fact)`, whose default is 4.
    Overlapping {
        /// How many times finer the pixels are that decide, at least 1; a power of two in NESTED order.
        fact: u32,
    },
}

/// The squared chord of an angle between 0 and π.
#[inline]
fn squared_chord(angle: f64) -> f64 {
    let half = scalar::sin(0.5 * angle);
    4.0 * half * half
}
