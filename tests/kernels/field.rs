//! Dust density, spiral field, line-of-sight ratios.

use dust3d_kernels::Error;
use dust3d_kernels::field::line_of_sight::{ratios_into, ratios_scratch_len};
use dust3d_kernels::field::{Density, Grains, Model, Spiral};
use dust3d_kernels::simd::Level;
use dust3d_tests::{reference, sightline, tolerance};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use std::f64::consts::{FRAC_PI_2, PI};

/// The distance edges of the paper, kpc.
fn edges() -> Vec<f64> {
    let moduli = [4.0, 7.0, 10.0, 13.0, 16.0, 19.0];
    let far = moduli.iter().map(|mu| 10_f64.powf(mu / 5.0 + 1.0) / 1000.0);
    std::iter::once(0.0).chain(far).collect()
}

fn direction(lon: f64, lat: f64) -> [f64; 3] {
    [lat.cos() * lon.cos(), lat.cos() * lon.sin(), lat.sin()]
}

/// Ratios of every layer and direction: \[layer\]\[direction\] (Q/I, U/I), on dirty scratch.
fn kernel(
    level: Level,
    model: &Model,
    edges: &[f64],
    directions: &[[f64; 3]],
) -> Vec<Vec<[f64; 2]>> {
    let layers = edges.len() - 1;
    let mut maps = vec![vec![f64::NAN; directions.len()]; 2 * layers];
    let mut slices: Vec<&mut [f64]> = maps.iter_mut().map(|m| &mut m[..]).collect();
    let (q, u) = slices.split_at_mut(layers);
    let mut scratch = vec![f64::NAN; ratios_scratch_len()];
    ratios_into(level, model, edges, directions, q, u, &mut scratch).unwrap();
    (0..layers)
        .map(|i| {
            (0..directions.len())
                .map(|p| [maps[i][p], maps[layers + i][p]])
                .collect()
        })
        .collect()
}

fn one(model: &Model, lon: f64, lat: f64, near: f64, far: f64) -> [f64; 2] {
    kernel(Level::detect(), model, &[near, far], &[direction(lon, lat)])[0][0]
}

fn with_pitch(pitch_rad: f64) -> Model {
    Model {
        spiral: Spiral {
            pitch_rad,
            ..Spiral::default()
        },
        ..Model::default()
    }
}

#[test]
fn mp_table_ratios() {
    let table = include_str!("../data/field/line_of_sight.txt");
    let rows = reference::rows(table);
    assert!(rows.len() > 150);
    let mut worst: f64 = 0.0;
    for row in rows {
        let &[lon, lat, near, far, pitch, k, h_r_kpc, h_z_kpc, q, u] = &row[..] else {
            panic!("ten columns")
        };
        let mut model = with_pitch(pitch);
        model.density = Density { h_r_kpc, h_z_kpc };
        model.grains.k = k;
        let got = one(&model, lon, lat, near, far);
        worst = worst.max((got[0] - q).abs()).max((got[1] - u).abs());
        // The adaptive rule of the other tests is held to the same table.
        let slow = sightline::ratios(&model, lon, lat, near, far);
        assert!(
            (slow[0] - q).abs().max((slow[1] - u).abs()) < 1e-10,
            "{row:?}: {slow:?}"
        );
    }
    tolerance::SIGHT_MP.hold(worst);
}

