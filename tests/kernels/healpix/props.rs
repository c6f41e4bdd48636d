//! Properties over random input, for every Nside.

use dust3d_kernels::healpix::{Location, NO_PIXEL, Nside, disc, nested, ring};
use dust3d_kernels::healpix::{nest2ring, nest2ring_into, ring2nest, ring2nest_into};
use dust3d_kernels::simd::Level;
use dust3d_tests::healpix::{assert_direction, assert_pixel, distance};
use dust3d_tests::random::Random;
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

fn slices_of(planes: &mut [Vec<u64>; 8]) -> [&mut [u64]; 8] {
    planes.each_mut().map(Vec::as_mut_slice)
}

/// Orders and neighbours of slices are those of their elements, at every level of instructions: random pixels, those of the
/// caps and of the borders of faces among them, at powers of two and other Nside.
#[test]
fn levels_agree_random_pixels() {
    let mut random = Random(1);
    for n in (0..30)
        .map(|k| 1 << k)
        .chain([3, 7, 100, 1000, 5_000, (1 << 22) - 1])
    {
        let nside = Nside::new(n).unwrap();
        let pixels: Vec<u64> = (0..1003)
            .map(|k| {
                let pixel = (random.bits() >> (k % 40)) % nside.npix();
                // A third from the end; a third on the borders of faces, in NESTED order.
                match k % 3 {
                    0 => pixel,
                    1 => nside.npix() - 1 - pixel,
                    _ => (pixel & 0x5555_5555_5555_5555) % nside.npix(),
                }
            })
            .collect();
        for level in Level::available() {
            let mut out = vec![0; pixels.len()];
            let mut planes = [(); 8].map(|()| vec![0; pixels.len()]);
            let neighbours_ok = |planes: &[Vec<u64>], scalar: &dyn Fn(u64) -> [Option<u64>; 8]| {
                for (k, &pixel) in pixels.iter().enumerate() {
                    let expected = scalar(pixel).map(|p| p.unwrap_or(NO_PIXEL));
                    let got: Vec<u64> = planes.iter().map(|plane| plane[k]).collect();
                    assert_eq!(got, expected, "{level} nside {n} pixel {pixel}");
                }
            };
            ring::neighbours_into(level, nside, &pixels, slices_of(&mut planes)).unwrap();
            neighbours_ok(&planes, &|p| ring::neighbours(nside, p).unwrap());
            if nside.order().is_none() {
                continue;
            }
            nested::neighbours_into(level, nside, &pixels, slices_of(&mut planes)).unwrap();
            neighbours_ok(&planes, &|p| nested::neighbours(nside, p).unwrap());
            ring2nest_into(level, nside, &pixels, &mut out).unwrap();
            for (&pixel, &got) in pixels.iter().zip(&out) {
                assert_eq!(
                    got,
                    ring2nest(nside, pixel).unwrap(),
                    "{level} nside {n} {pixel}"
                );
            }
            nest2ring_into(level, nside, &pixels, &mut out).unwrap();
            for (&pixel, &got) in pixels.iter().zip(&out) {
                assert_eq!(
                    got,
                    nest2ring(nside, pixel).unwrap(),
                    "{level} nside {n} {pixel}"
                );
            }
        }
    }
}
