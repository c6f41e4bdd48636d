//! HEALPix references by other routes than the kernels', and properties shared by tests and fuzzing.

use dust3d_kernels::healpix::layout::{self, Ring};
use dust3d_kernels::healpix::{Location, Nside, interp, nest2ring, nested, ring, ring2nest};
use std::f64::consts::PI;

/// Resolutions worth testing one by one: small, odd, at the limits of f64 and of 64-bit products, the greatest.
pub const NSIDES: [u64; 16] = [
    1,
    2,
    3,
    4,
    7,
    8,
    64,
    100,
    2048,
    1 << 20,
    (1 << 20) + 7,
    1 << 24,
    1 << 25,
    (1 << 26) + 1,
    (1 << 29) - 1,
    1 << 29,
];

/// Angle between two directions, by the chord.
#[must_use]
pub fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let chord2: f64 = a.iter().zip(&b).map(|(x, y)| (x - y) * (x - y)).sum();
    2.0 * (0.5 * chord2.sqrt()).min(1.0).asin()
}

/// NESTED number to (face, x, y), bit by bit.
#[must_use]
pub fn naive_face_xy(order: u32, nested: u64) -> (u64, u64, u64) {
    let (mut x, mut y) = (0, 0);
    for bit in 0..order {
        x |= ((nested >> (2 * bit)) & 1) << bit;
        y |= ((nested >> (2 * bit + 1)) & 1) << bit;
    }
    (nested >> (2 * order), x, y)
}

/// The direction of a point of a face, 0 ≤ x, y ≤ 1 from its southern corner.
///
/// The face is a square on its corner in the (φ, height) plane, centred at longitude F₂ π/4 and height 1 − row; below
/// height 1 heights are z · 3/2, above it meridians converge (\[G05\], §5).
#[must_use]
pub fn face_point(face: u64, x: f64, y: f64) -> [f64; 3] {
    let row = (face / 4) as f64;
    let centre = 2.0 * (face % 4) as f64 + if face / 4 == 1 { 0.0 } else { 1.0 };
    let height = (1.0 - row) + (x + y - 1.0);
    let (z, phi) = if height.abs() <= 1.0 {
        (height * 2.0 / 3.0, (centre + x - y) * PI / 4.0)
    } else {
        let sigma = 2.0 - height.abs();
        let z = (1.0 - sigma * sigma / 3.0).copysign(height);
        let across = if sigma > 1e-12 { (x - y) / sigma } else { 0.0 };
        (z, (centre + across) * PI / 4.0)
    };
    let s = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    [s * phi.cos(), s * phi.sin(), z]
}

/// RING number to (ring, index) by walking the rings.
///
/// # Panics
/// If there is no such pixel.
#[must_use]
pub fn naive_ring(nside: u64, pixel: u64) -> (u64, u64) {
    let mut left = pixel;
    for ring in 1..4 * nside {
        let length = 4 * ring.min(nside).min(4 * nside - ring);
        if left < length {
            return (ring, left);
        }
        left -= length;
    }
    panic!("pixel {pixel} beyond the map");
}

