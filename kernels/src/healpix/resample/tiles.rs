//! Tiles: squares of 16 × 16 pixels of a face, consecutive in NESTED order.
//!
//! A circle x + y of a tile is a run of RING pixels, and its places in the tile come from a table of x and one of y: ring
//! numbers are computed once a run. And the next tile to the east, at x + 16 and y − 16, holds the next 16 pixels of the
//! same rings.
//!
//! So a whole map is walked through from tile to tile along the rings. The 31 rings of a tile are read, or written, from
//! end to end, and of each only a cache line or two are at work; going along the NESTED numbers instead, rings would be
//! left and come back to by the hundred, and in the belt, where they are all of one length, a power of two, their lines
//! would compete for the same few places of the caches. The tiles themselves, of 2 kB, may lie anywhere.

use super::super::Nside;
use super::super::faces::FacePixel;
use super::super::layout;
use crate::bits::spread_bits;

/// Pixels of a tile's side, and all of them.
pub(super) const SIDE: usize = 16;
pub(super) const TILE: usize = SIDE * SIDE;
const CIRCLES: usize = 2 * SIDE - 1;

/// By x: the place in the tile at y = 0.
const PLACES_X: [u16; SIDE] = {
    let mut places = [0; SIDE];
    let mut x = 0_usize;
    while x < SIDE {
        places[x] = spread_bits(x as u64) as u16;
        x += 1;
    }
    places
};

/// By 15 − y: the place in the tile at x = 0.
const PLACES_Y: [u16; SIDE] = {
    let mut places = [0; SIDE];
    let mut y = 0_usize;
    while y < SIDE {
        places[SIDE - 1 - y] = PLACES_X[y] << 1;
        y += 1;
    }
    places
};

/// Does φ = 0 go through a tile?
#[inline]
const fn on_meridian(south: FacePixel) -> bool {
    south.face == 4 && south.x == south.y
}

/// Do the rings of a tile begin anew in it or at its western corner?
#[inline]
const fn wraps(south: FacePixel) -> bool {
    on_meridian(south) || (south.face == 4 && south.x == south.y + SIDE as u64)
}

/// The RING pixels where the circles of a tile begin, in the west.
#[derive(Clone, Copy)]
pub(super) struct Runs([usize; CIRCLES]);

impl Runs {
    /// Of the tile whose southern corner is `south`; none if φ = 0 goes through it.
    #[inline]
    pub(super) fn of(nside: Nside, south: FacePixel) -> Option<Self> {
        if on_meridian(south) {
            return None;
        }
        let mut first = [0; CIRCLES];
        for (circle, first) in first.iter_mut().enumerate() {
            let x = circle.saturating_sub(SIDE - 1);
            let west = FacePixel {
                face: south.face,
                x: south.x + x as u64,
                y: south.y + (circle - x) as u64,
            };
            *first = layout::pixel_number(nside, west.to_ring(nside)) as usize;
        }
        Some(Self(first))
    }

    /// Of the next tile to the east on the same face, if φ = 0 is not in it or at its western corner.
    #[inline]
    const fn next(mut self) -> Self {
        let mut circle = 0;
        while circle < CIRCLES {
            self.0[circle] += SIDE;
            circle += 1;
        }
        self
    }

    /// Hands on every circle: its RING pixels' first number, how many they are, and the places in the tile by x and by y,
    /// to be added up.
    #[inline(always)]
    fn each(&self, mut run: impl FnMut(usize, &'static [u16], &'static [u16])) {
        for (circle, &first) in self.0.iter().enumerate() {
            let west = circle.saturating_sub(SIDE - 1);
            let len = SIDE.min(circle + 1) - west;
            let from = SIDE - 1 - (circle - west);
            run(
                first,
                &PLACES_X[west..west + len],
                &PLACES_Y[from..from + len],
            );
        }
    }

    /// Fills the tile from a RING map.
    #[inline(always)]
    pub(super) fn fill<T: Copy>(&self, ring: &[T], tile: &mut [T; TILE]) {
        self.each(|first, x, y| {
            if let Some(values) = ring.get(first..first + x.len()) {
                for ((&value, x), y) in values.iter().zip(x).zip(y) {
                    tile[usize::from(x | y) % TILE] = value;
                }
            }
        });
    }

    /// Writes the tile to a RING map.
    #[inline(always)]
    pub(super) fn empty<T: Copy>(&self, tile: &[T; TILE], ring: &mut [T]) {
        self.each(|first, x, y| {
            if let Some(values) = ring.get_mut(first..first + x.len()) {
                for ((value, x), y) in values.iter_mut().zip(x).zip(y) {
                    *value = tile[usize::from(x | y) % TILE];
                }
            }
        });
    }
}

/// Visits all tiles of a map along the rings: with the numbers of the tile and of the one visited next, and the tile's runs.
#[inline(always)]
pub(super) fn along_rings(
    nside: Nside,
    order: u32,
    mut visit: impl FnMut(usize, usize, Option<&Runs>),
) {
    let side = nside.get() / SIDE as u64;
    for face in 0..12 {
        for sum in 0..(2 * side).saturating_sub(1) {
            let south = |x: u64| FacePixel {
                face,
                x: x * SIDE as u64,
                y: (sum - x) * SIDE as u64,
            };
            let number = |x: u64| south(x).to_nested(order) as usize / TILE;
            let (first, last) = (sum.saturating_sub(side - 1), sum.min(side - 1));
            let mut runs: Option<Runs> = None;
            for x in first..=last {
                let at = south(x);
                runs = match runs {
                    Some(runs) if !wraps(at) => Some(runs.next()),
                    _ => Runs::of(nside, at),
                };
                visit(number(x), number(last.min(x + 1)), runs.as_ref());
            }
        }
    }
}