/// Directions, models and layers of every kind: half of them where something is sharp.
fn cases() -> impl Strategy<Value = (f64, f64, Model, f64, f64)> {
    let lon = prop_oneof![
        2 => 0.0..2.0 * PI,
        1 => -0.15..0.15_f64,
        1 => (PI - 1e-3)..(PI + 1e-3),
        1 => (-6.0..0.0_f64).prop_map(|e| 10_f64.powf(e)),
    ];
    let lat = prop_oneof![
        2 => (-1.0..1.0_f64).prop_map(f64::asin),
        1 => Just(0.0),
        1 => -0.15..0.15_f64,
        1 => (-6.0..0.0_f64).prop_map(|e| 10_f64.powf(e)),
    ];
    let pitch = prop_oneof![2 => Just((-33_f64).to_radians()), 1 => -3.5..3.5_f64];
    let k = prop_oneof![6 => Just(3.0), 1 => 0.0..6.0_f64, 1 => Just(0.0), 1 => Just(2.0), 1 => Just(1.0)];
    let scale = || (-2.0..2.0_f64).prop_map(|e| 10_f64.powf(e));
    let density = prop_oneof![
        3 => Just(Density::default()),
        1 => (scale(), scale()).prop_map(|(h_r_kpc, h_z_kpc)| Density { h_r_kpc, h_z_kpc }),
    ];
    let hole = prop_oneof![4 => Just(1.0), 1 => Just(0.0), 1 => 0.0..9.0_f64];
    let sun = prop_oneof![4 => Just(8.5), 1 => 0.01..20.0_f64];
    let layer = prop_oneof![
        3 => (0_usize..6).prop_map(|i| (edges()[i], edges()[i + 1])),
        1 => Just((0.0, 63.0)),
        1 => (0.0..25.0_f64, 1e-3..25.0_f64).prop_map(|(near, thick)| (near, near + thick)),
    ];
    (lon, lat, pitch, k, density, hole, sun, layer).prop_map(
        |(lon, lat, pitch_rad, k, density, hole_kpc, r_sun_kpc, (near, far))| {
            let spiral = Spiral {
                pitch_rad,
                hole_kpc,
                r_sun_kpc,
                ..Spiral::default()
            };
            let grains = Grains {
                k,
                ..Grains::default()
            };
            let model = Model {
                density,
                spiral,
                grains,
            };
            (lon, lat, model, near, far)
        },
    )
}

#[test]
fn adaptive_random_ratios() {
    let mut runner = TestRunner::deterministic();
    let mut worst: f64 = 0.0;
    for _ in 0..4000 {
        let (lon, lat, model, near, far) = cases().new_tree(&mut runner).unwrap().current();
        let [q, u] = one(&model, lon, lat, near, far);
        let [q_slow, u_slow] = sightline::ratios(&model, lon, lat, near, far);
        let error = (q - q_slow).abs().max((u - u_slow).abs());
        assert!(
            error <= tolerance::SIGHT.bound,
            "{error:e}: {lon} {lat} {near} {far} {model:?}"
        );
        worst = worst.max(error);
    }
    tolerance::SIGHT.hold(worst);
}

/// A uniform medium and k = 2: ∫cos 2χ ds = s − 2p atan(s/p) and ∫sin 2χ ds = p ln(s² + p²), p = R⊙ sin l.
#[test]
fn closed_form_uniform_medium() {
    let mut model = with_pitch(-0.4);
    model.density = Density {
        h_r_kpc: f64::INFINITY,
        h_z_kpc: f64::INFINITY,
    };
    model.grains.k = 2.0;
    model.spiral.hole_kpc = 0.0;
    for lon in [0.3, 1.2, 2.0, 3.0, 4.0, 5.0, 6.2] {
        for lat in [0.0, 0.02, -0.5, 1.2] {
            for (near, far) in [(0.0, 1.0), (1.0, 30.0), (7.0, 9.0)] {
                let (p, cb, sb) = (8.5 * f64::sin(lon), f64::cos(lat), f64::sin(lat));
                let s = |r: f64| r * cb - 8.5 * f64::cos(lon);
                let even = |s: f64| s - 2.0 * p * (s / p).atan();
                let odd = |s: f64| p * (s * s + p * p).ln();
                let length = s(far) - s(near);
                let cos2 = (even(s(far)) - even(s(near))) / length;
                let sin2 = (odd(s(far)) - odd(s(near))) / length;
                let (sin_2q, cos_2q) = (-0.8_f64).sin_cos();
                // cos²φ − sin²b sin²φ and 2 sin b sin φ cos φ with φ = q + χ, averaged.
                let average = cos_2q * cos2 - sin_2q * sin2;
                let q = 0.2 * 0.5 * ((1.0 - sb * sb) + (1.0 + sb * sb) * average);
                let u = 0.2 * sb * (sin_2q * cos2 + cos_2q * sin2);
                for got in [
                    one(&model, lon, lat, near, far),
                    sightline::ratios(&model, lon, lat, near, far),
                ] {
                    let error = (got[0] - q).abs().max((got[1] - u).abs());
                    assert!(
                        error < 1e-9,
                        "{lon} {lat} {near} {far}: {got:?} for {q} {u}"
                    );
                }
            }
        }
    }
}

