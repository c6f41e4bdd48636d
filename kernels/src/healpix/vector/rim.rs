//! Where a circle on the sphere cuts the rings, eight rings at a time.

use super::super::{Location, Nside};
use super::grid::Grid;
use super::slices::count;
use crate::dispatch;
use crate::simd::atan::arcsine;
use crate::simd::{Bits, Lanes, Level};
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

/// Eight rings' arcs, structure of arrays.
#[derive(Default)]
struct Arcs {
    first: [u64; 8],
    len: [u64; 8],
    west: [u64; 8],
    count: [u64; 8],
}

impl<L: Lanes> Grid<L> {
    /// The arcs on the rings at 2 Nside − ring = `height`.
    #[inline(always)]
    fn arcs(&self, disc: &Disc, height: L, out: &mut Arcs) {
        let token = self.token;
        let south = height.lt(self.zero);
        let (cap, quarter) = self.ring_at(height);
        // Latitude.
        let half_sine = quarter * self.sine_step;
        let t = self.two * half_sine * half_sine;
        let belt = height * self.z_step;
        let top = self.one - t;
        let z = L::select(cap, L::select(south, -top, top), belt);
        let square = L::select(
            cap,
            t * (self.two - t),
            (self.one - belt) * (self.one + belt),
        );
        let s = square.sqrt();
        // sin²(Δφ/2) = room / (4 s s₀); above 1 the whole ring is inside. NaN, where the rim touches the pole, too.
        let (dz, ds) = (z - self.c(disc.centre.z), s - self.c(disc.centre.sin_theta));
        let room = self.c(disc.chord2) - dz * dz - ds * ds;
        let sine2 = room / (s * self.c(4.0 * disc.centre.sin_theta));
        let whole = !sine2.lt(self.one);
        let some = !room.lt(self.zero);
        let wide = self.half.lt(sine2);
        let lesser = L::select(wide, self.one - sine2, sine2).max(self.zero);
        let eighth = arcsine(token, lesser.sqrt()) * self.c(FRAC_2_PI);
        // Δφ in quarter turns, then pixels.
        let half_width = L::select(wide, self.one - eighth, eighth);
        let half_width = (half_width + half_width) * quarter;
        // The centre's place on the ring.
        let from_edge = self.n - height;
        let odd = !(from_edge * self.half).floor().eq(from_edge * self.half) & !cap;
        let at = self.c(disc.turns) * quarter - L::select(odd, self.zero, self.half);
        let pair = quarter + quarter;
        let len = pair + pair;
        let west = L::select(
            whole,
            (at - pair).floor() + self.one,
            -(half_width - at).floor(),
        );
        let east = (at + half_width).floor();
        let number = L::select(whole, len, (east - west + self.one).min(len));
        let number = self.where_set(some, number.max(self.zero));
        let west = west + self.where_set(west.lt(self.zero), len);
        let west = west - self.where_set(len.le(west), len);
        let first = self.first_pixel(cap, south, height, quarter);
        first.to_whole(token).store(&mut out.first);
        len.to_whole(token).store(&mut out.len);
        west.to_whole(token).store(&mut out.west);
        number.to_whole(token).store(&mut out.count);
    }
}

#[inline(always)]
fn body<L: Lanes, F: FnMut(Arc)>(
    token: L::Token,
    disc: &Disc,
    north: u64,
    south: u64,
    each: &mut F,
) {
    let grid = Grid::<L>::new(token, disc.nside);
    let steps = L::load(token, &[0.0, -1.0, -2.0, -3.0, -4.0, -5.0, -6.0, -7.0]);
    let mut arcs = Arcs::default();
    let rings = (south + 1).saturating_sub(north) as usize;
    let mut ring = north;
    for _ in 0..count(rings) {
        let height = grid.c(2.0 * disc.nside.as_f64() - ring as f64) + steps;
        grid.arcs(disc, height, &mut arcs);
        for lane in 0..8 {
            if ring > south {
                break;
            }
            if arcs.count[lane] > 0 {
                each(Arc {
                    ring,
                    first: arcs.first[lane],
                    len: arcs.len[lane],
                    west: arcs.west[lane],
                    count: arcs.count[lane],
                });
            }
            ring += 1;
        }
    }
}

/// The arcs of a disc on the rings `north` ..= `south`, from the north; empty ones are left out.
pub(in super::super) fn arcs<F: FnMut(Arc)>(
    level: Level,
    disc: &Disc,
    north: u64,
    south: u64,
    each: &mut F,
) {
    dispatch!(level, |token: L| body::<L, F>(
        token, disc, north, south, each
    ));
}
