//! The pitch-angle objective, its scan and refinement.

use dust3d_kernels::Error;
use dust3d_kernels::field::Model;
use dust3d_kernels::field::line_of_sight::{ratios_into, ratios_scratch_len};
use dust3d_kernels::fit::l1::{objective, scan_add, scan_scratch_len};
use dust3d_kernels::fit::search::{bracket, golden_section, least};
use dust3d_kernels::simd::Level;

const EDGES: [f64; 4] = [0.0, 0.25, 2.0, 30.0];
const LAYERS: usize = EDGES.len() - 1;

/// Directions above 15° of latitude, with an intensity per layer.
fn sky(n: usize) -> (Vec<[f64; 3]>, Vec<Vec<f64>>) {
    let directions: Vec<_> = (0..n)
        .map(|i| {
            let z = 0.26 + 0.74 * (i as f64 + 0.5) / n as f64;
            let z = if i % 2 == 0 { z } else { -z };
            let (s, c) = (2.4 * i as f64).sin_cos();
            let across = (1.0 - z * z).sqrt();
            [across * c, across * s, z]
        })
        .collect();
    let intensity = (0..LAYERS)
        .map(|l| {
            directions
                .iter()
                .map(|d| (1.5 + d[l]) / (1.0 + d[2].abs()))
                .collect()
        })
        .collect();
    (directions, intensity)
}

/// Model Q, U summed over layers, by the ratios themselves.
fn model_sums(model: &Model, directions: &[[f64; 3]], intensity: &[Vec<f64>]) -> [Vec<f64>; 2] {
    let n = directions.len();
    let mut maps = vec![vec![0.0; n]; 2 * LAYERS];
    let mut slices: Vec<&mut [f64]> = maps.iter_mut().map(|m| &mut m[..]).collect();
    let (q, u) = slices.split_at_mut(LAYERS);
    let mut scratch = vec![f64::NAN; ratios_scratch_len()];
    ratios_into(
        Level::detect(),
        model,
        &EDGES,
        directions,
        q,
        u,
        &mut scratch,
    )
    .unwrap();
    [0, LAYERS].map(|from| {
        (0..n)
            .map(|p| {
                (0..LAYERS)
                    .map(|l| maps[from + l][p] * intensity[l][p])
                    .sum()
            })
            .collect()
    })
}

fn scan(
    level: Level,
    model: &Model,
    directions: &[[f64; 3]],
    intensity: &[Vec<f64>],
    [q, u]: [&[f64]; 2],
    pitches: &[f64],
) -> Vec<f64> {
    let slices: Vec<&[f64]> = intensity.iter().map(|i| &i[..]).collect();
    let mut sums = vec![0.0; pitches.len()];
    let mut scratch = vec![f64::NAN; scan_scratch_len(pitches.len())];
    scan_add(
        level,
        model,
        &EDGES,
        directions,
        &slices,
        q,
        u,
        pitches,
        &mut sums,
        &mut scratch,
    )
    .unwrap();
    sums
}

fn degrees(range: std::ops::RangeInclusive<i32>) -> Vec<f64> {
    range.map(|q| f64::from(q).to_radians()).collect()
}

#[test]
fn naive_scan_is_the_objective_of_the_ratios() {
    let (directions, intensity) = sky(150);
    let observed: Vec<Vec<f64>> = (0..2)
        .map(|k| directions.iter().map(|d| 0.1 * d[k] * d[2]).collect())
        .collect();
    let pitches = degrees(-60..=-5);
    // The last exponent is evaluated angle by angle near the plane; the directions here all share nodes.
    for k in [3.0, 2.0, 1.3] {
        let mut model = Model::default();
        model.grains.k = k;
        let sums = scan(
            Level::detect(),
            &model,
            &directions,
            &intensity,
            [&observed[0], &observed[1]],
            &pitches,
        );
        for (&pitch, sum) in pitches.iter().zip(sums) {
            model.spiral.pitch_rad = pitch;
            let [q, u] = model_sums(&model, &directions, &intensity);
            let expected = objective(&q, &u, &observed[0], &observed[1]).unwrap();
            assert!((sum / expected - 1.0).abs() < 1e-12, "{sum} for {expected}");
        }
    }
}

/// Near the plane, with an exponent that needs nodes of its own for every angle.
#[test]
fn naive_scan_sharp_exponent_in_the_plane() {
    let (_, intensity) = sky(40);
    let directions: Vec<_> = (0..40)
        .map(|i| {
            let lon = 0.157 * f64::from(i);
            [lon.cos(), lon.sin(), 0.01 * f64::from(i % 3)]
        })
        .collect();
    let zero = vec![0.0; 40];
    let mut model = Model::default();
    model.grains.k = 0.7;
    let pitches = degrees(-35..=-31);
    let sums = scan(
        Level::detect(),
        &model,
        &directions,
        &intensity,
        [&zero, &zero],
        &pitches,
    );
    for (&pitch, sum) in pitches.iter().zip(sums) {
        model.spiral.pitch_rad = pitch;
        let [q, u] = model_sums(&model, &directions, &intensity);
        let expected = objective(&q, &u, &zero, &zero).unwrap();
        assert!((sum / expected - 1.0).abs() < 1e-12, "{sum} for {expected}");
    }
}

