//! The pixels of a quadtree near a point, 64 at a time.
//!
//! ```text
//! for each face that is near, or for the few pixels of a level that hold a small disc: open it
//! open a pixel: squared chords to the 4^k pixels k = 1 … 3 levels down → bits, in NESTED order
//!     inside bits, the runs of them:  handed on as ranges
//!     other near bits:                opened; at the last level, handed on as pixels of the rim
//! ```
//!
//! * Three levels at once, so that of a disc's rim a fraction 1/8 + 1/64 + … is visited besides the last level.
//! * The pixels below a pixel lie on 2^(k+1) − 1 circles: latitude, a root and a quotient are computed for these; row y of
//!   the pixels takes eight successive ones from memory.
//! * Longitudes are differences from the point's, in turns: d t + u with t from the circle, whole d = x − y, and u of the
//!   face; sin² πv = 4 h (1 − h) with h = sin² πv/2, which needs a sine below π/4 only and keeps its digits at v → 0.

use super::super::Location;
use super::super::disc::Window;
use super::super::faces::FacePixel;
use super::grid::SQRT_6;
use crate::bits::{gather_bits, spread_bits};
use crate::dispatch;
use crate::simd::atan::sine;
use crate::simd::{Lanes, Level, Mask};
use core::f64::consts::FRAC_PI_2;

/// Levels of the tree, 2⁰ … 2²⁹.
pub(in super::super) const LEVELS: usize = 30;

/// Where to look, and how far.
pub(in super::super) struct Near {
    pub(in super::super) centre: Location,
    /// φ of the centre in turns, 0 … 1.
    pub(in super::super) turns: f64,
    /// The last level.
    pub(in super::super) order: u32,
    /// Where all is on one face, where there, and on which level to begin; else with the faces.
    pub(in super::super) start: Option<(Window, u32)>,
    /// By level: pixels whose centre's squared chord is at most this may hold something near …
    pub(in super::super) outer: [f64; LEVELS],
    /// … and those below this are near altogether.
    pub(in super::super) inner: [f64; LEVELS],
}

/// Takes pixels of the last level, in ascending order.
pub(in super::super) trait Quads {
    /// All inside.
    fn range(&mut self, start: u64, end: u64);
    /// Near, but not inside.
    fn rim(&mut self, pixel: u64);
}

/// Bits i = 0 … 7 of a row of pixels to their places in a tile of 8 × 8.
const SPREAD: [u32; 256] = {
    let mut table = [0; 256];
    let mut bits = 0_usize;
    while bits < 256 {
        let mut i = 0;
        while i < 8 {
            if (bits >> i) & 1 == 1 {
                table[bits] |= 1 << spread_bits(i);
            }
            i += 1;
        }
        bits += 1;
    }
    table
};

/// 2 F₂ / 16: longitudes of the faces' centres in turns.
const FACE_TURNS: [f64; 12] = [
    0.125, 0.375, 0.625, 0.875, 0.0, 0.25, 0.5, 0.75, 0.125, 0.375, 0.625, 0.875,
];

const NOWHERE: FacePixel = FacePixel {
    face: 0,
    x: 0,
    y: 0,
};

/// A pixel of the tree.
#[derive(Clone, Copy, Default)]
struct Pixel {
    level: u32,
    face: u32,
    x: u64,
    y: u64,
    /// Its NESTED number.
    number: u64,
}

/// What was found below a pixel.
#[derive(Clone, Copy, Default)]
struct Found {
    /// The pixel with number 0 among those found.
    first: Pixel,
    near: u64,
    inside: u64,
}

/// Geometry of a circle of pixels, by x + y.
struct Circles {
    /// (z − z₀)² + (s − s₀)².
    apart: [f64; 16],
    /// 16 s s₀.
    scale: [f64; 16],
    /// Half a pixel of longitude, in turns.
    step: [f64; 16],
}

const ZERO_TO_SEVEN: [f64; 8] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

impl Near {
    /// Squared chord at a difference of longitude in turns.
    #[inline(always)]
    fn chord2<L: Lanes>(token: L::Token, apart: L, scale: L, turns: L) -> L {
        let turns = turns - turns.round();
        let sine = sine(token, turns * L::splat(token, FRAC_PI_2));
        let h = sine * sine;
        (scale * h).mul_add(L::splat(token, 1.0) - h, apart)
    }

