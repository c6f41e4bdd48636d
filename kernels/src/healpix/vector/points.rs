//! Pixel ↔ direction, RING ↔ NESTED.
//!
//! ```text
//! ang2pix:  sine of (π/2 − θ | θ′/2) → edges passed → RING number | face, x, y → NESTED number
//! pix2ang:  RING number | NESTED number → place on its ring → arcsine of (z | sin θ′/2) → θ; φ = twice · π/4 / quarter
//! ```
//!
//! Every body says whether all input was good; where it was not, it has written nothing.

use super::super::Nside;
use super::super::location::{SCALE_UP, THETA_MAX};
use super::grid::{Grid, HALF_PI_LOW};
use super::place::{Edges, Place};
use super::slices::{Reads, Writes, count};
use crate::dispatch;
use crate::simd::atan::{arcsine, cosine, quarter_turns, sine};
use crate::simd::{Bits, Lanes, Level, Mask};
use core::f64::consts::{FRAC_2_PI, FRAC_PI_4, PI};

/// θ of the edge of the belt, acos 2/3.
pub(super) const BELT_EDGE: f64 = 0.841_068_670_567_930_3;

/// Do all pixels exist?
#[inline(always)]
pub(super) fn all_exist<L: Lanes>(
    token: L::Token,
    npix: u64,
    pixels: &Reads<'_, u64>,
    n: usize,
) -> bool {
    // Word by word: a sign bit of (npix − 1 − p) | p betrays p ≥ npix, and p or the difference beyond 2^63.
    let last = L::Bits::splat(token, npix - 1);
    let mut bad = L::Bits::splat(token, 0);
    for k in 0..n {
        let p = L::Bits::load(token, pixels.get(k));
        bad = bad | (last - p) | p;
    }
    bad.to_array().iter().all(|b| b >> 63 == 0)
}

#[inline(always)]
pub(super) fn all_angles<L: Lanes>(
    token: L::Token,
    theta: &Reads<'_, f64>,
    phi: &Reads<'_, f64>,
    n: usize,
) -> bool {
    let (zero, most) = (L::splat(token, 0.0), L::splat(token, THETA_MAX));
    let finite = L::splat(token, f64::MAX);
    let mut good = zero.eq(zero);
    for k in 0..n {
        let (t, p) = (L::load(token, theta.get(k)), L::load(token, phi.get(k)));
        good = good & zero.le(t) & t.le(most) & p.abs().le(finite);
    }
    good.all()
}

impl<L: Lanes> Grid<L> {
    /// Edges passed at `turns` quarter turns, 0 ≤ `turns` ≤ 4, in the belt at z · ¾ Nside = `across`, in the caps at
    /// Nside √(3 (1 − |z|)) = `rings`.
    #[inline(always)]
    fn edges(&self, cap: L::Mask, south: L::Mask, turns: L, across: L, rings: L) -> Edges<L> {
        let turns = L::select(turns.lt(self.c(4.0)), turns, self.zero);
        let along = self.n * (turns + self.half);
        let quarter = turns.floor();
        let within = turns - quarter;
        let west = L::select(cap, within * rings, along - across).floor();
        let east = L::select(cap, (self.one - within) * rings, along + across).floor();
        // Rounding at |z| = ⅔ and at 0 must not lead to rings that do not exist: at most Nside edges of one kind more
        // than of the other in the belt, fewer than Nside of both together in the caps.
        let last = self.last;
        let west = west.max(self.zero).min(L::select(cap, last, east + self.n));
        let east = east
            .max(self.zero)
            .min(L::select(cap, last - west, west + self.n));
        Edges {
            cap,
            south,
            quarter,
            west,
            east,
        }
    }

