//! The arcs of a disc on eight rings of a cap or of the belt, to the last bits.
//!
//! ```text
//! z, s of the rings → sin²(Δφ/2) = (4 sin²(r/2) − (z − z₀)² − (s − s₀)²) / (4 s s₀) → Δφ in pixels of the ring
//! → the arc's first and last pixel
//! ```
//!
//! Nothing cancels: beyond a quarter turn, Δφ comes from its complement.

use super::estimate::Limits;
use super::grid::Grid;
use super::rim::{Arc, Arcs, Kind, Ranges};
use crate::simd::atan::arcsine;
use crate::simd::{Bits, Lanes, Mask};
use core::f64::consts::FRAC_2_PI;

/// What the rings of a zone have in common.
#[derive(Clone, Copy)]
pub(super) struct Zone<L: Lanes> {
    pub(super) grid: Grid<L>,
    /// In a cap, 1 in the north, −1 in the south.
    pub(super) sign: L,
    /// In a cap, the place of its pole: ring 0 or 4 Nside, pixel 0 or 12 Nside².
    pub(super) pole_ring: L,
    pub(super) pole_pixel: L,
    /// ½ on shifted rings.
    pub(super) shift: L,
    /// Of the disc.
    pub(super) turns: L,
    pub(super) z: L,
    pub(super) sin_theta: L,
    pub(super) four_sin_theta: L,
    pub(super) chord2: L,
    pub(super) limits: Limits<L>,
}

/// Eight rings.
#[derive(Clone, Copy)]
pub(super) struct Rings<L: Lanes> {
    /// A quarter of the length.
    pub(super) quarter: L,
    /// cos θ, and sin² θ.
    pub(super) z: L,
    pub(super) square: L,
    /// The first pixel.
    pub(super) first: L,
    /// The disc's centre in pixels from the first one's centre.
    pub(super) at: L,
}

/// Arcs as places on their rings, from the first pixel; `east` is the last one.
#[derive(Clone, Copy)]
pub(super) struct Places<L: Lanes> {
    /// Is there any pixel? `west` and `east` say more.
    pub(super) some: L::Mask,
    /// The ring is cut; otherwise all of it is in the disc.
    pub(super) cut: L::Mask,
    pub(super) west: L,
    pub(super) east: L,
}

impl<L: Lanes> Zone<L> {
    /// Eight rings from `ring` on.
    #[inline(always)]
    pub(super) fn eight<const CAP: bool>(&self, ring: u64) -> Rings<L> {
        let Self { grid, .. } = self;
        let steps = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
        let ring = grid.c(ring as f64) + L::load(grid.token, &steps);
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
        Rings {
            quarter,
            z,
            square,
            first,
            at: self.turns.mul_sub(quarter, self.shift),
        }
    }

    /// 4 s s₀ sin²(Δφ/2), from cos θ and s = sin θ of the rings.
    #[inline(always)]
    pub(super) fn room(&self, z: L, s: L) -> L {
        let (dz, ds) = (z - self.z, s - self.sin_theta);
        ds.neg_mul_add(ds, dz.neg_mul_add(dz, self.chord2))
    }

    /// Δφ in pixels, from Δφ/2 or (`wide`) its complement.
    #[inline(always)]
    pub(super) fn half_width(&self, quarter: L, half_angle: L, wide: L::Mask) -> L {
        let pixels = quarter * self.grid.c(2.0 * FRAC_2_PI);
        L::select(
            wide,
            half_angle.neg_mul_add(pixels, quarter + quarter),
            half_angle * pixels,
        )
    }

    #[inline(always)]
    fn places(&self, rings: Rings<L>) -> Places<L> {
        let Self { grid, .. } = self;
        let Rings {
            quarter,
            z,
            square,
            at,
            ..
        } = rings;
        let s = square.sqrt();
        // sin²(Δφ/2) = room / (4 s s₀); above 1 the whole ring is inside. NaN, where the rim touches the pole, too.
        let room = self.room(z, s);
        let sine2 = room / (s * self.four_sin_theta);
        let wide = grid.half.lt(sine2);
        let lesser = L::select(wide, grid.one - sine2, sine2);
        // Δφ in pixels is twice the arcsine's quarter turns.
        let eighth = arcsine(grid.token, lesser.sqrt());
        let half_width = self.half_width(quarter, eighth, wide);
        Places {
            some: grid.zero.le(room),
            cut: sine2.lt(grid.one),
            west: -(half_width - at).floor(),
            east: (at + half_width).floor(),
        }
    }

    /// The arcs of eight rings as ranges.
    #[inline(always)]
    pub(super) fn ranges<const CAP: bool>(&self, ring: u64, out: &mut Ranges) {
        let rings = self.eight::<CAP>(ring);
        let estimate = self.estimate(rings);
        if let Some((start, end)) = self.apart(rings, estimate) {
            start.store(&mut out.start);
            end.store(&mut out.end);
            out.kind = Kind::Apart;
        } else if let Some((start, end)) = self.around(rings, estimate) {
            start.store(&mut out.start);
            end.store(&mut out.end);
            out.kind = Kind::Around;
        } else if self.is_whole(estimate) {
            out.kind = Kind::Whole;
        } else if let Some(places) = self.estimated_places(estimate) {
            self.cut_at_meridian(rings, places, out);
        } else {
            self.cut_at_meridian(rings, self.places(rings), out);
        }
    }

    /// Arcs as ranges, in two parts where they reach across φ = 0.
    #[inline(always)]
    fn cut_at_meridian(&self, rings: Rings<L>, places: Places<L>, out: &mut Ranges) {
        let grid = &self.grid;
        let token = grid.token;
        let Rings { quarter, first, .. } = rings;
        let Places {
            some,
            cut,
            west,
            east,
        } = places;
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
        out.kind = if across.any() {
            let end = first + len;
            let start = L::select(before, end + west, first + west);
            grid.where_set(across, start)
                .to_whole(token)
                .store(&mut out.eastern_start);
            grid.where_set(across, end)
                .to_whole(token)
                .store(&mut out.eastern_end);
            Kind::Across
        } else {
            Kind::Plain
        };
    }

    /// Hands on the arcs of up to eight rings, one by one.
    #[inline(always)]
    pub(super) fn arcs<S: Arcs, const CAP: bool>(&self, ring: u64, live: u64, to: &mut S) {
        let grid = &self.grid;
        let token = grid.token;
        let rings = self.eight::<CAP>(ring);
        let Places {
            some,
            cut,
            west,
            east,
        } = self.places(rings);
        let pair = rings.quarter + rings.quarter;
        let len = pair + pair;
        let count = L::select(cut, (east - west + grid.one).min(len), len);
        // Whole rings begin beyond the centre's antipode: arcs that are trimmed are trimmed at their ends.
        let west = L::select(cut, west, (rings.at - pair).floor() + grid.one);
        let west = L::select(west.lt(grid.zero), west + len, west);
        let west = L::select(len.le(west), west - len, west);
        let (mut firsts, mut lens, mut wests, mut counts) = ([0; 8], [0; 8], [0; 8], [0; 8]);
        rings.first.to_whole(token).store(&mut firsts);
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
}
