//! Against the tables of `tests/data/healpix`.

use dust3d_kernels::healpix::{
    Location, Nside, disc, interp, layout, nest2ring, nested, ring, ring2nest,
};
use dust3d_kernels::simd::Level;
use dust3d_tests::tolerance::{HEALPIX_ANGLE, HEALPIX_WEIGHTS, HEALPIX_XY, HEALPIX_Z};

/// The rows of a table, in words.
fn rows(name: &str) -> Vec<Vec<String>> {
    let path = format!("{}/data/healpix/{name}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let rows: Vec<Vec<String>> = text
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| line.split(' ').map(str::to_owned).collect())
        .collect();
    assert!(rows.len() > 100, "{name} has lost its rows");
    rows
}

fn whole(word: &str) -> u64 {
    word.parse().unwrap()
}

fn real(word: &str) -> f64 {
    word.parse().unwrap()
}

/// −1 is none.
fn maybe(word: &str) -> Option<u64> {
    (word != "-1").then(|| whole(word))
}

fn nside_of(word: &str) -> Nside {
    Nside::new(whole(word)).unwrap()
}

fn eight(words: &[String]) -> [Option<u64>; 8] {
    core::array::from_fn(|k| maybe(&words[k]))
}

#[test]
fn healpy_table_orders_and_neighbours() {
    for row in rows("pixels.txt") {
        let (nside, pixel) = (nside_of(&row[0]), whole(&row[1]));
        assert_eq!(
            ring::neighbours(nside, pixel).unwrap(),
            eight(&row[3..11]),
            "{row:?}"
        );
        match maybe(&row[2]) {
            Some(nest) => {
                assert_eq!(ring2nest(nside, pixel), Ok(nest));
                assert_eq!(nest2ring(nside, nest), Ok(pixel));
                assert_eq!(
                    nested::neighbours(nside, nest).unwrap(),
                    eight(&row[11..19])
                );
            }
            None => assert!(ring2nest(nside, pixel).is_err()),
        }
    }
}

#[test]
fn healpy_table_directions_and_weights() {
    let mut worst: f64 = 0.0;
    for row in rows("directions.txt") {
        let (nside, theta, phi) = (nside_of(&row[0]), real(&row[1]), real(&row[2]));
        let pixel = whole(&row[3]);
        assert_eq!(ring::ang2pix(nside, theta, phi), Ok(pixel), "{row:?}");
        let vector = Location::from_ang(theta, phi).unwrap().to_vec();
        assert_eq!(ring::vec2pix(nside, vector), Ok(pixel), "{row:?}");
        let nest = maybe(&row[4]);
        if let Some(nest) = nest {
            assert_eq!(nested::ang2pix(nside, theta, phi), Ok(nest));
            assert_eq!(nested::vec2pix(nside, vector), Ok(nest));
        }
        let Some((pixels, weights)) = row[5..].split_at_checked(4) else {
            continue;
        };
        let stencil = interp::ring(nside, theta, phi).unwrap();
        assert_eq!(
            stencil.pixels.to_vec(),
            pixels.iter().map(|w| whole(w)).collect::<Vec<_>>()
        );
        for (got, expected) in stencil.weights.iter().zip(weights) {
            worst = worst.max((got - real(expected)).abs() / nside.get() as f64);
        }
        if nest.is_some() {
            let nested = interp::nested(nside, theta, phi).unwrap();
            assert_eq!(nested.weights, stencil.weights);
            assert_eq!(
                nested.pixels,
                stencil.pixels.map(|p| ring2nest(nside, p).unwrap())
            );
        }
    }
    HEALPIX_WEIGHTS.hold(worst);
}

#[test]
fn healpy_table_discs() {
    for row in rows("discs.txt") {
        let nside = nside_of(&row[0]);
        let centre = Location::from_ang(real(&row[1]), real(&row[2])).unwrap();
        let radius = real(&row[3]);
        let inclusion = match whole(&row[4]) {
            0 => disc::Inclusion::Centres,
            fact => disc::Inclusion::Overlapping {
                fact: u32::try_from(fact).unwrap(),
            },
        };
        let expected: Vec<u64> = row[6..].iter().map(|w| whole(w)).collect();
        let is_nested = whole(&row[5]) == 1;
        for level in Level::available() {
            let mut got = Vec::new();
            let each = |range: core::ops::Range<u64>| got.extend([range.start, range.end]);
            if is_nested {
                disc::nested_ranges(level, nside, centre, radius, inclusion, each).unwrap();
            } else {
                disc::ring_ranges(level, nside, centre, radius, inclusion, each).unwrap();
            }
            assert_eq!(got, expected, "{level} {row:?}");
        }
    }
}

fn ulps(got: f64, reference: f64) -> f64 {
    let ulp = f64::from_bits(reference.abs().to_bits() + 1) - reference.abs();
    (got - reference).abs() / ulp
}

#[test]
fn mp_edges_centres() {
    let (mut angle, mut z_worst, mut xy): (f64, f64, f64) = (0.0, 0.0, 0.0);
    for row in rows("centres.txt") {
        let (nside, pixel) = (nside_of(&row[0]), whole(&row[1]));
        let at = layout::locate(nside, pixel).unwrap();
        assert_eq!((at.ring, at.index), (whole(&row[2]), whole(&row[3])));
        let [theta, phi, z, sine, x, y] = core::array::from_fn(|k| real(&row[4 + k]));
        let location = ring::pix2loc(nside, pixel).unwrap();
        let (got_theta, got_phi) = ring::pix2ang(nside, pixel).unwrap();
        let vector = ring::pix2vec(nside, pixel).unwrap();
        angle = angle
            .max(ulps(got_theta, theta))
            .max(ulps(got_phi, phi))
            .max(ulps(location.sin_theta, sine));
        z_worst = z_worst.max(ulps(location.z, z)).max(ulps(vector[2], z));
        xy = xy
            .max((vector[0] - x).abs() / sine)
            .max((vector[1] - y).abs() / sine);
    }
    HEALPIX_ANGLE.hold(angle);
    HEALPIX_Z.hold(z_worst);
    HEALPIX_XY.hold(xy);
}

#[test]
fn mp_near_edges_ang2pix() {
    for row in rows("edges.txt") {
        let (nside, theta, phi) = (nside_of(&row[0]), real(&row[1]), real(&row[2]));
        assert_eq!(
            ring::ang2pix(nside, theta, phi),
            Ok(whole(&row[3])),
            "{row:?}"
        );
    }
}
