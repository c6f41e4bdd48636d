//! HEALPix: every pixel and every direction, at any Nside, keep their properties; no disc panics.
#![no_main]

use arbitrary::Arbitrary;
use dust3d_kernels::healpix::{Location, Nside, disc};
use dust3d_kernels::simd::Level;
use dust3d_tests::healpix::{assert_direction, assert_pixel};
use libfuzzer_sys::fuzz_target;

#[derive(Debug, Arbitrary)]
struct Input {
    nside: u64,
    pixel: u64,
    theta: f64,
    phi: f64,
    radius: f64,
    fact: Option<u8>,
}

fuzz_target!(|input: Input| {
    let nside = Nside::new(1 + input.nside % Nside::MAX.get()).unwrap_or(Nside::MAX);
    assert_pixel(nside, input.pixel % nside.npix());
    assert_direction(nside, input.theta, input.phi);

    let small = Nside::new(1 + input.nside % 64).unwrap_or(Nside::MAX);
    let Ok(centre) = Location::from_ang(input.theta, input.phi) else {
        return;
    };
    let inclusion = input.fact.map_or(disc::Inclusion::Centres, |fact| {
        disc::Inclusion::Overlapping {
            fact: u32::from(fact % 9),
        }
    });
    let mut end = None;
    let check = |range: core::ops::Range<u64>| {
        assert!(range.start < range.end && range.end <= small.npix());
        assert!(end.is_none_or(|end| end < range.start));
        end = Some(range.end);
    };
    let _ = disc::ring_ranges(
        Level::detect(),
        small,
        centre,
        input.radius,
        inclusion,
        check,
    );
});