    #[inline(always)]
    fn edges_of_angles(&self, theta: L, phi: L) -> Edges<L> {
        // Beyond π by rounding: reflected at the pole.
        let past = self.c(2.0 * PI) - theta;
        let theta = L::select(self.c(PI).lt(theta), past, theta);
        let up = (self.c(0.5 * PI) - theta) + self.c(HALF_PI_LOW);
        let south = up.lt(self.zero);
        let cap = self.c(0.5 * PI - BELT_EDGE).lt(up.abs());
        let from_pole = L::select(
            south,
            (self.c(PI) - theta) + self.c(2.0 * HALF_PI_LOW),
            theta,
        );
        let sine = sine(self.token, L::select(cap, from_pole * self.half, up));
        let turns = phi * self.c(FRAC_2_PI);
        let turns = turns - self.c(4.0) * (turns * self.c(0.25)).floor();
        let three_quarters = self.c(0.75) * self.n;
        self.edges(
            cap,
            south,
            turns,
            sine * three_quarters,
            sine * self.cap_scale,
        )
    }

    #[inline(always)]
    fn edges_of_vectors(&self, x: L, y: L, z: L) -> Edges<L> {
        // Squares may overflow or vanish: bring such vectors to a modest length first, exactly.
        let largest = x.abs().max(y.abs()).max(z.abs());
        let scale = L::select(
            largest.lt(self.c(1e-140)),
            self.c(SCALE_UP),
            L::select(self.c(1e140).lt(largest), self.c(1.0 / SCALE_UP), self.one),
        );
        let (x, y, z) = (x * scale, y * scale, z * scale);
        let flat = x * x + y * y;
        let length = (flat + z * z).sqrt();
        let up = z.abs();
        let cap = (length + length).lt(up + up + up);
        // z/|v| in the belt, 3 (1 − |z|/|v|) = 3 ρ²/(|v| (|v| + |z|)) in the caps.
        let three = self.c(3.0);
        let top = L::select(cap, three * flat, z);
        let bottom = L::select(cap, length * (length + up), length);
        let ratio = top / bottom;
        let turns = quarter_turns(self.token, x, y);
        let rings = if cap.any() {
            self.n * ratio.sqrt()
        } else {
            self.zero
        };
        self.edges(
            cap,
            z.lt(self.zero),
            turns,
            ratio * (self.c(0.75) * self.n),
            rings,
        )
    }

    #[inline(always)]
    fn number<const NESTED: bool>(&self, edges: Edges<L>) -> L::Bits {
        if NESTED {
            self.nested_of_face(self.face_of_edges(edges))
        } else {
            self.ring_of_edges(edges).to_whole(self.token)
        }
    }

    #[inline(always)]
    pub(super) fn place<const NESTED: bool>(&self, pixel: L::Bits) -> Place<L> {
        if NESTED {
            self.place_of_face(self.face_of_nested(pixel))
        } else {
            self.place_of_ring(L::from_whole(self.token, pixel))
        }
    }

    /// θ of rings, given by 2 Nside − ring and a quarter of the length.
    #[inline(always)]
    pub(super) fn theta_of_ring(&self, cap: L::Mask, south: L::Mask, height: L, quarter: L) -> L {
        let sine = L::select(cap, quarter * self.sine_step, height * self.z_step);
        self.colatitude(cap, south, arcsine(self.token, sine))
    }

    #[inline(always)]
    fn angles(&self, at: Place<L>) -> (L, L) {
        let theta = self.theta_of_ring(at.cap, at.south, at.height, at.quarter);
        let belt = at.twice * self.belt_step;
        let phi = if at.cap.any() {
            let cap = at.twice * self.c(FRAC_PI_4) / at.quarter;
            L::select(at.cap, cap, belt)
        } else {
            belt
        };
        (theta, phi)
    }