    /// Circles `from` … `from` + 7 of a tile whose first circle is 2 Nside − ring = `height`.
    #[inline(always)]
    fn eight_circles<L: Lanes>(&self, token: L::Token, n: f64, height: f64) -> (L, L, L) {
        let c = L::splat;
        let (one, two) = (c(token, 1.0), c(token, 2.0));
        let height = c(token, height) + L::load(token, &ZERO_TO_SEVEN);
        let distance = height.abs();
        let full = c(token, n);
        let cap = full.lt(distance);
        let quarter = full.min(full + full - distance);
        let half_sine = quarter * c(token, 1.0 / (SQRT_6 * n));
        let t = two * half_sine * half_sine;
        let top = one - t;
        let south = height.lt(c(token, 0.0));
        let belt = height * c(token, 2.0 / (3.0 * n));
        let z = L::select(cap, L::select(south, -top, top), belt);
        let s = L::select(cap, t * (two - t), (one - belt) * (one + belt)).sqrt();
        let (dz, ds) = (
            z - c(token, self.centre.z),
            s - c(token, self.centre.sin_theta),
        );
        (
            dz.mul_add(dz, ds * ds),
            s * c(token, 16.0 * self.centre.sin_theta),
            c(token, 0.125) / quarter,
        )
    }

    /// How many levels the first step goes down: so many that the others go down three.
    #[inline(always)]
    const fn first_step(&self) -> u32 {
        match (self.start, self.order) {
            (Some(_), _) => 3,
            (None, 0) => 0,
            (None, order) => (order - 1) % 3 + 1,
        }
    }

    /// Sets the bounds of a level.
    #[inline(always)]
    pub(in super::super) fn set(&mut self, level: u32, (outer, inner): (f64, f64)) {
        let level = level as usize;
        if let (Some(o), Some(i)) = (self.outer.get_mut(level), self.inner.get_mut(level)) {
            (*o, *i) = (outer, inner);
        }
    }

    /// The levels visited.
    pub(in super::super) fn levels(&self) -> impl Iterator<Item = u32> + use<> {
        let first = match self.start {
            Some((_, level)) => level,
            None => 0,
        };
        let next = first + self.first_step();
        core::iter::once(first).chain((next..self.order + 1).step_by(3))
    }

    /// Which of the pixels `k` levels below `at` are near; below those first opened, only the window's rows are searched.
    #[inline(always)]
    fn open<L: Lanes>(&self, token: L::Token, at: Pixel, k: u32, root: bool) -> Found {
        let first = Pixel {
            level: at.level + k,
            face: at.face,
            x: at.x << k,
            y: at.y << k,
            number: at.number << (2 * k),
        };
        let n = (1_u64 << first.level) as f64;
        let (x, y) = (first.x as f64, first.y as f64);
        let row = f64::from(at.face / 4);
        let height = (x + y + 1.0) - row * n;
        let mut circles = Circles {
            apart: [0.0; 16],
            scale: [0.0; 16],
            step: [0.0; 16],
        };
        let halves = if k < 3 { 1 } else { 2 };
        for half in 0..halves {
            let (apart, scale, step) =
                self.eight_circles::<L>(token, n, height + 8.0 * f64::from(half));
            let half = half as usize;
            apart.store(&mut circles.apart.as_chunks_mut::<8>().0[half]);
            scale.store(&mut circles.scale.as_chunks_mut::<8>().0[half]);
            step.store(&mut circles.step.as_chunks_mut::<8>().0[half]);
        }
        let level = first.level as usize;
        let outer = L::splat(token, self.outer.get(level).copied().unwrap_or(0.0));
        let inner = L::splat(token, self.inner.get(level).copied().unwrap_or(0.0));
        let face_turns = FACE_TURNS.get(at.face as usize).copied().unwrap_or(0.0);
        let offset = L::splat(token, face_turns - self.turns);
        let (mut from, mut to) = (0, 1 << k);
        if root && let Some((window, _)) = self.start {
            let [south, north] = window.rows(first.level);
            from = south.saturating_sub(first.y).min(8);
            to = (north + 1).saturating_sub(first.y).min(to);
        }
        let mut across = L::splat(token, x - (y + from as f64)) + L::load(token, &ZERO_TO_SEVEN);
        let one = L::splat(token, 1.0);
        let (mut near, mut inside) = (0, 0);
        let row_bits = [1, 3, 15, 255][k as usize & 3];
        for dy in from as usize..to as usize {
            let (Some(apart), Some(scale), Some(step)) = (
                part(&circles.apart, dy),
                part(&circles.scale, dy),
                part(&circles.step, dy),
            ) else {
                break;
            };
            let turns = across.mul_add(L::load(token, step), offset);
            let chord2 = Self::chord2(token, L::load(token, apart), L::load(token, scale), turns);
            let place = 2 * spread_bits(dy as u64);
            near |= spread(chord2.le(outer).bits() & row_bits, place);
            inside |= spread(chord2.lt(inner).bits() & row_bits, place);
            across -= one;
        }
        Found {
            first,
            near,
            inside: inside & near,
        }
    }

