//! Corners of the layout, and input that must be refused.

use core::f64::consts::PI;
use dust3d_kernels::Error;
use dust3d_kernels::healpix::layout::{self, Ring};
use dust3d_kernels::healpix::missing::{MISSING, is_missing};
use dust3d_kernels::healpix::{
    Location, NO_PIXEL, Nside, disc, interp, nest2ring, nested, resample, ring, ring2nest,
    ring2nest_into,
};
use dust3d_kernels::simd::Level;
use dust3d_tests::healpix::{NSIDES, assert_direction, assert_pixel};

#[test]
fn closed_form_nside() {
    for n in NSIDES {
        let nside = Nside::new(n).unwrap();
        assert_eq!(nside.get(), n);
        assert_eq!(Nside::from_npix(12 * n * n), Ok(nside));
        assert!(Nside::from_npix(12 * n * n + 1).is_err());
        assert!(Nside::from_npix(12 * n * n - 1).is_err());
        assert_eq!(
            nside.order().map(|k| 1 << k),
            n.is_power_of_two().then_some(n)
        );
        let sphere = nside.pixel_area() * nside.npix() as f64;
        assert!((sphere / (4.0 * PI) - 1.0).abs() < 1e-15);
        assert!((nside.resolution().powi(2) / nside.pixel_area() - 1.0).abs() < 1e-15);
    }
    for bad in [0, (1 << 29) + 1, u64::MAX] {
        assert_eq!(Nside::new(bad), Err(Error::Nside { nside: bad }));
    }
    assert!(Nside::from_npix(0).is_err() && Nside::from_npix(u64::MAX).is_err());
}

#[test]
fn naive_edges_every_nside() {
    for n in NSIDES {
        let nside = Nside::new(n).unwrap();
        let (npix, cap) = (nside.npix(), 2 * n * (n - 1));
        let belt = cap + 8 * n * n + 4 * n;
        let corners = [0, 4, cap, cap + 4 * n, npix / 2, belt, npix - 4];
        for corner in corners {
            for pixel in corner.saturating_sub(9)..(corner + 9).min(npix) {
                assert_pixel(nside, pixel);
            }
        }
    }
}

#[test]
fn naive_edges_directions() {
    let third = (2.0_f64 / 3.0).acos();
    let tiny = f64::MIN_POSITIVE;
    let mut thetas = vec![0.0, tiny, 1e-300, 1e-9, third, PI / 2.0, PI - third, PI];
    thetas.extend([third, PI / 2.0, PI - third].iter().flat_map(|t: &f64| {
        [-2i64, -1, 1, 2].map(|d| f64::from_bits(t.to_bits().wrapping_add_signed(d)))
    }));
    let mut phis = vec![
        0.0, -0.0, -1e-20, 1e-20, -1e-300, 7.0, -7.0, 1e6, -1e17, 1e300,
    ];
    phis.extend((-9..=9).map(|k| f64::from(k) * PI / 4.0));
    for n in NSIDES {
        let nside = Nside::new(n).unwrap();
        for &theta in &thetas {
            for &phi in &phis {
                assert_direction(nside, theta, phi);
            }
        }
    }
}

/// Every direction on the parallel |z| = 2/3 rounds to one side or the other, never to another ring.
#[test]
fn belt_edge_does_not_leave_its_rings() {
    for n in [1, 3, 64, 1000, 1 << 20, 1 << 29] {
        let nside = Nside::new(n).unwrap();
        for k in 0..4000 {
            let phi = f64::from(k) * 1.234_567e-3 + 1e-9 / n as f64;
            for z in [2.0 / 3.0, 2.0 / 3.0 - 1e-16, 2.0 / 3.0 + 1.2e-16] {
                for sign in [-1.0, 1.0] {
                    let location = Location {
                        z: sign * z,
                        sin_theta: (1.0 - z * z).sqrt(),
                        phi,
                    };
                    let pixel = ring::loc2pix(nside, location).unwrap();
                    let ring = layout::locate(nside, pixel).unwrap().ring;
                    let from_pole = if sign > 0.0 { ring } else { 4 * n - ring };
                    assert!(
                        (n.max(2) - 1..=n + 1).contains(&from_pole),
                        "{n}: {from_pole}"
                    );
                }
            }
        }
    }
}

