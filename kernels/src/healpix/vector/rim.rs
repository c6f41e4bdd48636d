//! Where a circle on the sphere cuts the rings, eight rings at a time.
//!
//! ```text
//! for each zone (cap, belt, cap), for each eight of its rings:
//!     z, s of the rings → sin²(Δφ/2) = (4 sin²(r/2) − (z − z₀)² − (s − s₀)²) / (4 s s₀) → Δφ in pixels of the ring
//!     first and last pixel of the arc, and of its second part where it reaches across φ = 0
//! ```
//!
//! * Zone by zone, nothing is left to select: in the belt all rings are equally long, and eight rings on, the same ones
//!   are shifted; in the caps all are.
//! * Nothing cancels: beyond a quarter turn, Δφ comes from its complement.

use super::super::{Location, Nside};
use super::grid::Grid;
use crate::dispatch;
use crate::simd::atan::arcsine;
use crate::simd::{Bits, Lanes, Level, Mask};
use core::f64::consts::FRAC_2_PI;

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

/// Vectors at a time: roots and quotients of one take as long as several do side by side.
const BLOCK: usize = 4;

/// Eight rings' arcs as ranges of pixels; empty where start and end are equal.
#[derive(Clone, Copy, Default)]
#[repr(align(64))]
struct Ranges {
    start: [u64; 8],
    end: [u64; 8],
    eastern_start: [u64; 8],
    eastern_end: [u64; 8],
    /// Do any reach across φ = 0? Then those have an eastern range, too.
    across: bool,
}

/// Takes the arcs of a disc, from the north.
pub(in super::super) trait Arcs {
    /// Are they wanted as arcs, or as ranges of pixels?
    const AS_ARCS: bool;

    /// The pixels `start` … `end` − 1; none if `start` = `end`.
    fn range(&mut self, start: u64, end: u64);
    /// An arc, not empty.
    fn arc(&mut self, arc: Arc);
}

/// What the rings of a zone have in common.
#[derive(Clone, Copy)]
struct Zone<L: Lanes> {
    grid: Grid<L>,
    /// In a cap, 1 in the north, −1 in the south.
    sign: L,
    /// In a cap, the place of its pole: ring 0 or 4 Nside, pixel 0 or 12 Nside².
    pole_ring: L,
    pole_pixel: L,
    /// ½ on shifted rings.
    shift: L,
    /// Of the disc.
    turns: L,
    z: L,
    sin_theta: L,
    four_sin_theta: L,
    chord2: L,
}

/// Arcs as places on their rings, from the first pixel; `east` is the last one.
struct Places<L: Lanes> {
    /// Is there any pixel? `west` and `east` say more.
    some: L::Mask,
    /// The ring is cut; otherwise all of it is in the disc.
    cut: L::Mask,
    at: L,
    quarter: L,
    first: L,
    west: L,
    east: L,
}

impl<L: Lanes> Zone<L> {
    #[inline(always)]
    fn places<const CAP: bool>(&self, ring: L) -> Places<L> {
        let Self { grid, .. } = self;
        let (quarter, z, square, first);
        if CAP {
            quarter = (ring - self.pole_ring) * self.sign;
            let half_sine = quarter * grid.sine_step;
            let t = grid.two * half_sine * half_sine;
            z = (grid.one - t) * self.sign;
            square = t * (grid.two - t);
            let pair = quarter + quarter;
            first = (pair * quarter).mul_add(self.sign, self.pole_pixel) - pair;
        } else {
            quarter = grid.n;
            z = (grid.n + grid.n - ring) * grid.z_step;
            square = (grid.one - z) * (grid.one + z);
            first = (ring - grid.n).mul_add(grid.turn, grid.cap);
        }
        let s = square.sqrt();
        // sin²(Δφ/2) = room / (4 s s₀); above 1 the whole ring is inside. NaN, where the rim touches the pole, too.
        let (dz, ds) = (z - self.z, s - self.sin_theta);
        let room = ds.neg_mul_add(ds, dz.neg_mul_add(dz, self.chord2));
        let sine2 = room / (s * self.four_sin_theta);
        let wide = grid.half.lt(sine2);
        let lesser = L::select(wide, grid.one - sine2, sine2);
        // Δφ in pixels is twice the arcsine's quarter turns.
        let eighth = arcsine(grid.token, lesser.sqrt());
        let pixels = quarter * grid.c(2.0 * FRAC_2_PI);
        let half_width = L::select(
            wide,
            eighth.neg_mul_add(pixels, quarter + quarter),
            eighth * pixels,
        );
        let at = self.turns.mul_sub(quarter, self.shift);
        Places {
            some: grid.zero.le(room),
            cut: sine2.lt(grid.one),
            at,
            quarter,
            first,
            west: -(half_width - at).floor(),
            east: (at + half_width).floor(),
        }
    }

