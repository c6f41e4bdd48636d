//! Where a circle on the sphere cuts the rings, eight rings at a time.
//!
//! ```text
//! for each zone (cap, belt, cap), for each eight of its rings:
//!     estimate the arcs; where a pixel's centre is too close to the rim for that, compute them
//!     first and last pixel of the arc, and of its second part where it reaches across φ = 0
//! ```
//!
//! * Zone by zone, nothing is left to select: in the belt all rings are equally long, and eight rings on, the same ones
//!   are shifted; in the caps all are.
//! * Which pixels an arc holds is a matter of whole numbers, for which an [`estimate`](super::estimate) is enough nearly
//!   always, without roots or quotients; the rest are [computed](super::zone) to the last bits.
//! * Arcs that end inside their rings cannot touch the next one's, and are handed on without looking.

use super::super::layout::first_pixel;
use super::super::{Location, Nside};
use super::estimate::Limits;
use super::grid::Grid;
use super::zone::Zone;
use crate::dispatch;
use crate::simd::{Lanes, Level};
use core::ops::Range;

/// A disc: its centre, and the squared chord of its radius.
#[derive(Clone, Copy)]
pub(in super::super) struct Disc {
    pub(in super::super) nside: Nside,
    pub(in super::super) centre: Location,
    /// φ of the centre in quarter turns, 0 … 4.
    pub(in super::super) turns: f64,
    pub(in super::super) chord2: f64,
}

/// The part of a ring inside a disc.
#[derive(Clone, Copy, Default)]
pub(in super::super) struct Arc {
    pub(in super::super) ring: u64,
    /// The ring's first pixel and its length.
    pub(in super::super) first: u64,
    pub(in super::super) len: u64,
    /// The arc's westernmost place on the ring, below its length, and its own length, which may reach across φ = 0.
    pub(in super::super) west: u64,
    pub(in super::super) count: u64,
}

/// Vectors that wait before they are handed on: what follows from one another in one takes as long as several do side by
/// side.
const DELAY: u64 = 3;
const WAITING: usize = DELAY as usize + 1;

/// How the arcs of eight rings lie.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum Kind {
    /// One a ring, none empty, none touching another ring.
    Apart,
    /// All reach across φ = 0, but not around: `start` of the eastern, `end` of the western part.
    Around,
    /// All rings are inside.
    Whole,
    /// Any, or none.
    #[default]
    Plain,
    /// Any; some reach across φ = 0: those have an eastern range, too.
    Across,
}

/// Eight rings' arcs as ranges of pixels; empty where start and end are equal.
#[derive(Clone, Copy, Default)]
#[repr(align(64))]
pub(super) struct Ranges {
    pub(super) start: [u64; 8],
    pub(super) end: [u64; 8],
    pub(super) eastern_start: [u64; 8],
    pub(super) eastern_end: [u64; 8],
    pub(super) kind: Kind,
}

/// Takes the arcs of a disc, from the north.
pub(in super::super) trait Arcs {
    /// Are they wanted as arcs, or as ranges of pixels?
    const AS_ARCS: bool;

    /// The pixels `start` … `end` − 1; none if `start` = `end`.
    fn range(&mut self, start: u64, end: u64);
    /// Ranges, none of them empty, or touching another or those before.
    fn ranges_apart(&mut self, start: &[u64], end: &[u64]);
    /// Rings that follow one another and make up `pixels`, all but those from every `end` to `start`; none is empty.
    fn ranges_around(&mut self, pixels: Range<u64>, start: &[u64], end: &[u64]);
    /// An arc, not empty.
    fn arc(&mut self, arc: Arc);
}

impl Ranges {
    /// Hands on the arcs of rings `from` ..= `to`, up to eight.
    #[inline(always)]
    fn hand_on<S: Arcs>(&self, n: u64, from: u64, to: u64, arcs: &mut S) {
        let live = (to - from) as usize & 7;
        let (start, end) = (&self.start[..=live], &self.end[..=live]);
        match self.kind {
            Kind::Apart => arcs.ranges_apart(start, end),
            Kind::Around => {
                arcs.ranges_around(first_pixel(n, from)..first_pixel(n, to + 1), start, end);
            }
            Kind::Whole => arcs.range(first_pixel(n, from), first_pixel(n, to + 1)),
            Kind::Plain | Kind::Across => {
                for lane in 0..=live {
                    arcs.range(start[lane], end[lane]);
                    if self.kind == Kind::Across {
                        arcs.range(self.eastern_start[lane], self.eastern_end[lane]);
                    }
                }
            }
        }
    }
}

impl<L: Lanes> Zone<L> {
    /// The arcs of rings `from` ..= `to` as ranges.
    #[inline(always)]
    fn run_ranges<S: Arcs, const CAP: bool>(&self, n: u64, from: u64, to: u64, arcs: &mut S) {
        let mut waiting = [Ranges::default(); WAITING];
        let mut ring = from;
        let mut slot = 0;
        while ring < to.saturating_add(1 + 8 * DELAY) {
            if ring <= to {
                self.ranges::<CAP>(ring, &mut waiting[slot % WAITING]);
            }
            slot += 1;
            if let Some(ready) = ring.checked_sub(8 * DELAY)
                && ready >= from
            {
                waiting[slot % WAITING].hand_on(n, ready, to.min(ready + 7), arcs);
            }
            ring += 8;
        }
    }

    #[inline(always)]
    fn run<S: Arcs, const CAP: bool>(&self, n: u64, from: u64, to: u64, arcs: &mut S) {
        if !S::AS_ARCS {
            return self.run_ranges::<S, CAP>(n, from, to, arcs);
        }
        let mut ring = from;
        while ring <= to {
            let live = (to - ring + 1).min(8);
            self.arcs::<S, CAP>(ring, live, arcs);
            ring += live;
        }
    }
}

#[inline(always)]
fn body<L: Lanes, S: Arcs>(token: L::Token, disc: &Disc, north: u64, south: u64, to: &mut S) {
    let grid = Grid::<L>::new(token, disc.nside);
    let n = disc.nside.get();
    let zone = Zone {
        grid,
        sign: grid.one,
        pole_ring: grid.zero,
        pole_pixel: grid.zero,
        shift: grid.half,
        turns: grid.c(disc.turns),
        z: grid.c(disc.centre.z),
        sin_theta: grid.c(disc.centre.sin_theta),
        four_sin_theta: grid.c(4.0 * disc.centre.sin_theta),
        chord2: grid.c(disc.chord2),
        limits: Limits::new(token, disc),
    };
    zone.run::<S, true>(n, north, south.min(n - 1), to);
    let first = north.max(n);
    let alternating = L::load(token, &[0.5, 0.0, 0.5, 0.0, 0.5, 0.0, 0.5, 0.0]);
    let belt = Zone {
        // Shifted an even number of rings from the edge.
        shift: if (first - n).is_multiple_of(2) {
            alternating
        } else {
            grid.half - alternating
        },
        ..zone
    };
    belt.run::<S, false>(n, first, south.min(3 * n), to);
    let cap = Zone {
        sign: -grid.one,
        pole_ring: grid.turn,
        pole_pixel: grid.npix,
        ..zone
    };
    cap.run::<S, true>(n, north.max(3 * n + 1), south, to);
}

/// The arcs of a disc on the rings `north` ..= `south`, from the north; empty ones are left out.
pub(in super::super) fn arcs<S: Arcs>(
    level: Level,
    disc: &Disc,
    north: u64,
    south: u64,
    to: &mut S,
) {
    dispatch!(level, |token: L| body::<L, S>(
        token, disc, north, south, to
    ));
}
