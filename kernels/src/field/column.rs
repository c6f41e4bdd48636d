//! Column density of distance shells.
//!
//! ∫ n_d dr between two distances along a line of sight, n_d = exp(−R/h_R) sech²(z/h_z) of [`super::density`], by one
//! eight-point Gauss–Legendre panel per shell, pixels across lanes. Meant for shells no thicker than a few tenths of
//! their distance, where the integrand is a smooth exponential; cost 8 square roots and 16 exponentials per shell and
//! pixel. It makes synthetic skies; the polarisation integrals have a quadrature of their own.

use super::Density;
use crate::Error;
use crate::dispatch;
use crate::simd::{Lanes, Level, math};

/// Abscissae of the eight-point Gauss–Legendre rule on −1 … 1 and their weights; the rule is symmetric.
const RULE: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_361_98),
    (0.525_532_409_916_328_99, 0.313_706_645_877_887_29),
    (0.796_666_477_413_626_74, 0.222_381_034_453_374_47),
    (0.960_289_856_497_536_23, 0.101_228_536_290_376_26),
];

/// Column densities of the shells between `edges_kpc` towards `directions`.
///
/// | argument | shape | unit | domain |
/// | --- | --- | --- | --- |
/// | `r_sun_kpc` | 1 | kpc | finite |
/// | `edges_kpc` | N + 1 | kpc | increasing, from 0 or above |
/// | `directions` | n_pix | 1 | unit vectors, x to l = 0, y to l = 90°, z to the north Galactic pole |
/// | `out` | N slices of n_pix | kpc (n_0 = 1) | written |
///
/// # Accuracy
/// 1e-6 relative for half-magnitude shells of the default disc within 20 scale heights of the plane; zero where n_d
/// underflows.
/// # Errors
/// [`Error::Length`] of a slice, [`Error::Domain`] of the density.
pub fn columns_into(
    level: Level,
    density: &Density,
    r_sun_kpc: f64,
    edges_kpc: &[f64],
    directions: &[[f64; 3]],
    out: &mut [&mut [f64]],
) -> Result<(), Error> {
    density.check()?;
    Error::check_len("out", edges_kpc.len().saturating_sub(1), out.len())?;
    for map in out.iter() {
        Error::check_len("a shell of out", directions.len(), map.len())?;
    }
    dispatch!(level, |token: L| columns::<L>(
        token, density, r_sun_kpc, edges_kpc, directions, out
    ));
    Ok(())
}

/// What the density needs at every point, in lanes.
#[derive(Clone, Copy)]
struct Disc<L> {
    per_radius: L,
    per_height: L,
    sun: L,
}

/// Eight directions, by component.
#[derive(Clone, Copy)]
struct Directions<L> {
    x: L,
    y: L,
    z: L,
}

// Plain functions, not closures: a closure is compiled without the level's instructions.
#[inline(always)]
fn columns<L: Lanes>(
    token: L::Token,
    density: &Density,
    r_sun_kpc: f64,
    edges_kpc: &[f64],
    directions: &[[f64; 3]],
    out: &mut [&mut [f64]],
) {
    let disc = Disc {
        per_radius: L::splat(token, -1.0 / density.h_r_kpc),
        per_height: L::splat(token, -2.0 / density.h_z_kpc),
        sun: L::splat(token, -r_sun_kpc),
    };
    for (block, chunk) in directions.chunks(8).enumerate() {
        let mut components = [[0.0; 8]; 3];
        for (lane, direction) in chunk.iter().enumerate() {
            for (component, x) in components.iter_mut().zip(direction) {
                component[lane] = *x;
            }
        }
        let towards = Directions {
            x: L::load(token, &components[0]),
            y: L::load(token, &components[1]),
            z: L::load(token, &components[2]),
        };
        for (edges, map) in edges_kpc.windows(2).zip(out.iter_mut()) {
            let &[near, far] = edges else { continue };
            let (centre, half) = (0.5 * (near + far), 0.5 * (far - near));
            let mut sum = L::splat(token, 0.0);
            for (abscissa, weight) in RULE {
                let pair = density_at::<L>(token, disc, towards, centre - half * abscissa)
                    + density_at::<L>(token, disc, towards, centre + half * abscissa);
                sum = pair.mul_add(L::splat(token, weight), sum);
            }
            let column = sum * L::splat(token, 4.0 * half);
            if let Some(to) = map.get_mut(8 * block..) {
                column.store_padded(to);
            }
        }
    }
}

/// A quarter of n_d at distance `r` (kpc) in eight directions: sech² = 4 e^−2|x| / (1 + e^−2|x|)².
#[inline(always)]
fn density_at<L: Lanes>(token: L::Token, disc: Disc<L>, towards: Directions<L>, r: f64) -> L {
    let r = L::splat(token, r);
    let (px, py) = (r.mul_add(towards.x, disc.sun), r * towards.y);
    let radius = (px * px + py * py).sqrt();
    let e = math::exp(token, (r * towards.z).abs() * disc.per_height);
    let s = L::splat(token, 1.0) + e;
    math::exp(token, radius * disc.per_radius) * e / (s * s)
}