#[test]
fn round_trip_pitch_is_recovered() {
    let (directions, intensity) = sky(300);
    for truth in [-57.3, -33.0, -11.52, -5.4_f64] {
        let mut model = Model::default();
        model.spiral.pitch_rad = truth.to_radians();
        let [q, u] = model_sums(&model, &directions, &intensity);
        let g = |pitches: &[f64]| {
            scan(
                Level::detect(),
                &model,
                &directions,
                &intensity,
                [&q, &u],
                pitches,
            )
        };
        let x: Vec<f64> = (-60..=-5).map(f64::from).collect();
        let values = g(&degrees(-60..=-5));
        let [low, high] = bracket(&x, &values).unwrap();
        assert!(low <= truth && truth <= high);
        let found = golden_section(|deg| g(&[deg.to_radians()])[0], low, high, 0.0005);
        assert!((found.x - truth).abs() < 0.001, "{found:?} for {truth}");
        assert!(found.value < 1e-3 * values[0]);
    }
}

/// G(q) has no steps: its second differences shrink with the square of the spacing.
#[test]
fn prop_objective_is_smooth() {
    let (directions, intensity) = sky(200);
    // Observations so far off that no term changes sign: G is then smooth, not only continuous.
    let far = vec![100.0; 200];
    let largest = |step: f64| {
        let pitches: Vec<f64> = (0..100).map(|i| -0.58 + step * f64::from(i)).collect();
        let g = scan(
            Level::detect(),
            &Model::default(),
            &directions,
            &intensity,
            [&far, &far],
            &pitches,
        );
        g.windows(3)
            .map(|w| (w[0] - 2.0 * w[1] + w[2]).abs())
            .fold(0.0, f64::max)
    };
    let (wide, narrow) = (largest(1e-3), largest(1e-4));
    assert!(narrow < 0.02 * wide, "{narrow:e} {wide:e}");
}

#[test]
fn levels_agree_scan_and_chunks() {
    let (directions, intensity) = sky(100);
    let q: Vec<f64> = directions.iter().map(|d| 0.05 * d[0]).collect();
    let u: Vec<f64> = directions.iter().map(|d| 0.05 * d[1]).collect();
    let pitches = degrees(-40..=-30);
    let model = Model::default();
    let best = scan(
        Level::detect(),
        &model,
        &directions,
        &intensity,
        [&q, &u],
        &pitches,
    );
    for level in Level::available() {
        let got = scan(level, &model, &directions, &intensity, [&q, &u], &pitches);
        for (g, b) in got.iter().zip(&best) {
            if level.name() == "portable" {
                assert!((g / b - 1.0).abs() < 1e-13);
            } else {
                assert_eq!(g, b, "{level}");
            }
        }
    }
    // The same angle alone or among others, the same sky in two pieces added in order: the same bits.
    for (&pitch, b) in pitches.iter().zip(&best) {
        assert_eq!(
            scan(
                Level::detect(),
                &model,
                &directions,
                &intensity,
                [&q, &u],
                &[pitch]
            ),
            [*b]
        );
    }
    let slices: Vec<&[f64]> = intensity.iter().map(|i| &i[..]).collect();
    let mut sums = vec![0.0; pitches.len()];
    let mut scratch = vec![f64::NAN; scan_scratch_len(pitches.len())];
    for range in [0..37, 37..100] {
        let part: Vec<&[f64]> = slices.iter().map(|i| &i[range.clone()]).collect();
        scan_add(
            Level::detect(),
            &model,
            &EDGES,
            &directions[range.clone()],
            &part,
            &q[range.clone()],
            &u[range],
            &pitches,
            &mut sums,
            &mut scratch,
        )
        .unwrap();
    }
    assert_eq!(sums, best);
}

#[test]
fn edges_scan_empty_layers_and_missing() {
    let (directions, mut intensity) = sky(10);
    let ones = vec![1.0; 10];
    for layer in &mut intensity {
        layer.fill(0.0);
    }
    let sums = scan(
        Level::detect(),
        &Model::default(),
        &directions,
        &intensity,
        [&ones, &ones],
        &[-0.5, -0.6],
    );
    assert_eq!(sums, [20.0, 20.0]);
    let mut hole = ones.clone();
    hole[3] = f64::NAN;
    let sums = scan(
        Level::detect(),
        &Model::default(),
        &directions,
        &intensity,
        [&hole, &ones],
        &[-0.5],
    );
    assert!(sums[0].is_nan());
    assert!(
        scan(
            Level::detect(),
            &Model::default(),
            &directions,
            &intensity,
            [&ones, &ones],
            &[]
        )
        .is_empty()
    );
}