    #[inline(always)]
    fn vectors(&self, at: Place<L>) -> (L, L, L) {
        // The nearest axis, and the half pixels from there.
        let (inverse, step) = if at.cap.any() {
            let inverse = self.one / at.quarter;
            (
                L::select(at.cap, inverse, self.inverse_n),
                L::select(at.cap, self.c(FRAC_PI_4) * inverse, self.belt_step),
            )
        } else {
            (self.inverse_n, self.belt_step)
        };
        let axis = (at.twice * self.half * inverse).round();
        let rest = (axis + axis).neg_mul_add(at.quarter, at.twice);
        let angle = rest * step;
        let (sin, cos) = (sine(self.token, angle), cosine(self.token, angle));
        let odd = !(axis * self.half).floor().eq(axis * self.half);
        let (c, s) = (L::select(odd, sin, cos), L::select(odd, cos, sin));
        // cos < 0 on axes 1 and 2, sin on 2 and 3; axis 4 is axis 0.
        let (one, two, three) = (axis.eq(self.one), axis.eq(self.two), axis.eq(self.c(3.0)));
        let c = L::select(one | two, -c, c);
        let s = L::select(two | three, -s, s);
        // Caps: 1 − |z| = 2 sin²(θ′/2).
        let half_sine = at.quarter * self.sine_step;
        let t = self.two * half_sine * half_sine;
        let belt = at.height * self.z_step;
        let top = self.one - t;
        let z = L::select(at.cap, L::select(at.south, -top, top), belt);
        let square = L::select(
            at.cap,
            t * (self.two - t),
            (self.one - belt) * (self.one + belt),
        );
        let rho = square.sqrt();
        (rho * c, rho * s, z)
    }
}

#[inline(always)]
fn ang2pix_body<L: Lanes, const NESTED: bool>(
    token: L::Token,
    nside: Nside,
    theta: &[f64],
    phi: &[f64],
    pixels: &mut [u64],
) -> bool {
    let n = count(pixels.len());
    let (theta, phi) = (Reads::new(theta), Reads::new(phi));
    if !all_angles::<L>(token, &theta, &phi, n) {
        return false;
    }
    let grid = Grid::<L>::new(token, nside);
    let mut out = Writes::new(pixels);
    for k in 0..n {
        let (t, p) = (L::load(token, theta.get(k)), L::load(token, phi.get(k)));
        grid.number::<NESTED>(grid.edges_of_angles(t, p))
            .store(out.get(k));
    }
    out.finish();
    true
}

/// Pixels of angles; false, and nothing written, if an angle is bad. All slices are equally long.
pub(in super::super) fn ang2pix<const NESTED: bool>(
    level: Level,
    nside: Nside,
    theta: &[f64],
    phi: &[f64],
    pixels: &mut [u64],
) -> bool {
    dispatch!(level, |token: L| ang2pix_body::<L, NESTED>(
        token, nside, theta, phi, pixels
    ))
}

#[inline(always)]
fn vec2pix_body<L: Lanes, const NESTED: bool>(
    token: L::Token,
    nside: Nside,
    [x, y, z]: [&[f64]; 3],
    pixels: &mut [u64],
) -> bool {
    let n = count(pixels.len());
    let (x, y, z) = (Reads::new(x), Reads::new(y), Reads::new(z));
    let grid = Grid::<L>::new(token, nside);
    let finite = grid.c(f64::MAX);
    let mut good = grid.zero.eq(grid.zero);
    let last = pixels.len() % 8;
    for k in 0..n {
        let (a, b, c) = (
            L::load(token, x.get(k)).abs(),
            L::load(token, y.get(k)).abs(),
            L::load(token, z.get(k)).abs(),
        );
        // Comparisons that NaN fails, one by one: `max` would lose it.
        good = good & a.le(finite) & b.le(finite) & c.le(finite);
        let mut some = grid.zero.lt(a) | grid.zero.lt(b) | grid.zero.lt(c);
        if last != 0 && k + 1 == n {
            // The padding of the last vector is zero, and nobody's vector.
            some = some | L::load(token, &PADDING[last]).eq(grid.one);
        }
        good = good & some;
    }
    if !good.all() {
        return false;
    }
    let mut out = Writes::new(pixels);
    for k in 0..n {
        let edges = grid.edges_of_vectors(
            L::load(token, x.get(k)),
            L::load(token, y.get(k)),
            L::load(token, z.get(k)),
        );
        grid.number::<NESTED>(edges).store(out.get(k));
    }
    out.finish();
    true
}

/// Lane i of row n is 1.0 where i ≥ n.
const PADDING: [[f64; 8]; 8] = {
    let mut rows = [[0.0; 8]; 8];
    let mut n = 0;
    while n < 8 {
        let mut i = n;
        while i < 8 {
            rows[n][i] = 1.0;
            i += 1;
        }
        n += 1;
    }
    rows
};