#[test]
fn closed_form_centre_and_anticentre() {
    for pitch in [-60.0, -33.0, -11.5, -5.0, 0.0, 20.0, 90.0_f64] {
        let model = with_pitch(pitch.to_radians());
        let expected = 0.2 * pitch.to_radians().cos().abs().powi(3);
        let anti = kernel(Level::detect(), &model, &edges(), &[[-1.0, 0.0, 0.0]]);
        for layer in anti {
            assert!((layer[0][0] - expected).abs() < 1e-14 && layer[0][1] == 0.0);
        }
        // Towards the centre: before the hole, beyond it, and within.
        for (near, far, part) in [(0.0, 7.4, 1.0), (9.6, 40.0, 1.0), (7.6, 9.4, 0.0)] {
            let [q, u] = one(&model, 0.0, 0.0, near, far);
            assert!(
                (q - part * expected).abs() < 1e-14 && u == 0.0,
                "{near} {far}: {q}"
            );
        }
        // Across the hole: the part of the dust outside.
        let [q, _] = one(&model, 0.0, 0.0, 7.0, 10.0);
        let within = 2.0 * (1.0 - (-1.0 / 3.0_f64).exp());
        let all = 2.0 * (1.0 - (-1.5 / 3.0_f64).exp());
        assert!((q - expected * (all - within) / all).abs() < 1e-10);
    }
}

#[test]
fn closed_form_poles() {
    for pitch in [-33.0_f64, 10.0] {
        let model = with_pitch(pitch.to_radians());
        let (sin, cos) = (2.0 * pitch.to_radians()).sin_cos();
        // At the Sun φ = q + π; no depolarisation towards the poles, where l = 0 is taken.
        for (z, sign) in [(1.0, 1.0), (-1.0, -1.0)] {
            for layer in kernel(Level::detect(), &model, &edges(), &[[0.0, 0.0, z]]) {
                assert!((layer[0][0] - 0.2 * cos).abs() < 1e-14);
                assert!((layer[0][1] - sign * 0.2 * sin).abs() < 1e-14);
            }
        }
    }
}

#[test]
fn prop_north_and_south_mirror() {
    let mut runner = TestRunner::deterministic();
    for _ in 0..500 {
        let (lon, lat, model, near, far) = cases().new_tree(&mut runner).unwrap().current();
        let [q, u] = one(&model, lon, lat, near, far);
        let [q_south, u_south] = one(&model, lon, -lat, near, far);
        assert_eq!((q, u), (q_south, -u_south));
    }
}

#[test]
fn prop_plane_has_no_u() {
    for i in 0..200 {
        let lon = f64::from(i) * 0.0314;
        for layer in kernel(
            Level::detect(),
            &Model::default(),
            &edges(),
            &[[lon.cos(), lon.sin(), 0.0]],
        ) {
            assert_eq!(layer[0][1], 0.0);
        }
    }
}