/// Everything that must hold of one pixel, in RING and, where it exists, NESTED order.
///
/// # Panics
/// If something does not.
pub fn assert_pixel(nside: Nside, pixel: u64) {
    let n = nside.get();
    let location = ring::pix2loc(nside, pixel).unwrap();
    let (theta, phi) = ring::pix2ang(nside, pixel).unwrap();
    let vector = ring::pix2vec(nside, pixel).unwrap();
    assert!((0.0..2.0 * PI).contains(&phi) && theta > 0.0 && theta < PI);
    assert_eq!(ring::ang2pix(nside, theta, phi), Ok(pixel), "{n} ang");
    assert_eq!(ring::vec2pix(nside, vector), Ok(pixel), "{n} vec");
    assert_eq!(ring::loc2pix(nside, location), Ok(pixel), "{n} loc");

    let at = layout::locate(nside, pixel).unwrap();
    let own = Ring::of_pixel(nside, pixel).unwrap();
    assert_eq!(own, Ring::new(nside, at.ring).unwrap());
    assert_eq!(own.first_pixel() + at.index, pixel);
    assert!(own.pixels().contains(&pixel) && at.index < own.len());
    assert_eq!((own.z(), own.phi(at.index)), (location.z, location.phi));
    if at.ring > 1 {
        let above = Ring::new(nside, at.ring - 1).unwrap();
        assert_eq!(above.pixels().end, own.first_pixel());
        assert!(above.z() > own.z() || n > 1 << 26);
    }
    assert_eq!(own.mirrored().z(), -own.z());

    let around = ring::neighbours(nside, pixel).unwrap();
    for (k, &neighbour) in around.iter().enumerate() {
        let Some(neighbour) = neighbour else {
            assert_eq!(k % 2, 1, "{n}: only diagonal neighbours may lack");
            continue;
        };
        let back = ring::neighbours(nside, neighbour).unwrap();
        assert!(
            back.contains(&Some(pixel)),
            "{n}: {neighbour} does not know {pixel}"
        );
        let apart = distance(vector, ring::pix2vec(nside, neighbour).unwrap());
        assert!(apart < 2.0 * nside.max_pixel_radius() * (1.0 + 1e-6));
    }

    if nside.order().is_some() {
        let nest = ring2nest(nside, pixel).unwrap();
        assert_eq!(nest2ring(nside, nest), Ok(pixel));
        assert_eq!(nested::pix2ang(nside, nest), Ok((theta, phi)));
        assert_eq!(nested::pix2vec(nside, nest), Ok(vector));
        assert_eq!(nested::ang2pix(nside, theta, phi), Ok(nest));
        assert_eq!(nested::vec2pix(nside, vector), Ok(nest));
        let around_nest = nested::neighbours(nside, nest).unwrap();
        assert_eq!(
            around_nest.map(|p| p.map(|p| nest2ring(nside, p).unwrap())),
            around
        );
    } else {
        assert!(ring2nest(nside, pixel).is_err() && nested::neighbours(nside, pixel).is_err());
    }
}

/// Everything that must hold of one direction, whatever its numbers.
///
/// # Panics
/// If something does not.
pub fn assert_direction(nside: Nside, theta: f64, phi: f64) {
    let n = nside.get();
    let Ok(location) = Location::from_ang(theta, phi) else {
        assert!(!((0.0..=PI).contains(&theta) && phi.is_finite()));
        assert!(ring::ang2pix(nside, theta, phi).is_err());
        assert!(interp::ring(nside, theta, phi).is_err());
        return;
    };
    let pixel = ring::ang2pix(nside, theta, phi).unwrap();
    assert!(pixel < nside.npix());
    let slack = 1.0 + 1e-6 + 1e-15 * n as f64;
    // A huge φ has lost its place to the caller's rounding, for the sine as for the pixel.
    let apart = distance(location.to_vec(), ring::pix2vec(nside, pixel).unwrap());
    if phi.abs() < 100.0 {
        assert!(
            apart <= nside.max_pixel_radius() * slack,
            "{n}: {apart} from pixel {pixel} for ({theta}, {phi})"
        );
    }
    if nside.order().is_some() {
        assert_eq!(
            nest2ring(nside, nested::ang2pix(nside, theta, phi).unwrap()),
            Ok(pixel)
        );
    }

    let stencil = interp::ring(nside, theta, phi).unwrap();
    let sum: f64 = stencil.weights.iter().sum();
    assert!((sum - 1.0).abs() < 1e-14, "{n}: weights sum to {sum}");
    let mut mean_theta = 0.0;
    for (&q, &w) in stencil.pixels.iter().zip(&stencil.weights) {
        assert!((0.0..=1.0).contains(&w) && q < nside.npix());
        mean_theta += w * ring::pix2ang(nside, q).unwrap().0;
        if phi.abs() < 100.0 && w > 0.0 {
            let apart = distance(location.to_vec(), ring::pix2vec(nside, q).unwrap());
            assert!(apart <= 4.0 * nside.max_pixel_radius() * slack);
        }
    }
    // Linear in θ: the interpolation of θ itself is θ, away from the poles.
    let first = Ring::new(nside, 1).unwrap().theta();
    if theta > first && theta < PI - first {
        assert!((mean_theta - theta).abs() < 4e-15);
    }
}