#[test]
fn bad_pixels_and_angles_are_refused() {
    let nside = Nside::new(8).unwrap();
    let bad = Error::Pixel {
        pixel: 768,
        npix: 768,
    };
    assert_eq!(ring::pix2ang(nside, 768), Err(bad));
    assert_eq!(nested::pix2vec(nside, 768), Err(bad));
    assert_eq!(ring2nest(nside, 768), Err(bad));
    assert_eq!(nest2ring(nside, 768), Err(bad));
    assert_eq!(ring::neighbours(nside, 768), Err(bad));
    assert_eq!(layout::locate(nside, 768), Err(bad));
    assert!(Ring::new(nside, 0).is_err() && Ring::new(nside, 32).is_err());
    for (theta, phi) in [
        (f64::NAN, 0.0),
        (-1e-300, 0.0),
        (PI + 2e-5, 0.0),
        (1.0, f64::INFINITY),
        (1.0, f64::NAN),
    ] {
        assert!(matches!(
            ring::ang2pix(nside, theta, phi),
            Err(Error::Domain { .. })
        ));
        assert!(interp::ring(nside, theta, phi).is_err());
    }
    for vector in [[0.0; 3], [f64::NAN, 0.0, 1.0], [0.0, f64::INFINITY, 1.0]] {
        assert!(ring::vec2pix(nside, vector).is_err());
    }
    let location = Location {
        z: 0.5,
        sin_theta: 0.5,
        phi: 0.0,
    };
    assert!(ring::loc2pix(nside, location).is_err());
    let odd = Nside::new(6).unwrap();
    assert_eq!(nested::pix2ang(odd, 0), Err(Error::Nside { nside: 6 }));
    let pole = Location::from_ang(0.0, 0.0).unwrap();
    for (radius, fact) in [(-1.0, 1), (f64::NAN, 1), (1.0, 0), (1.0, 1 << 27)] {
        let inclusion = disc::Inclusion::Overlapping { fact };
        assert!(
            disc::ring_ranges(Level::detect(), nside, pole, radius, inclusion, |_| ()).is_err()
        );
        assert!(
            disc::nested_ranges(Level::detect(), nside, pole, radius, inclusion, |_| ()).is_err()
        );
    }
}

/// A bad element anywhere leaves the output as it was.
#[test]
fn bad_slices_write_nothing() {
    let nside = Nside::new(8).unwrap();
    for level in Level::available() {
        for at in [0, 7, 8, 16] {
            let mut pixels = [1_u64; 17];
            pixels[at] = 768;
            let mut out = [7_u64; 17];
            let (mut a, mut b, mut c) = ([7.0; 17], [7.0; 17], [7.0; 17]);
            assert!(ring2nest_into(level, nside, &pixels, &mut out).is_err());
            assert!(ring::pix2ang_into(level, nside, &pixels, &mut a, &mut b).is_err());
            assert!(nested::pix2vec_into(level, nside, &pixels, [&mut a, &mut b, &mut c]).is_err());
            let mut theta = [1.0; 17];
            theta[at] = f64::NAN;
            assert!(ring::ang2pix_into(level, nside, &theta, &[0.0; 17], &mut out).is_err());
            assert!(ring::ang2pix_into(level, nside, &[0.0; 17], &theta, &mut out).is_err());
            assert!(ring::vec2pix_into(level, nside, [&theta, &a, &b], &mut out).is_err());
            assert_eq!((out, a, b, c), ([7; 17], [7.0; 17], [7.0; 17], [7.0; 17]));
        }
        assert!(matches!(
            ring::ang2pix_into(level, nside, &[0.0; 3], &[0.0; 2], &mut [0; 3]),
            Err(Error::Length { .. })
        ));
    }
}

#[test]
fn missing_is_the_value_or_nan() {
    for value in [
        MISSING,
        f64::from(MISSING as f32),
        MISSING * (1.0 + 9e-6),
        f64::NAN,
    ] {
        assert!(is_missing(value));
    }
    for value in [
        0.0,
        -MISSING,
        MISSING * (1.0 + 1.1e-5),
        MISSING * (1.0 - 1.1e-5),
        f64::INFINITY,
    ] {
        assert!(!is_missing(value));
    }
    assert_eq!(NO_PIXEL.cast_signed(), -1);
}

#[test]
fn bad_maps_are_refused() {
    let (coarse, fine) = (Nside::new(4).unwrap(), Nside::new(6).unwrap());
    let level = Level::detect();
    let map = vec![0.0; 432];
    let mut out = vec![0.0; 192];
    assert!(matches!(
        resample::degrade_ring(level, fine, coarse, &map, &mut out),
        Err(Error::Domain { .. })
    ));
    assert!(resample::degrade_ring(level, fine, coarse, &map[1..], &mut out).is_err());
    assert!(resample::upgrade_bilinear_ring(level, fine, coarse, &map, &mut out[1..]).is_err());
    assert!(matches!(
        resample::upgrade_bilinear_ring_range(level, fine, coarse, &map, 1, &mut out),
        Err(Error::Pixel {
            pixel: 192,
            npix: 192
        })
    ));
    assert!(resample::to_nested(level, fine, &map, &mut map.clone()).is_err());
}