#[test]
fn prop_strength_of_the_field_does_not_matter() {
    let model = Model::default();
    let mut other = model;
    other.spiral.b0_ug = -7.0;
    other.spiral.r0_kpc = 3.3;
    other.spiral.z0_kpc = 0.2;
    // q + π reverses the field.
    let mut reversed = model;
    reversed.spiral.pitch_rad += PI;
    let directions: Vec<_> = (0..300)
        .map(|i| direction(0.7 * f64::from(i), (f64::from(i) / 150.0 - 1.0).asin()))
        .collect();
    let expected = kernel(Level::detect(), &model, &edges(), &directions);
    assert_eq!(
        expected,
        kernel(Level::detect(), &other, &edges(), &directions)
    );
    for (e, r) in expected
        .iter()
        .zip(kernel(Level::detect(), &reversed, &edges(), &directions))
    {
        for (e, r) in e.iter().zip(r) {
            assert!((e[0] - r[0]).abs() < 1e-15 && (e[1] - r[1]).abs() < 1e-15);
        }
    }
}

/// |(Q, U)| ≤ p0 I, and Q > 0 in the plane at the default pitch: the physical sign.
#[test]
fn prop_fraction_and_sign() {
    let directions: Vec<_> = (0..5000)
        .map(|i| direction(0.618 * f64::from(i), (f64::from(i) / 2500.0 - 1.0).asin()))
        .collect();
    let mut plane = 0.0;
    for layer in kernel(Level::detect(), &Model::default(), &edges(), &directions) {
        for ([q, u], d) in layer.iter().zip(&directions) {
            assert!(q.hypot(*u) <= 0.2 * (1.0 + 1e-12));
            if d[2].abs() < 0.1 {
                assert!(*q > -0.01);
                plane += q;
            }
        }
    }
    assert!(plane > 0.0);
}

#[test]
fn levels_agree_ratios() {
    let mut runner = TestRunner::deterministic();
    let mut worst: f64 = 0.0;
    for _ in 0..400 {
        let (lon, lat, model, near, far) = cases().new_tree(&mut runner).unwrap().current();
        let d = [direction(lon, lat)];
        let best = kernel(Level::detect(), &model, &[near, far], &d)[0][0];
        for level in Level::available() {
            let got = kernel(level, &model, &[near, far], &d)[0][0];
            if level.name() == "portable" {
                worst = worst
                    .max((got[0] - best[0]).abs())
                    .max((got[1] - best[1]).abs());
            } else {
                assert_eq!(got, best, "{level}");
            }
        }
    }
    tolerance::SIGHT_PORTABLE.hold(worst);
}

/// The result of a pixel does not depend on its neighbours, nor that of a layer on other layers.
#[test]
fn prop_pixels_and_layers_are_independent() {
    let model = Model::default();
    let directions: Vec<_> = (0..17)
        .map(|i| direction(f64::from(i), 0.1 * f64::from(i) - 0.8))
        .collect();
    let all = kernel(Level::detect(), &model, &edges(), &directions);
    for (i, pair) in edges().windows(2).enumerate() {
        for (p, &d) in directions.iter().enumerate() {
            assert_eq!(kernel(Level::detect(), &model, pair, &[d])[0][0], all[i][p]);
        }
    }
    // The length of a vector does not matter.
    let long: Vec<_> = directions.iter().map(|d| d.map(|x| 4.0 * x)).collect();
    assert_eq!(kernel(Level::detect(), &model, &edges(), &long), all);
}

#[test]
fn edges_directions_not_finite() {
    let model = Model::default();
    let nan = f64::NAN;
    for d in [
        [nan, 0.0, 0.0],
        [0.0, f64::INFINITY, 0.0],
        [0.0, 0.0, f64::NEG_INFINITY],
    ] {
        let [q, u] = kernel(Level::detect(), &model, &edges(), &[d, [1.0, 0.0, 0.0]])[2][0];
        assert!(q.is_nan() && u.is_nan());
    }
    // A vector of length zero looks to l = b = 0.
    assert_eq!(
        kernel(Level::detect(), &model, &edges(), &[[0.0; 3]]),
        kernel(Level::detect(), &model, &edges(), &[[1.0, 0.0, 0.0]])
    );
    assert_eq!(
        kernel(Level::detect(), &model, &edges(), &[]),
        vec![Vec::<[f64; 2]>::new(); 6]
    );
}

