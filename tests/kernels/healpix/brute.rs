//! Against brute force, over whole small maps.

use dust3d_kernels::healpix::layout::{self, Ring};
use dust3d_kernels::healpix::{Location, Nside, disc, nested, ring, ring2nest};
use dust3d_kernels::simd::Level;
use dust3d_tests::healpix::{assert_pixel, distance, face_point, naive_face_xy, naive_ring};

const SMALL: [u64; 7] = [1, 2, 3, 4, 5, 8, 13];

#[test]
fn naive_small_layout() {
    for n in SMALL {
        let nside = Nside::new(n).unwrap();
        let mut next = 0;
        for (number, ring) in (1..).zip(Ring::all(nside)) {
            assert_eq!((ring.number(), ring.first_pixel()), (number, next));
            next += ring.len();
            let norm = ring.z() * ring.z() + ring.sin_theta() * ring.sin_theta();
            assert!((norm - 1.0).abs() < 1e-15);
            let half = if ring.is_shifted() { 0.5 } else { 0.0 };
            let expected = half * core::f64::consts::TAU / ring.len() as f64;
            assert!((ring.phi0() - expected).abs() < 1e-15);
        }
        assert_eq!(next, nside.npix());
        for pixel in 0..nside.npix() {
            let at = layout::locate(nside, pixel).unwrap();
            assert_eq!((at.ring, at.index), naive_ring(n, pixel));
            assert_pixel(nside, pixel);
        }
    }
}

/// A NESTED pixel's centre is the middle of its square on the face.
#[test]
fn naive_small_nested_centres() {
    for order in 0..6 {
        let nside = Nside::new(1 << order).unwrap();
        let n = nside.get() as f64;
        for pixel in 0..nside.npix() {
            let (face, x, y) = naive_face_xy(order, pixel);
            let expected = face_point(face, (x as f64 + 0.5) / n, (y as f64 + 0.5) / n);
            assert!(distance(nested::pix2vec(nside, pixel).unwrap(), expected) < 1e-14);
        }
    }
}

/// Neighbours are the pixels with a corner in common, and lie where their names say.
#[test]
fn naive_small_neighbours() {
    for order in 0..4 {
        let nside = Nside::new(1 << order).unwrap();
        let n = nside.get() as f64;
        let corners: Vec<[[f64; 3]; 4]> = (0..nside.npix())
            .map(|pixel| {
                let (face, x, y) = naive_face_xy(order, pixel);
                [(0, 0), (1, 0), (0, 1), (1, 1)]
                    .map(|(dx, dy)| face_point(face, (x + dx) as f64 / n, (y + dy) as f64 / n))
            })
            .collect();
        for pixel in 0..nside.npix() {
            let touches = |q: &u64| {
                *q != pixel
                    && corners[*q as usize].iter().any(|a| {
                        corners[pixel as usize]
                            .iter()
                            .any(|b| distance(*a, *b) < 1e-7)
                    })
            };
            let expected: Vec<u64> = (0..nside.npix()).filter(touches).collect();
            let around = nested::neighbours(nside, pixel).unwrap();
            let mut got: Vec<u64> = around.into_iter().flatten().collect();
            got.sort_unstable();
            assert_eq!(got, expected, "nside {n} pixel {pixel}");
        }
    }
}

/// Sums of squared distances decide, one pixel at a time.
#[test]
fn naive_small_discs() {
    for n in [1, 2, 3, 8, 16] {
        let nside = Nside::new(n).unwrap();
        let vectors: Vec<[f64; 3]> = (0..nside.npix())
            .map(|p| ring::pix2vec(nside, p).unwrap())
            .collect();
        for (theta, phi) in [
            (0.0, 0.0),
            (1e-9, 1.0),
            (0.3, 6.27),
            (1.0, 0.01),
            (1.6, 3.0),
            (2.9, 4.0),
            (core::f64::consts::PI, 2.0),
        ] {
            let centre = Location::from_ang(theta, phi).unwrap();
            for radius in [1e-3, 0.05, 0.2, 0.7, 1.5, 2.5, 3.1, 3.2, f64::INFINITY] {
                let inside: Vec<u64> = (0..nside.npix())
                    .filter(|&p| distance(vectors[p as usize], centre.to_vec()) <= radius)
                    .collect();
                for level in Level::available() {
                    let mut got = Vec::new();
                    let mut end = None;
                    disc::ring_ranges(
                        level,
                        nside,
                        centre,
                        radius,
                        disc::Inclusion::Centres,
                        |r| {
                            assert!(r.start < r.end && end.is_none_or(|end| end < r.start));
                            end = Some(r.end);
                            got.extend(r);
                        },
                    )
                    .unwrap();
                    assert_eq!(got, inside, "{level} nside {n} ({theta}, {phi}) {radius}");
                }
                if nside.order().is_some() {
                    let mut expected: Vec<u64> = inside
                        .iter()
                        .map(|&p| ring2nest(nside, p).unwrap())
                        .collect();
                    expected.sort_unstable();
                    for level in Level::available() {
                        let mut got = Vec::new();
                        let inclusion = disc::Inclusion::Centres;
                        disc::nested_ranges(level, nside, centre, radius, inclusion, |r| {
                            got.extend(r);
                        })
                        .unwrap();
                        assert_eq!(got, expected, "{level} nside {n} ({theta}, {phi}) {radius}");
                    }
                }
            }
        }
    }
}