#[test]
fn naive_objective() {
    assert_eq!(
        objective(&[1.0, 2.0], &[0.0, -1.0], &[0.5, 3.0], &[0.25, 1.0]),
        Ok(3.75)
    );
    assert_eq!(objective(&[], &[], &[], &[]), Ok(0.0));
    assert!(matches!(
        objective(&[1.0], &[], &[1.0], &[1.0]),
        Err(Error::Length {
            what: "u_model",
            ..
        })
    ));
}

#[test]
fn edges_least_and_bracket() {
    let nan = f64::NAN;
    assert_eq!(least(&[]), None);
    assert_eq!(least(&[nan, nan]), None);
    assert_eq!(least(&[nan, 2.0, 1.0, 1.0, nan]), Some(2));
    assert_eq!(least(&[f64::INFINITY]), Some(0));
    let x = [0.0, 1.0, 2.0, 3.0];
    assert_eq!(bracket(&x, &[3.0, 1.0, 2.0, 4.0]), Some([0.0, 2.0]));
    assert_eq!(bracket(&x, &[1.0, 3.0, 2.0, 4.0]), Some([0.0, 1.0]));
    assert_eq!(bracket(&x, &[4.0, 3.0, 2.0, 1.0]), Some([2.0, 3.0]));
    assert_eq!(bracket(&[5.0], &[1.0]), Some([5.0, 5.0]));
    assert_eq!(bracket(&x, &[1.0]), None);
    assert_eq!(bracket(&[], &[]), None);
}

#[test]
fn edges_golden_section() {
    // Inside, at either end, reversed, in a point, flat, never a number.
    let inside = golden_section(|x| (x - 0.7).powi(2), 0.0, 2.0, 1e-5);
    assert!((inside.x - 0.7).abs() <= 1e-5 && inside.tolerance <= 1e-5);
    assert_eq!(inside.value, (inside.x - 0.7).powi(2));
    assert_eq!(golden_section(|x| x, -5.0, 3.0, 1e-6).x, -5.0);
    assert_eq!(golden_section(|x| -x, -5.0, 3.0, 1e-6).x, 3.0);
    assert!((golden_section(|x| (x - 1.0).abs(), 3.0, -5.0, 1e-6).x - 1.0).abs() <= 1e-6);
    let point = golden_section(|x| x, 2.0, 2.0, 1e-6);
    assert_eq!((point.x, point.evaluations), (2.0, 1));
    assert_eq!(golden_section(|_| 1.0, 0.0, 1.0, 1e-3).value, 1.0);
    let never = golden_section(|_| f64::NAN, 0.0, 1.0, 1e-3);
    assert!((0.0..=1.0).contains(&never.x));
    let holes = golden_section(
        |x| if x < 0.5 { f64::NAN } else { (x - 0.75).abs() },
        0.0,
        1.0,
        1e-4,
    );
    assert!((holes.x - 0.75).abs() < 1e-3);
    // No tolerance at all still ends.
    let forever = golden_section(|x| (x - 0.3).abs(), 0.0, 1.0, 0.0);
    assert!(forever.evaluations <= 200 && (forever.x - 0.3).abs() < 1e-12);
    // From 2° to 0.01° in a dozen evaluations.
    assert!(golden_section(|x| (x + 33.0).abs(), -34.0, -32.0, 0.005).evaluations <= 16);
}

#[test]
fn errors_scan_lengths() {
    let (directions, intensity) = sky(3);
    let slices: Vec<&[f64]> = intensity.iter().map(|i| &i[..]).collect();
    let maps = [0.0; 3];
    let need = scan_scratch_len(1);
    let run = |layers: &[&[f64]], q: &[f64], u: &[f64], sums: usize, scratch: usize| {
        let (mut sums, mut scratch) = (vec![7.0; sums], vec![0.0; scratch]);
        let result = scan_add(
            Level::detect(),
            &Model::default(),
            &EDGES,
            &directions,
            layers,
            q,
            u,
            &[-0.5],
            &mut sums,
            &mut scratch,
        );
        assert!(result.is_ok() || sums.iter().all(|&s| s == 7.0));
        result
    };
    let length = |what, expected, got| {
        Err(Error::Length {
            what,
            expected,
            got,
        })
    };
    assert_eq!(run(&slices, &maps, &maps, 1, need), Ok(()));
    assert_eq!(
        run(&slices[1..], &maps, &maps, 1, need),
        length("intensity", 3, 2)
    );
    assert_eq!(
        run(&[&maps, &maps, &maps[1..]], &maps, &maps, 1, need),
        length("a layer of intensity", 3, 2)
    );
    assert_eq!(
        run(&slices, &maps[1..], &maps, 1, need),
        length("q_obs", 3, 2)
    );
    assert_eq!(
        run(&slices, &maps, &maps[1..], 1, need),
        length("u_obs", 3, 2)
    );
    assert_eq!(run(&slices, &maps, &maps, 2, need), length("sums", 1, 2));
    assert_eq!(
        run(&slices, &maps, &maps, 1, need - 1),
        length("scratch", need, need - 1)
    );
}