/// Pixels of vectors; false, and nothing written, if one is zero or not finite. All slices are equally long.
pub(in super::super) fn vec2pix<const NESTED: bool>(
    level: Level,
    nside: Nside,
    xyz: [&[f64]; 3],
    pixels: &mut [u64],
) -> bool {
    dispatch!(level, |token: L| vec2pix_body::<L, NESTED>(
        token, nside, xyz, pixels
    ))
}

#[inline(always)]
fn pix2ang_body<L: Lanes, const NESTED: bool>(
    token: L::Token,
    nside: Nside,
    pixels: &[u64],
    theta: &mut [f64],
    phi: &mut [f64],
) -> bool {
    let n = count(pixels.len());
    let pixels = Reads::new(pixels);
    if !all_exist::<L>(token, nside.npix(), &pixels, n) {
        return false;
    }
    let grid = Grid::<L>::new(token, nside);
    let (mut theta, mut phi) = (Writes::new(theta), Writes::new(phi));
    for k in 0..n {
        let place = grid.place::<NESTED>(L::Bits::load(token, pixels.get(k)));
        let (t, p) = grid.angles(place);
        t.store(theta.get(k));
        p.store(phi.get(k));
    }
    theta.finish();
    phi.finish();
    true
}

/// Angles of pixels; false, and nothing written, if one does not exist. All slices are equally long.
pub(in super::super) fn pix2ang<const NESTED: bool>(
    level: Level,
    nside: Nside,
    pixels: &[u64],
    theta: &mut [f64],
    phi: &mut [f64],
) -> bool {
    dispatch!(level, |token: L| pix2ang_body::<L, NESTED>(
        token, nside, pixels, theta, phi
    ))
}

#[inline(always)]
fn pix2vec_body<L: Lanes, const NESTED: bool>(
    token: L::Token,
    nside: Nside,
    pixels: &[u64],
    [x, y, z]: [&mut [f64]; 3],
) -> bool {
    let n = count(pixels.len());
    let pixels = Reads::new(pixels);
    if !all_exist::<L>(token, nside.npix(), &pixels, n) {
        return false;
    }
    let grid = Grid::<L>::new(token, nside);
    let (mut x, mut y, mut z) = (Writes::new(x), Writes::new(y), Writes::new(z));
    for k in 0..n {
        let place = grid.place::<NESTED>(L::Bits::load(token, pixels.get(k)));
        let (a, b, c) = grid.vectors(place);
        a.store(x.get(k));
        b.store(y.get(k));
        c.store(z.get(k));
    }
    x.finish();
    y.finish();
    z.finish();
    true
}

/// Vectors of pixels; false, and nothing written, if one does not exist. All slices are equally long.
pub(in super::super) fn pix2vec<const NESTED: bool>(
    level: Level,
    nside: Nside,
    pixels: &[u64],
    xyz: [&mut [f64]; 3],
) -> bool {
    dispatch!(level, |token: L| pix2vec_body::<L, NESTED>(
        token, nside, pixels, xyz
    ))
}

#[inline(always)]
fn nest2ring_body<L: Lanes>(
    token: L::Token,
    nside: Nside,
    nested: &[u64],
    ring: &mut [u64],
) -> bool {
    let n = count(nested.len());
    let nested = Reads::new(nested);
    if !all_exist::<L>(token, nside.npix(), &nested, n) {
        return false;
    }
    let grid = Grid::<L>::new(token, nside);
    let mut ring = Writes::new(ring);
    for k in 0..n {
        let place = grid.place::<true>(L::Bits::load(token, nested.get(k)));
        grid.ring_of_place(place).to_whole(token).store(ring.get(k));
    }
    ring.finish();
    true
}

/// RING numbers of NESTED pixels; false, and nothing written, if one does not exist. Both slices are equally long.
pub(in super::super) fn nest2ring(
    level: Level,
    nside: Nside,
    nested: &[u64],
    ring: &mut [u64],
) -> bool {
    dispatch!(level, |token: L| nest2ring_body::<L>(
        token, nside, nested, ring
    ))
}
