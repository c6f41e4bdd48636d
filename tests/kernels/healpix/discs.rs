//! Discs of many pixels, ring by ring against plain arithmetic.

use dust3d_kernels::healpix::layout::Ring;
use dust3d_kernels::healpix::{Location, Nside, disc, ring2nest};
use dust3d_kernels::simd::Level;
use dust3d_tests::random::Random;
use std::f64::consts::PI;
use std::ops::Range;

fn ranges_of(level: Level, nside: Nside, centre: Location, radius: f64) -> Vec<Range<u64>> {
    let mut ranges: Vec<Range<u64>> = Vec::new();
    disc::ring_ranges(level, nside, centre, radius, Default::default(), |r| {
        assert!(r.start < r.end && ranges.last().is_none_or(|last| last.end < r.start));
        ranges.push(r);
    })
    .unwrap();
    ranges
}

/// The places of a ring in a disc, and those that rounding may take or leave.
struct Naive {
    certain: Range<i64>,
    possible: Range<i64>,
}

fn naive_arc(ring: Ring, centre: Location, radius: f64) -> Naive {
    let (dz, ds) = (ring.z() - centre.z, ring.sin_theta() - centre.sin_theta);
    let chord = 2.0 * (0.5 * radius).sin();
    let len = ring.len() as i64;
    let scale = 4.0 * ring.sin_theta() * centre.sin_theta;
    let arc = |room: f64, spare: f64| {
        let q = room / scale;
        if room < 0.0 {
            return 0..0;
        }
        if q.is_nan() || q >= 1.0 {
            return 0..len;
        }
        let step = 2.0 * PI / len as f64;
        let half = 2.0 * q.sqrt().asin() / step + spare;
        let at = (centre.phi - ring.phi0()) / step;
        let (west, east) = ((at - half).ceil() as i64, (at + half).floor() as i64);
        let count = (east - west + 1).clamp(0, len);
        west..west + count
    };
    let room = chord * chord - dz * dz - ds * ds;
    let rounding = 1e-14 * chord.max(1e-9 / ring.len() as f64);
    Naive {
        certain: arc(room - rounding, -1e-6),
        possible: arc(room + rounding, 1e-6),
    }
}

/// How many pixels of a range are in the ranges.
fn held(ranges: &[Range<u64>], pixels: Range<u64>) -> u64 {
    let from = ranges.partition_point(|r| r.end <= pixels.start);
    ranges[from..]
        .iter()
        .take_while(|r| r.start < pixels.end)
        .map(|r| r.end.min(pixels.end) - r.start.max(pixels.start))
        .sum()
}

/// Compares the rings near a disc; gives the number of rings on which rounding decides.
fn compare(nside: Nside, centre: Location, radius: f64) -> (u64, u64) {
    let theta = centre.sin_theta.atan2(centre.z);
    // Rings lie at least 2/(3 Nside) apart.
    let reach = (radius * 1.5 * nside.get() as f64) as u64 + 3;
    let middle = Ring::all(nside)
        .take_while(|ring| ring.theta() < theta)
        .count() as u64;
    let (north, south) = (
        middle.saturating_sub(reach).max(1),
        (middle + reach).min(nside.nrings()),
    );
    let (mut rings, mut unsure) = (0, 0);
    let all: Vec<_> = Level::available()
        .map(|level| ranges_of(level, nside, centre, radius))
        .collect();
    for ranges in &all {
        for i in north..=south {
            let ring = Ring::new(nside, i).unwrap();
            let (first, len) = (ring.first_pixel(), ring.len());
            let count = held(ranges, first..first + len);
            let Naive { certain, possible } = naive_arc(ring, centre, radius);
            let least = certain.end - certain.start;
            let most = possible.end - possible.start;
            assert!(
                (least..=most).contains(&(count as i64)),
                "nside {nside:?} {centre:?} {radius} ring {i}: {count}, not {least} to {most}"
            );
            // The certain ones, in up to two parts.
            let west = certain.start.rem_euclid(len as i64) as u64;
            let end = west + least as u64;
            let split = end.min(len);
            let there = held(ranges, first + west..first + split)
                + held(ranges, first..first + (end - split));
            assert_eq!(
                there, least as u64,
                "nside {nside:?} {centre:?} {radius} ring {i}"
            );
            rings += 1;
            unsure += u64::from(least != most);
        }
        let total: u64 = ranges.iter().map(|r| r.end - r.start).sum();
        let near = Ring::new(nside, north).unwrap().first_pixel()
            ..Ring::new(nside, south).unwrap().pixels().end;
        assert_eq!(held(ranges, near), total, "pixels far from the disc");
    }
    (rings, unsure)
}

