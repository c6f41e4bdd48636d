//! Properties over random input, for every Nside.

use dust3d_kernels::healpix::{Location, Nside, disc, ring};
use dust3d_kernels::simd::Level;
use dust3d_tests::healpix::{assert_direction, assert_pixel, distance};
use proptest::prelude::*;

/// Any Nside, small ones and powers of two more often than not.
fn nsides() -> impl Strategy<Value = Nside> {
    prop_oneof![(0_u32..30).prop_map(|k| 1 << k), 1_u64..50, 1_u64..=1 << 29,]
        .prop_map(|n| Nside::new(n).unwrap())
}

/// Any pixel, those near the poles as often as the others.
fn pixels() -> impl Strategy<Value = (Nside, u64)> {
    (nsides(), any::<u64>(), 0_u32..64, any::<bool>()).prop_map(|(nside, random, shift, south)| {
        let pixel = (random >> shift) % nside.npix();
        (
            nside,
            if south {
                nside.npix() - 1 - pixel
            } else {
                pixel
            },
        )
    })
}

fn thetas() -> impl Strategy<Value = f64> {
    let pi = core::f64::consts::PI;
    prop_oneof![
        0.0..=pi,
        (-300.0..0.0).prop_map(|e| 10_f64.powf(e)),
        (-16.0..0.0).prop_map(move |e| pi - 10_f64.powf(e)),
        any::<f64>(),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn prop_every_pixel_round_trips((nside, pixel) in pixels()) {
        assert_pixel(nside, pixel);
    }

    #[test]
    fn prop_every_direction_has_a_pixel(nside in nsides(), theta in thetas(), phi in prop_oneof![-10.0..10.0, any::<f64>()]) {
        assert_direction(nside, theta, phi);
    }

    #[test]
    fn prop_vectors_of_any_length(
        nside in nsides(),
        v in [-1.0..1.0, -1.0..1.0, -1.0..1.0],
        exponent in -300..300,
    ) {
        prop_assume!(v.iter().any(|c: &f64| c.abs() > 1e-3));
        let scale = 2_f64.powi(exponent);
        prop_assert_eq!(ring::vec2pix(nside, v), ring::vec2pix(nside, v.map(|c| c * scale)));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn prop_discs_hold_what_is_near(
        order in 0_u32..6,
        theta in 0.0..core::f64::consts::PI,
        phi in -7.0..7.0,
        exponent in -3.0..0.5,
    ) {
        let nside = Nside::new(1 << order).unwrap();
        let (centre, radius) = (Location::from_ang(theta, phi).unwrap(), 10_f64.powf(exponent));
        let mut inside = vec![false; nside.npix() as usize];
        disc::ring_ranges(Level::detect(), nside, centre, radius, Default::default(), |r| {
            inside[r.start as usize..r.end as usize].fill(true);
        }).unwrap();
        for pixel in 0..nside.npix() {
            let apart = distance(ring::pix2vec(nside, pixel).unwrap(), centre.to_vec());
            if (apart - radius).abs() > 1e-12 {
                prop_assert_eq!(inside[pixel as usize], apart < radius);
            }
        }
    }
}
