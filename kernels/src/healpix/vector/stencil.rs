//! Interpolation stencils.
//!
//! ```text
//! θ → rings above and below, their θ → weight of the southern ring
//! φ → on either ring: place west of it, weight of the place east of it
//! ```
//!
//! Directions north of the first ring and south of the last go one by one.

use super::super::Nside;
use super::super::interp::{Stencil, stencil_of_angles};
use super::grid::{Grid, HALF_PI_LOW};
use super::points::{BELT_EDGE, all_angles};
use super::slices::{Reads, Writes, count};
use crate::dispatch;
use crate::simd::atan::sine;
use crate::simd::{Bits, Lanes, Level, Mask};
use core::f64::consts::{FRAC_2_PI, PI};

/// Where a longitude lies on a ring.
#[derive(Clone, Copy)]
struct Beside<L: Lanes> {
    cap: L::Mask,
    south: L::Mask,
    quarter: L,
    height: L,
    first: L,
    /// Places on the ring.
    west: L,
    east: L,
    /// Weight of the eastern pixel.
    weight: L,
}

impl<L: Lanes> Grid<L> {
    /// The pixels beside a longitude of `turns` quarter turns on the ring at 2 Nside − ring = `height`, and the ring's θ.
    #[inline(always)]
    fn on_ring(&self, height: L, turns: L) -> (Beside<L>, L) {
        let south = height.lt(self.zero);
        let (cap, quarter) = self.ring_at(height);
        let theta = self.theta_of_ring(cap, south, height, quarter);
        // Shifted by half a pixel: the caps, and every other ring of the belt from its edge.
        let from_edge = self.n - height;
        let odd = !(from_edge * self.half).floor().eq(from_edge * self.half) & !cap;
        let shift = L::select(odd, self.zero, self.half);
        let pair = quarter + quarter;
        let first = self.first_pixel(cap, south, height, quarter);
        let last = pair + pair - self.one;
        let at = turns * quarter - shift;
        let floor = at.floor();
        let west = L::select(floor.lt(self.zero), last, floor.min(last));
        let east = L::select(west.eq(last), self.zero, west + self.one);
        (
            Beside {
                cap,
                south,
                quarter,
                height,
                first,
                west,
                east,
                weight: at - floor,
            },
            theta,
        )
    }

    /// The number of a place on such a ring.
    #[inline(always)]
    fn number_on(&self, ring: Beside<L>, index: L, nested: bool) -> L::Bits {
        if !nested {
            return (ring.first + index).to_whole(self.token);
        }
        let from_end = self.c(4.0) * ring.quarter - self.one - index;
        let index = L::select(ring.south, from_end, index);
        let from_pole = self.n + self.n - ring.height.abs();
        let face = self.face_on_ring(ring.cap, ring.south, from_pole, index);
        self.nested_of_face(face)
    }
}

#[inline(always)]
fn body<L: Lanes>(
    token: L::Token,
    nside: Nside,
    theta: &[f64],
    phi: &[f64],
    pixels: [&mut [u64]; 4],
    weights: [&mut [f64]; 4],
    nested: bool,
) -> bool {
    let n = count(theta.len());
    let (angles, longitudes) = (Reads::new(theta), Reads::new(phi));
    if !all_angles::<L>(token, &angles, &longitudes, n) {
        return false;
    }
    let grid = Grid::<L>::new(token, nside);
    let mut pixels = pixels.map(Writes::new);
    let mut weights = weights.map(Writes::new);
    let lowest = grid.c(-2.0) * grid.n + grid.one;
    for k in 0..n {
        let theta = L::load(token, angles.get(k));
        let theta = theta.min(grid.c(PI));
        let turns = L::load(token, longitudes.get(k)) * grid.c(FRAC_2_PI);
        let turns = turns - grid.c(4.0) * (turns * grid.c(0.25)).floor();
        let turns = L::select(turns.lt(grid.c(4.0)), turns, grid.zero);
        // The ring above, as 2 Nside − ring.
        let up = (grid.c(0.5 * PI) - theta) + grid.c(HALF_PI_LOW);
        let south = up.lt(grid.zero);
        let cap = grid.c(0.5 * PI - BELT_EDGE).lt(up.abs());
        let from_south = (grid.c(PI) - theta) + grid.c(2.0 * HALF_PI_LOW);
        let from_pole = L::select(south, from_south, theta);
        let sine = sine(token, L::select(cap, from_pole * grid.half, up));
        let rings = (sine * grid.cap_scale).floor().min(grid.n);
        let belt = grid.n + grid.n - (grid.n * (grid.two - grid.c(1.5) * sine)).floor();
        let both = grid.n + grid.n;
        let above = L::select(
            cap,
            L::select(south, rings + grid.one - both, both - rings),
            belt,
        );
        let pole = above.eq(both) | above.eq(lowest);
        let (north, north_theta) = grid.on_ring(above, turns);
        let (south, south_theta) = grid.on_ring(above - grid.one, turns);
        let lower = (theta - north_theta) / (south_theta - north_theta);
        let lower = lower.max(grid.zero).min(grid.one);
        let upper = grid.one - lower;
        grid.number_on(north, north.west, nested)
            .store(pixels[0].get(k));
        grid.number_on(north, north.east, nested)
            .store(pixels[1].get(k));
        grid.number_on(south, south.west, nested)
            .store(pixels[2].get(k));
        grid.number_on(south, south.east, nested)
            .store(pixels[3].get(k));
        ((grid.one - north.weight) * upper).store(weights[0].get(k));
        (north.weight * upper).store(weights[1].get(k));
        ((grid.one - south.weight) * lower).store(weights[2].get(k));
        (south.weight * lower).store(weights[3].get(k));
        if pole.any() {
            let (theta, phi) = (angles.get(k), longitudes.get(k));
            for (lane, (&theta, &phi)) in theta.iter().zip(phi).enumerate() {
                if (pole.bits() >> lane) & 1 == 1 {
                    let stencil = stencil_of_angles(nside, nested, theta, phi);
                    write_lane(&mut pixels, &mut weights, k, lane, stencil);
                }
            }
        }
    }
    for plane in pixels {
        plane.finish();
    }
    for plane in weights {
        plane.finish();
    }
    true
}

fn write_lane(
    pixels: &mut [Writes<'_, u64>; 4],
    weights: &mut [Writes<'_, f64>; 4],
    k: usize,
    lane: usize,
    stencil: Stencil,
) {
    for (plane, pixel) in pixels.iter_mut().zip(stencil.pixels) {
        if let Some(to) = plane.get(k).get_mut(lane) {
            *to = pixel;
        }
    }
    for (plane, weight) in weights.iter_mut().zip(stencil.weights) {
        if let Some(to) = plane.get(k).get_mut(lane) {
            *to = weight;
        }
    }
}

/// Stencils of directions, in either order; false, and nothing written, if an angle is bad. All slices are equally long.
pub(in super::super) fn stencils(
    level: Level,
    nside: Nside,
    theta: &[f64],
    phi: &[f64],
    pixels: [&mut [u64]; 4],
    weights: [&mut [f64]; 4],
    nested: bool,
) -> bool {
    dispatch!(level, |token: L| body::<L>(
        token, nside, theta, phi, pixels, weights, nested
    ))
}
