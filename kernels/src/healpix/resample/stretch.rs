//! Consecutive pixels of a ring within one face.

use super::super::Nside;
use super::super::faces::FacePixel;
use super::super::layout::{self, RingPixel, quarter_length};

/// Pixels that are neighbours on a ring and in a face: x grows and y falls by one from each to the next.
pub(super) struct Stretch {
    at: RingPixel,
    /// The westernmost.
    pub(super) west: FacePixel,
    /// How many.
    pub(super) len: u64,
}

impl Stretch {
    /// From a place on a ring to the end of the ring or the face.
    fn from(nside: Nside, at: RingPixel) -> Self {
        let west = FacePixel::from_ring(nside, at);
        let to_border = (nside.get() - 1 - west.x).min(west.y) + 1;
        let to_end = 4 * quarter_length(nside.get(), at.ring) - at.index;
        Self {
            at,
            west,
            len: to_border.min(to_end),
        }
    }

    /// From a pixel on; from the last one if there is no such pixel.
    pub(super) fn from_pixel(nside: Nside, pixel: u64) -> Self {
        let last = nside.npix() - 1;
        Self::from(nside, layout::locate_valid(nside, pixel.min(last)))
    }

    /// The one after; this one again at the end of the map.
    pub(super) fn next(&self, nside: Nside) -> Self {
        let RingPixel { ring, index } = self.at;
        let index = index + self.len;
        let at = if index < 4 * quarter_length(nside.get(), ring) {
            RingPixel { ring, index }
        } else if ring < nside.nrings() {
            RingPixel {
                ring: ring + 1,
                index: 0,
            }
        } else {
            self.at
        };
        Self::from(nside, at)
    }
}
