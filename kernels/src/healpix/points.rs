//! Pixel ↔ direction over slices, for either order.

use super::location::{check_phi, check_theta, check_vec};
use super::{Location, Nside, vector};
use crate::Error;
use crate::simd::Level;

/// An order of pixel numbers: what a slice function needs to know of it. Pixels given exist.
pub(super) trait Order: Copy {
    /// NESTED (else RING)?
    const NESTED: bool;

    fn location(self, nside: Nside, pixel: u64) -> Location;
    fn pixel(self, nside: Nside, location: Location) -> u64;
    fn neighbours(self, nside: Nside, pixel: u64) -> [u64; 8];
    /// Neighbours of a slice by vector kernels; false if they cannot, or a pixel does not exist.
    fn neighbours_by_vectors(
        self,
        level: Level,
        nside: Nside,
        pixels: &[u64],
        out: [&mut [u64]; 8],
    ) -> bool;
}

pub(super) fn pix2ang<O: Order>(
    level: Level,
    order: O,
    nside: Nside,
    pixels: &[u64],
    theta: &mut [f64],
    phi: &mut [f64],
) -> Result<(), Error> {
    Error::check_len("theta", pixels.len(), theta.len())?;
    Error::check_len("phi", pixels.len(), phi.len())?;
    if vector::fits(nside) {
        let done = if O::NESTED {
            vector::pix2ang::<true>(level, nside, pixels, theta, phi)
        } else {
            vector::pix2ang::<false>(level, nside, pixels, theta, phi)
        };
        if done {
            return Ok(());
        }
    }
    nside.check_pixels(pixels)?;
    for ((&pixel, theta), phi) in pixels.iter().zip(theta).zip(phi) {
        let location = order.location(nside, pixel);
        (*theta, *phi) = (location.theta(), location.phi);
    }
    Ok(())
}

pub(super) fn ang2pix<O: Order>(
    level: Level,
    order: O,
    nside: Nside,
    theta: &[f64],
    phi: &[f64],
    pixels: &mut [u64],
) -> Result<(), Error> {
    Error::check_len("phi", theta.len(), phi.len())?;
    Error::check_len("pixels", theta.len(), pixels.len())?;
    if vector::fits(nside) {
        let done = if O::NESTED {
            vector::ang2pix::<true>(level, nside, theta, phi, pixels)
        } else {
            vector::ang2pix::<false>(level, nside, theta, phi, pixels)
        };
        if done {
            return Ok(());
        }
    }
    for (&theta, &phi) in theta.iter().zip(phi) {
        check_theta(theta)?;
        check_phi(phi)?;
    }
    for ((&theta, &phi), pixel) in theta.iter().zip(phi).zip(pixels) {
        *pixel = order.pixel(nside, Location::from_valid_ang(theta, phi));
    }
    Ok(())
}

pub(super) fn pix2vec<O: Order>(
    level: Level,
    order: O,
    nside: Nside,
    pixels: &[u64],
    [x, y, z]: [&mut [f64]; 3],
) -> Result<(), Error> {
    Error::check_len("x", pixels.len(), x.len())?;
    Error::check_len("y", pixels.len(), y.len())?;
    Error::check_len("z", pixels.len(), z.len())?;
    if vector::fits(nside) {
        let done = if O::NESTED {
            vector::pix2vec::<true>(level, nside, pixels, [&mut *x, &mut *y, &mut *z])
        } else {
            vector::pix2vec::<false>(level, nside, pixels, [&mut *x, &mut *y, &mut *z])
        };
        if done {
            return Ok(());
        }
    }
    nside.check_pixels(pixels)?;
    for (((&pixel, x), y), z) in pixels.iter().zip(x).zip(y).zip(z) {
        [*x, *y, *z] = order.location(nside, pixel).to_vec();
    }
    Ok(())
}

pub(super) fn vec2pix<O: Order>(
    level: Level,
    order: O,
    nside: Nside,
    [x, y, z]: [&[f64]; 3],
    pixels: &mut [u64],
) -> Result<(), Error> {
    Error::check_len("y", x.len(), y.len())?;
    Error::check_len("z", x.len(), z.len())?;
    Error::check_len("pixels", x.len(), pixels.len())?;
    if vector::fits(nside) {
        let done = if O::NESTED {
            vector::vec2pix::<true>(level, nside, [x, y, z], pixels)
        } else {
            vector::vec2pix::<false>(level, nside, [x, y, z], pixels)
        };
        if done {
            return Ok(());
        }
    }
    for ((&x, &y), &z) in x.iter().zip(y).zip(z) {
        check_vec([x, y, z])?;
    }
    for (((&x, &y), &z), pixel) in x.iter().zip(y).zip(z).zip(pixels) {
        *pixel = order.pixel(nside, Location::from_valid_vec([x, y, z]));
    }
    Ok(())
}

pub(super) fn neighbours<O: Order>(
    level: Level,
    order: O,
    nside: Nside,
    pixels: &[u64],
    out: [&mut [u64]; 8],
) -> Result<(), Error> {
    for plane in &out {
        Error::check_len("neighbours", pixels.len(), plane.len())?;
    }
    // Planes of borrowed slices, lent on.
    let mut out = out;
    if order.neighbours_by_vectors(
        level,
        nside,
        pixels,
        out.each_mut().map(|plane| &mut **plane),
    ) {
        return Ok(());
    }
    nside.check_pixels(pixels)?;
    let [sw, w, nw, n, ne, e, se, s] = out;
    let west = sw.iter_mut().zip(w).zip(nw).zip(n);
    let east = ne.iter_mut().zip(e).zip(se).zip(s);
    for ((&pixel, (((sw, w), nw), n)), (((ne, e), se), s)) in pixels.iter().zip(west).zip(east) {
        [*sw, *w, *nw, *n, *ne, *e, *se, *s] = order.neighbours(nside, pixel);
    }
    Ok(())
}