/// Panels bear any layer: thick, thin, at the centre, beyond the Galaxy, with tiny and huge scales.
#[test]
fn edges_extreme_layers_are_finite() {
    for h in [1e-9, 1e-3, 1.0, 1e9, f64::INFINITY] {
        for hole in [0.0, 1e-9, 1.0, 1e5] {
            let mut model = Model::default();
            model.density = Density {
                h_r_kpc: h,
                h_z_kpc: h,
            };
            model.spiral.hole_kpc = hole;
            for k in [3.0, 0.0, 1.0] {
                model.grains.k = k;
                let edges = [0.0, 1e-300, 1e-9, 8.5 - 1e-12, 8.5, 8.5 + 1e-12, 1e3, 1e6];
                for lon in [0.0, 1e-12, 1e-4, 1.0, PI, 2.0 * PI] {
                    for lat in [0.0, 1e-300, 1e-9, 0.1, 1.0, FRAC_PI_2] {
                        for layer in kernel(Level::detect(), &model, &edges, &[direction(lon, lat)])
                        {
                            let [q, u] = layer[0];
                            assert!(
                                q.hypot(u) <= 0.2 * (1.0 + 1e-9),
                                "{h} {hole} {k} {lon} {lat}: {q} {u}"
                            );
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn errors_name_the_argument() {
    let run = |model: &Model, edges: &[f64], layers: usize, pixels: usize, scratch: usize| {
        let mut maps = vec![vec![0.0; pixels]; 2 * layers];
        let mut slices: Vec<&mut [f64]> = maps.iter_mut().map(|m| &mut m[..]).collect();
        let (q, u) = slices.split_at_mut(layers);
        ratios_into(
            Level::detect(),
            model,
            edges,
            &[[1.0, 0.0, 0.0]; 3],
            q,
            u,
            &mut vec![0.0; scratch],
        )
    };
    let (model, need) = (Model::default(), ratios_scratch_len());
    let length = |what, expected, got| {
        Err(Error::Length {
            what,
            expected,
            got,
        })
    };
    assert_eq!(run(&model, &[0.0, 1.0], 1, 3, need), Ok(()));
    assert_eq!(run(&model, &[0.0], 0, 3, need), length("edges_kpc", 2, 1));
    assert_eq!(run(&model, &[0.0, 1.0], 2, 3, need), length("q", 1, 2));
    assert_eq!(
        run(&model, &[0.0, 1.0], 1, 2, need),
        length("a layer of q or u", 3, 2)
    );
    assert_eq!(
        run(&model, &[0.0, 1.0], 1, 3, need - 1),
        length("scratch", need, need - 1)
    );
    for edges in [
        [1.0, 1.0],
        [1.0, 0.5],
        [-1.0, 1.0],
        [0.0, f64::NAN],
        [0.0, f64::INFINITY],
    ] {
        assert!(
            matches!(run(&model, &edges, 1, 3, need), Err(Error::Domain { .. })),
            "{edges:?}"
        );
    }
    let spoiled: [fn(&mut Model); 9] = [
        |m| m.density.h_r_kpc = 0.0,
        |m| m.density.h_z_kpc = f64::NAN,
        |m| m.spiral.pitch_rad = f64::INFINITY,
        |m| m.spiral.r_sun_kpc = -8.5,
        |m| m.spiral.hole_kpc = -1.0,
        |m| m.spiral.r0_kpc = 0.0,
        |m| m.spiral.z0_kpc = 0.0,
        |m| m.grains.k = -1.0,
        |m| m.grains.p0 = f64::NAN,
    ];
    for spoil in spoiled {
        let mut model = Model::default();
        spoil(&mut model);
        assert!(
            matches!(
                run(&model, &[0.0, 1.0], 1, 3, need),
                Err(Error::Domain { .. })
            ),
            "{model:?}"
        );
    }
}

#[test]
fn closed_form_density() {
    let density = Density::default();
    for (r, z) in [(0.0, 0.0), (8.5, 0.0), (3.0, 0.1), (20.0, -0.35)] {
        let expected = f64::exp(-r / 3.0) / f64::cosh(z / 0.1).powi(2);
        assert!((density.value(r, z) / expected - 1.0).abs() < 4e-15);
    }
    // Far above the plane, where n itself is zero: −R/h_R + 2 ln 2 − 2|z|/h_z.
    let far = -8.5 / 3.0 + 2.0 * std::f64::consts::LN_2 - 1200.0;
    assert!((density.ln(8.5, 60.0) - far).abs() < 1e-12);
    assert_eq!(density.value(8.5, 60.0), 0.0);
}

#[test]
fn closed_form_spiral() {
    let spiral = Spiral::default();
    // At the Sun the field points to l = 90° + q = 57°, or the opposite way.
    let [bx, by, bz] = spiral.field_ug([-8.5, 0.0, 0.0]);
    let lon = by.atan2(bx).to_degrees();
    assert!((lon.rem_euclid(180.0) - 57.0).abs() < 1e-12 && bz == 0.0);
    let phase = (8.5_f64 / 10.55).ln() / spiral.pitch_rad.tan();
    assert!((bx.hypot(by) - 3.0 * (PI + phase).cos().abs()).abs() < 1e-14);
    // Trailing arms: a field line is at larger R where θ is smaller, for clockwise rotation (θ falls with time).
    let [ex, ey, _] = spiral.direction([0.0, 8.5, 0.0]);
    assert!(ey * ex < 0.0);
    for (i, &r) in [0.3, 0.999, 1.0, 1.001, 3.9, 4.1, 20.0].iter().enumerate() {
        let theta = f64::from(u8::try_from(i).unwrap());
        let (x, y, z) = (r * f64::cos(theta), r * f64::sin(theta), 0.5);
        let amplitude = 3.0 * 8.5 / f64::max(x.hypot(y), 4.0);
        let winding = f64::ln(r / 10.55) / spiral.pitch_rad.tan();
        let b = -amplitude * f64::cos(theta + winding) * f64::exp(-0.5);
        let b = if x.hypot(y) > 1.0 { b } else { 0.0 };
        let (sin_q, cos_q) = spiral.pitch_rad.sin_cos();
        let expected = [
            b * (sin_q * theta.cos() + cos_q * theta.sin()),
            b * (sin_q * theta.sin() - cos_q * theta.cos()),
            0.0,
        ];
        let got = spiral.field_ug([x, y, z]);
        for k in 0..3 {
            assert!(
                (got[k] - expected[k]).abs() < 1e-13,
                "{r}: {got:?} for {expected:?}"
            );
        }
        assert_eq!(got, spiral.field_ug([x, y, -z]));
        let [ex, ey, ez] = spiral.direction([x, y, z]);
        assert!((ex.hypot(ey) - 1.0).abs() < 1e-15 && ez == 0.0);
    }
}

/// Where the cosine vanishes the field does, but not its direction.
#[test]
fn spiral_direction_at_zeros_of_the_cosine() {
    let spiral = Spiral {
        r0_kpc: 8.5,
        ..Spiral::default()
    };
    let at = [0.0, 8.5, 0.0];
    assert!(spiral.strength_ug(at).abs() < 1e-15);
    let (sin_q, cos_q) = spiral.pitch_rad.sin_cos();
    let expected = [cos_q, sin_q, 0.0];
    for (got, e) in spiral.direction(at).iter().zip(expected) {
        assert!((got - e).abs() < 1e-15);
    }
    // On the axis, and for circular field lines, everything is finite.
    let round = Spiral {
        pitch_rad: 0.0,
        ..spiral
    };
    for s in [spiral, round] {
        for p in [[0.0; 3], [2.0, -3.0, 0.1]] {
            assert!(
                s.field_ug(p)
                    .iter()
                    .chain(&s.direction(p))
                    .all(|x| x.is_finite())
            );
        }
    }
}