/// No pixel with a point inside the disc is left out: a hundred points of every pixel are tried.
#[test]
fn naive_small_overlapping_discs() {
    let order = 3;
    let nside = Nside::new(1 << order).unwrap();
    let n = nside.get() as f64;
    for (theta, phi, radius) in [
        (0.02, 1.0, 0.1),
        (0.8, 0.1, 0.03),
        (1.5, 3.2, 0.25),
        (2.5, 6.2, 0.001),
        (3.1, 4.0, 0.6),
    ] {
        let centre = Location::from_ang(theta, phi).unwrap();
        for fact in [1, 2, 4, 8] {
            let inclusion = disc::Inclusion::Overlapping { fact };
            let (mut in_ring, mut in_nested) = (Vec::new(), Vec::new());
            disc::ring_ranges(Level::detect(), nside, centre, radius, inclusion, |r| {
                in_ring.extend(r);
            })
            .unwrap();
            disc::nested_ranges(Level::detect(), nside, centre, radius, inclusion, |r| {
                in_nested.extend(r);
            })
            .unwrap();
            for pixel in 0..nside.npix() {
                let (face, x, y) = naive_face_xy(order, pixel);
                let touched = (0..100).any(|k| {
                    let (i, j) = ((k / 10) as f64, (k % 10) as f64);
                    let point =
                        face_point(face, (x as f64 + i / 9.0) / n, (y as f64 + j / 9.0) / n);
                    distance(point, centre.to_vec()) < radius
                });
                if touched {
                    assert!(in_nested.contains(&pixel));
                    let ring = dust3d_kernels::healpix::nest2ring(nside, pixel).unwrap();
                    assert!(in_ring.contains(&ring));
                }
            }
            let reach = radius + 2.0 * nside.max_pixel_radius();
            for &pixel in &in_ring {
                assert!(distance(ring::pix2vec(nside, pixel).unwrap(), centre.to_vec()) < reach);
            }
        }
    }
}

/// Both orders and all levels find the same pixels, at every depth of the tree, small discs and large, on the poles, on
/// φ = 0 and in between.
#[test]
fn levels_agree_discs_in_either_order() {
    for order in 0..30 {
        let nside = Nside::new(1 << order).unwrap();
        let pixel = nside.resolution();
        for (i, &(theta, phi)) in [(0.0, 0.0), (0.3, -0.01), (0.9, 1.6), (1.6, 0.0), (2.7, 4.0)]
            .iter()
            .enumerate()
        {
            let centre = Location::from_ang(theta, phi).unwrap();
            for radius in [0.2, 1.3, 7.7, 40.3 + i as f64].map(|pixels| pixels * pixel) {
                let mut found = Vec::new();
                for level in Level::available() {
                    let (mut in_ring, mut in_nested) = (Vec::new(), Vec::new());
                    let inclusion = disc::Inclusion::Centres;
                    disc::ring_ranges(level, nside, centre, radius, inclusion, |r| {
                        in_ring.extend(r.map(|p| ring2nest(nside, p).unwrap()));
                    })
                    .unwrap();
                    let mut end = None;
                    disc::nested_ranges(level, nside, centre, radius, inclusion, |r| {
                        assert!(r.start < r.end && end.is_none_or(|end| end < r.start));
                        end = Some(r.end);
                        in_nested.extend(r);
                    })
                    .unwrap();
                    in_ring.sort_unstable();
                    assert_eq!(
                        in_ring, in_nested,
                        "{level} {order} ({theta}, {phi}) {radius}"
                    );
                    found.push(in_nested);
                }
                assert!(found.iter().all(|f| *f == found[0]));
            }
        }
    }
}