/// Discs around the poles and touching them, at the edges of the caps, across φ = 0 and to it, of nearly no radius and of
/// nearly π, and some at random.
#[test]
fn naive_large_discs() {
    let edge = (2.0_f64 / 3.0).acos();
    let mut numbers = Random(7);
    let mut random = || 0.5 * (numbers.next() + 1.0);
    let (mut rings, mut unsure) = (0, 0);
    for n in [5, 64, 300, 2048] {
        let nside = Nside::new(n).unwrap();
        let mut cases = Vec::new();
        for theta in [
            0.0,
            1e-12,
            1e-4,
            0.3,
            edge,
            0.5 * PI,
            PI - edge,
            2.8,
            PI - 1e-9,
            PI,
        ] {
            for phi in [0.0, 1e-13, 0.4, PI, 5.9, 2.0 * PI - 1e-13] {
                for radius in [
                    1e-12,
                    0.7 / n as f64,
                    0.02,
                    theta,
                    PI - theta,
                    1.3,
                    3.0,
                    PI - 1e-9,
                ] {
                    cases.push((theta, phi, radius));
                }
            }
        }
        cases.retain(|_| n < 2048 || random() < 0.1);
        cases.extend((0..60).map(|_| {
            let theta = (2.0 * random() - 1.0).acos();
            (theta, 2.0 * PI * random(), PI * random().powi(3))
        }));
        for (theta, phi, radius) in cases {
            let counts = compare(nside, Location::from_ang(theta, phi).unwrap(), radius);
            rings += counts.0;
            unsure += counts.1;
        }
    }
    // Most of these where the rim passes through a pole or a centre.
    assert!(unsure * 50 < rings, "{unsure} of {rings}");
}

/// The rim passes through centres: every level that fuses decides alike.
#[test]
fn levels_agree_discs_to_centres() {
    for n in [64, 2048, 1 << 20] {
        let nside = Nside::new(n).unwrap();
        let npix = nside.npix();
        for k in 0..200 {
            let home = (npix / 211) * k + k;
            let location = |p: u64| dust3d_kernels::healpix::ring::pix2loc(nside, p).unwrap();
            let (a, b) = (location(home), location((home + 40 * k + 1) % npix));
            let sine = (0.5 * (a.phi - b.phi)).sin();
            let (dz, ds) = (a.z - b.z, a.sin_theta - b.sin_theta);
            let chord2 = dz * dz + ds * ds + 4.0 * a.sin_theta * b.sin_theta * sine * sine;
            let radius = 2.0 * (0.5 * chord2.sqrt()).min(1.0).asin();
            if radius * n as f64 > 1e4 {
                continue;
            }
            let found: Vec<_> = Level::available()
                .filter(|level| level.name() != "portable")
                .map(|level| ranges_of(level, nside, a, radius))
                .collect();
            assert!(found.iter().all(|f| *f == found[0]), "{n} {home}");
        }
    }
}

/// Discs of no, one and a few pixels in either order: at random, and about the borders and corners of the faces, where the
/// search cannot begin beside the centre.
#[test]
fn orders_agree_small_discs() {
    let mut numbers = Random(3);
    let mut random = || 0.5 * (numbers.next() + 1.0);
    let edge = (2.0_f64 / 3.0).acos();
    let mut sizes = [0_usize; 4];
    for order in [0, 1, 2, 3, 4, 6, 11, 20, 29] {
        let nside = Nside::new(1 << order).unwrap();
        let pixel = nside.resolution();
        for k in 0..1200 {
            let near = pixel * 3.0 * (random() - 0.5);
            let quarter = 0.25 * PI * (8.0 * random()).floor();
            // Meridians of the faces, parallels of their corners, and the falling edge from (⅔, 0) to (0, π/4).
            let (theta, phi) = match k % 4 {
                0 => (PI * random(), quarter + near),
                1 => ([edge, 0.5 * PI, PI - edge][k % 3] + near, quarter + near),
                2 => {
                    let along = random();
                    ((2.0 / 3.0 * (1.0 - along)).acos() + near, 0.25 * PI * along)
                }
                _ => ((2.0 * random() - 1.0).acos(), 2.0 * PI * random()),
            };
            let centre = Location::from_ang(theta.abs().min(PI), phi).unwrap();
            let radius = pixel * 4.0 * random().powi(3);
            for level in Level::available() {
                let mut in_ring: Vec<u64> = ranges_of(level, nside, centre, radius)
                    .into_iter()
                    .flatten()
                    .map(|p| ring2nest(nside, p).unwrap())
                    .collect();
                in_ring.sort_unstable();
                let mut in_nested = Vec::new();
                disc::nested_ranges(level, nside, centre, radius, Default::default(), |r| {
                    in_nested.extend(r);
                })
                .unwrap();
                assert_eq!(in_ring, in_nested, "{level} {order} {centre:?} {radius}");
                sizes[in_ring.len().min(3)] += 1;
            }
        }
    }
    assert!(sizes.iter().all(|&n| n > 300), "{sizes:?}");
}
