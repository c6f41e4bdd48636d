//! Where on its face a small disc lies.
//!
//! Pixels are found from the quadtree, and for a disc of a few pixels the way down from the twelve faces would be most of
//! the work. On one face, with coordinates x and y that run from 0 to 1 (\[G05\], §5, Eqs. 19–22), these change over an
//! angle a by at most 1.5 a: in the caps, where they are w √6 sin(θ′/2) with 0 ≤ w ≤ 1 a fraction of a quarter turn, the
//! gradient is below
//!
//! √(6/4 + (2/π)² 6/(4 cos²(θ′/2))) < 1.5,
//!
//! in the belt below 1.03. So a square around the centre holds the disc, unless it reaches beyond the face.

use super::super::faces::FacePixel;
use super::super::{Location, Nside};

/// Places of a square on a face, in units of the finest pixels; first and last ones.
#[derive(Clone, Copy)]
pub(in super::super) struct Window {
    pub(in super::super) face: u64,
    pub(in super::super) x: [u64; 2],
    pub(in super::super) y: [u64; 2],
}

/// The level of the finest pixels.
const FINEST: u32 = Nside::MAX.get().trailing_zeros();

/// Finest pixels by which rounding, of z² + sin² θ to 1e-9 in the first place, may displace a centre; generous.
const SPARE: u64 = 8;

impl Window {
    /// The square around what lies within `reach` of the centre, if it is on one face.
    #[inline]
    pub(super) fn around(centre: Location, reach: f64) -> Option<Self> {
        let margin = (1.5 * reach * Nside::MAX.as_f64()) as u64 + 1 + SPARE;
        let at = FacePixel::from_location(Nside::MAX, centre);
        let side = |place: u64| {
            let (first, last) = (place.checked_sub(margin)?, place.checked_add(margin)?);
            (first > 0 && last < Nside::MAX.get() - 1).then_some([first, last])
        };
        Some(Self {
            face: at.face,
            x: side(at.x)?,
            y: side(at.y)?,
        })
    }

    /// The pixel of a level that holds the square, if it is one.
    #[inline]
    pub(super) fn only(&self, level: u32) -> Option<FacePixel> {
        let [south, .., north] = self.corners(level);
        (south == north).then_some(north)
    }

    /// The deepest level above `order` by a multiple of three where at most 2 × 2 pixels hold the square.
    #[inline]
    pub(in super::super) fn level(&self, order: u32) -> Option<u32> {
        let mut level = order.checked_sub(3)?;
        loop {
            let shift = FINEST - level;
            let pixels = |[first, last]: [u64; 2]| (last >> shift) - (first >> shift);
            if pixels(self.x) <= 1 && pixels(self.y) <= 1 {
                return Some(level);
            }
            level = level.checked_sub(3)?;
        }
    }

    /// The pixels of a level that hold the corners, in ascending order; repeated where they are fewer than four.
    #[inline]
    pub(in super::super) fn corners(&self, level: u32) -> [FacePixel; 4] {
        let shift = FINEST - level;
        let at = |x: u64, y: u64| FacePixel {
            face: self.face,
            x: x >> shift,
            y: y >> shift,
        };
        let ([west, east], [south, north]) = (self.x, self.y);
        let (right, left) = (at(east, south), at(west, north));
        // x and y grow along either: only these two may be in either order.
        let [first, second] = if right.to_nested(level) < left.to_nested(level) {
            [right, left]
        } else {
            [left, right]
        };
        [at(west, south), first, second, at(east, north)]
    }

    /// The rows of a level: first and last y.
    #[inline]
    pub(in super::super) const fn rows(&self, level: u32) -> [u64; 2] {
        [self.y[0] >> (FINEST - level), self.y[1] >> (FINEST - level)]
    }
}