    /// The arcs of eight rings as ranges.
    #[inline(always)]
    fn ranges<const CAP: bool>(&self, ring: u64, out: &mut Ranges) {
        let grid = &self.grid;
        let token = grid.token;
        let Places {
            some,
            cut,
            quarter,
            first,
            west,
            east,
            ..
        } = self.places::<CAP>(self.eight(ring));
        let len = grid.c(4.0) * quarter;
        let whole = !(cut & (east - west + grid.one).lt(len));
        let (before, beyond) = (west.lt(grid.zero), len.le(east));
        let end = L::select(beyond, east - len, east) + grid.one;
        let end = first + L::select(whole, len, end);
        let start = L::select(whole | before | beyond, first, first + west);
        grid.where_set(some, start)
            .to_whole(token)
            .store(&mut out.start);
        grid.where_set(some, end)
            .to_whole(token)
            .store(&mut out.end);
        let across = (before | beyond) & !whole & some;
        out.across = across.any();
        if out.across {
            let end = first + len;
            let start = L::select(before, end + west, first + west);
            grid.where_set(across, start)
                .to_whole(token)
                .store(&mut out.eastern_start);
            grid.where_set(across, end)
                .to_whole(token)
                .store(&mut out.eastern_end);
        }
    }

    #[inline(always)]
    fn eight(&self, ring: u64) -> L {
        let steps = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
        self.grid.c(ring as f64) + L::load(self.grid.token, &steps)
    }

    /// Hands on the arcs of up to eight rings, one by one.
    #[inline(always)]
    fn arcs<S: Arcs, const CAP: bool>(&self, ring: u64, live: u64, to: &mut S) {
        let grid = &self.grid;
        let token = grid.token;
        let Places {
            some,
            cut,
            at,
            quarter,
            first,
            west,
            east,
        } = self.places::<CAP>(self.eight(ring));
        let pair = quarter + quarter;
        let len = pair + pair;
        let count = L::select(cut, (east - west + grid.one).min(len), len);
        // Whole rings begin beyond the centre's antipode: arcs that are trimmed are trimmed at their ends.
        let west = L::select(cut, west, (at - pair).floor() + grid.one);
        let west = L::select(west.lt(grid.zero), west + len, west);
        let west = L::select(len.le(west), west - len, west);
        let (mut firsts, mut lens, mut wests, mut counts) = ([0; 8], [0; 8], [0; 8], [0; 8]);
        first.to_whole(token).store(&mut firsts);
        len.to_whole(token).store(&mut lens);
        west.to_whole(token).store(&mut wests);
        grid.where_set(some, count.max(grid.zero))
            .to_whole(token)
            .store(&mut counts);
        for (ring, lane) in (ring..ring + live).zip(0..8) {
            if counts[lane] > 0 {
                to.arc(Arc {
                    ring,
                    first: firsts[lane],
                    len: lens[lane],
                    west: wests[lane],
                    count: counts[lane],
                });
            }
        }
    }

    #[inline(always)]
    fn run<S: Arcs, const CAP: bool>(&self, from: u64, to: u64, arcs: &mut S) {
        if S::AS_ARCS {
            let mut ring = from;
            while ring <= to {
                let live = (to - ring + 1).min(8);
                self.arcs::<S, CAP>(ring, live, arcs);
                ring += live;
            }
            return;
        }
        let mut block = [Ranges::default(); BLOCK];
        let mut ring = from;
        while ring <= to {
            let vectors = (to - ring + 1).div_ceil(8).min(BLOCK as u64) as usize;
            for (at, ranges) in (ring..).step_by(8).zip(&mut block).take(vectors) {
                self.ranges::<CAP>(at, ranges);
            }
            for ranges in block.iter().take(vectors) {
                let live = (to - ring + 1).min(8) as usize;
                for lane in 0..live & 15 {
                    arcs.range(ranges.start[lane & 7], ranges.end[lane & 7]);
                    if ranges.across {
                        arcs.range(ranges.eastern_start[lane & 7], ranges.eastern_end[lane & 7]);
                    }
                }
                ring += live as u64;
            }
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
    };
    zone.run::<S, true>(north, south.min(n - 1), to);
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
    belt.run::<S, false>(first, south.min(3 * n), to);
    let cap = Zone {
        sign: -grid.one,
        pole_ring: grid.turn,
        pole_pixel: grid.npix,
        ..zone
    };
    cap.run::<S, true>(north.max(3 * n + 1), south, to);
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