    /// Near and inside bits of the twelve faces.
    #[inline(always)]
    fn faces<L: Lanes>(&self, token: L::Token) -> (u32, u32) {
        let (mut near, mut inside) = (0, 0);
        for row in 0..3_u32 {
            let height = 1.0 - f64::from(row);
            let z = height * (2.0 / 3.0);
            let s = L::splat(token, (1.0 - z) * (1.0 + z)).sqrt();
            let (dz, ds) = (
                L::splat(token, z - self.centre.z),
                s - L::splat(token, self.centre.sin_theta),
            );
            let apart = dz.mul_add(dz, ds * ds);
            let scale = s * L::splat(token, 16.0 * self.centre.sin_theta);
            let first = FACE_TURNS.get(4 * row as usize).copied().unwrap_or(0.0);
            let turns = L::load(token, &ZERO_TO_SEVEN)
                .mul_add(L::splat(token, 0.25), L::splat(token, first - self.turns));
            let chord2 = Self::chord2(token, apart, scale, turns);
            let outer = chord2.le(L::splat(token, self.outer[0]));
            let inner = chord2.lt(L::splat(token, self.inner[0]));
            near |= u32::from(outer.bits() & 15) << (4 * row);
            inside |= u32::from(inner.bits() & 15) << (4 * row);
        }
        (near, inside & near)
    }

    #[inline(always)]
    fn walk<L: Lanes, Q: Quads>(&self, token: L::Token, to: &mut Q) {
        let (near, inside, tiles) = match self.start {
            Some((window, level)) => (15, 0, window.corners(level)),
            None => {
                let (near, inside) = self.faces::<L>(token);
                (near, inside, [NOWHERE; 4])
            }
        };
        let first_step = self.first_step();
        let mut stack = [Found::default(); LEVELS / 3 + 1];
        let mut last = u64::MAX;
        for i in 0..12_u32 {
            if (near >> i) & 1 == 0 {
                continue;
            }
            let at = match (self.start, tiles.get(i as usize)) {
                (Some((_, level)), Some(&tile)) => Pixel {
                    level,
                    face: tile.face as u32,
                    x: tile.x,
                    y: tile.y,
                    number: tile.to_nested(level),
                },
                _ => Pixel {
                    face: i,
                    number: u64::from(i),
                    ..Pixel::default()
                },
            };
            if at.number == last {
                continue;
            }
            last = at.number;
            if (inside >> i) & 1 == 1 {
                let below = 2 * self.order;
                to.range(at.number << below, (at.number + 1) << below);
                continue;
            }
            if self.order == 0 {
                to.rim(at.number);
                continue;
            }
            let mut depth = 0;
            stack[0] = self.open::<L>(token, at, first_step, true);
            while let Some(found) = stack.get_mut(depth) {
                if found.near == 0 {
                    if depth == 0 {
                        break;
                    }
                    depth -= 1;
                    continue;
                }
                let first = found.first;
                let i = found.near.trailing_zeros();
                let run = (found.inside >> i).trailing_ones();
                let below = 2 * (self.order - first.level);
                if run > 0 {
                    let start = first.number + u64::from(i);
                    to.range(start << below, (start + u64::from(run)) << below);
                    let end = i + run;
                    found.near = if end < 64 {
                        (found.near >> end) << end
                    } else {
                        0
                    };
                    continue;
                }
                found.near &= found.near - 1;
                let i = u64::from(i);
                if first.level == self.order {
                    to.rim(first.number + i);
                    continue;
                }
                let child = Pixel {
                    level: first.level,
                    face: at.face,
                    x: first.x + gather_bits(i),
                    y: first.y + gather_bits(i >> 1),
                    number: first.number + i,
                };
                depth += 1;
                if let Some(next) = stack.get_mut(depth) {
                    *next = self.open::<L>(token, child, 3, false);
                }
            }
        }
    }
}

/// A row's bits to their places in a tile.
#[inline(always)]
fn spread(bits: u8, place: u64) -> u64 {
    u64::from(SPREAD[usize::from(bits)]) << (place & 63)
}

/// Eight entries from `k` on.
#[inline(always)]
fn part(table: &[f64; 16], k: usize) -> Option<&[f64; 8]> {
    match table.get(k..) {
        Some(rest) => rest.first_chunk(),
        None => None,
    }
}

/// Walks down the tree and hands on what is near.
pub(in super::super) fn quads<Q: Quads>(level: Level, near: &Near, to: &mut Q) {
    dispatch!(level, |token: L| near.walk::<L, Q>(token, to));
}
