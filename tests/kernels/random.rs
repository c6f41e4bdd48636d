//! Random streams and normal deviates.

use dust3d_kernels::random::Stream;
use dust3d_kernels::random::normal::{from_word, normals_before, white_alm_into, white_order_into};
use dust3d_kernels::{Complex, Error};
use dust3d_tests::{reference, tolerance};

/// Words have more digits than a double: they are read as integers.
fn words(line: &str) -> Vec<u64> {
    line.split_whitespace()
        .map(|x| x.parse().unwrap())
        .collect()
}

fn lines(table: &str) -> impl Iterator<Item = &str> {
    table.lines().filter(|line| !line.starts_with('#'))
}

/// The first words of streams; the jumps of the table come from powers of the generator's bit matrix.
#[test]
fn matrix_table_streams() {
    let mut count = 0;
    for line in lines(include_str!("../data/random/streams.txt")) {
        let row = words(line);
        let small = |i: usize| u32::try_from(row[i]).unwrap();
        let mut stream = Stream::new(row[0], small(1), small(2), small(3)).unwrap();
        for &word in &row[4..] {
            assert_eq!(stream.word(), word, "{line}");
            count += 1;
        }
    }
    assert_eq!(count, 36);
}

/// The generator itself, from state (1, 2, 3, 4): the first outputs of Blackman & Vigna's C program.
#[test]
fn authors_first_ten_words() {
    let mut stream = Stream::from_state([1, 2, 3, 4]);
    for expected in [
        41943041,
        58720359,
        3588806011781223,
        3591011842654386,
        9228616714210784205,
        9973669472204895162,
        14011001112246962877,
        12406186145184390807,
        15849039046786891736,
        10450023813501588000,
    ] {
        assert_eq!(stream.word(), expected);
    }
}

#[test]
fn mp_table_normals() {
    let mut worst: f64 = 0.0;
    let mut count = 0;
    for line in lines(include_str!("../data/random/normal.txt")) {
        let mut columns = line.split_whitespace();
        let word: u64 = columns.next().unwrap().parse().unwrap();
        let value: f64 = columns.next().unwrap().parse().unwrap();
        let rest: f64 = columns.next().unwrap().parse().unwrap();
        worst = worst.max(reference::ulps(from_word(word), value, rest));
        assert_eq!(from_word(!word), -from_word(word));
        count += 1;
    }
    assert!(count > 400);
    tolerance::NORMAL.hold(worst);
}

/// The deviates are part of the meaning of a seed: these bits may never change.
#[test]
fn bits_of_the_first_normals() {
    let mut stream = Stream::new(1, 1, 2, 0).unwrap();
    let mut normals = [0.0; 6];
    stream.fill_normals(&mut normals);
    assert_eq!(normals.map(f64::to_bits), FIRST_NORMALS);
}
const FIRST_NORMALS: [u64; 6] = [
    13831175801833168658,
    13834083987494654722,
    13832748391663096319,
    13828212941364290918,
    4604441565540004459,
    13832993495199830273,
];

#[test]
fn prop_normals_increase_with_the_word() {
    let mut before = from_word(1 << 63);
    assert!((-9.2..-9.1).contains(&before));
    for step in 1..4096_u64 {
        let z = from_word((1_u64 << 63).wrapping_add(step << 52));
        assert!(z > before, "{step}");
        before = z;
    }
    // Across the seams of the three formulae.
    for centre in [0.425, 0.5 - 1.388_794_386_496_402e-11] {
        let seam = (centre * 18_446_744_073_709_551_616.0) as u64;
        for k in 0..2000 {
            let (low, high) = (
                from_word(seam - 1_000_000 + 1000 * k),
                from_word(seam - 999_000 + 1000 * k),
            );
            assert!(low <= high + 4.0 * f64::EPSILON * high, "{low} {high}");
        }
    }
    assert!((9.1..9.2).contains(&from_word(i64::MAX as u64)));
}

#[test]
fn prop_moments_and_distribution() {
    const N: usize = 400_000;
    let mut stream = Stream::new(20, 1, 3, 2).unwrap();
    let mut z = vec![0.0; N];
    stream.fill_normals(&mut z);
    let moment = |k: i32| z.iter().map(|x| x.powi(k)).sum::<f64>() / N as f64;
    let root = (N as f64).sqrt();
    // Means of z^k and their standard errors √(var z^k / N).
    for (k, mean, variance) in [
        (1, 0.0, 1.0),
        (2, 1.0, 2.0),
        (3, 0.0, 15.0),
        (4, 3.0, 96.0),
        (6, 15.0, 10_170.0),
    ] {
        let off = (moment(k) - mean) * root / f64::sqrt(variance);
        assert!(
            off.abs() < 4.0,
            "moment {k} is off by {off} standard errors"
        );
    }
    // Kolmogorov–Smirnov against the error function of the same tail words: uniform u of the inverse.
    z.sort_by(f64::total_cmp);
    let mut distance: f64 = 0.0;
    for (i, &x) in z.iter().enumerate() {
        let cdf = 0.5 * erfc(-x * std::f64::consts::FRAC_1_SQRT_2);
        distance = distance.max((cdf - i as f64 / N as f64).abs());
    }
    assert!(distance * root < 1.95, "KS {}", distance * root);
    // Serial correlation.
    let mut stream = Stream::new(20, 1, 3, 2).unwrap();
    stream.fill_normals(&mut z);
    for lag in 1..6 {
        let c: f64 = z.iter().zip(&z[lag..]).map(|(a, b)| a * b).sum::<f64>() / root;
        assert!(c.abs() < 4.5, "lag {lag}: {c}");
    }
}

/// erfc by its continued fraction or series: only for the distribution test (1e-10).
fn erfc(x: f64) -> f64 {
    if x < 0.0 {
        return 2.0 - erfc(-x);
    }
    if x < 2.5 {
        let (mut term, mut sum) = (x, x);
        for n in 1..80 {
            let n = f64::from(n);
            term *= -x * x / n;
            sum += term / (2.0 * n + 1.0);
        }
        return 1.0 - 2.0 / std::f64::consts::PI.sqrt() * sum;
    }
    let mut fraction = 0.0;
    for n in (1..60).rev() {
        fraction = 0.5 * f64::from(n) / (x + fraction);
    }
    (-x * x).exp() / std::f64::consts::PI.sqrt() / (x + fraction)
}

#[test]
fn prop_streams_are_independent() {
    const N: usize = 20_000;
    let mut streams = Vec::new();
    for seed in [1, 2] {
        for stage in 0..2 {
            for layer in 0..3 {
                for field in 0..3 {
                    let mut z = vec![0.0; N];
                    Stream::new(seed, stage, layer, field)
                        .unwrap()
                        .fill_normals(&mut z);
                    streams.push(z);
                }
            }
        }
    }
    let root = (N as f64).sqrt();
    for (i, a) in streams.iter().enumerate() {
        for b in &streams[..i] {
            let c = a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / root;
            assert!(c.abs() < 5.0, "{c}");
        }
    }
}

#[test]
fn prop_uniform_is_inside_the_unit_interval() {
    let mut stream = Stream::new(3, 0, 0, 0).unwrap();
    let mut mean = 0.0;
    for _ in 0..100_000 {
        let u = stream.uniform();
        assert!(u > 0.0 && u < 1.0);
        mean += u / 100_000.0;
    }
    assert!((mean - 0.5).abs() < 4.0 * (1.0_f64 / 12.0 / 100_000.0).sqrt());
}

/// Coefficients up to some l are the same whatever lmax is, and follow the documented order of draws.
#[test]
fn prop_white_alm_do_not_know_lmax() {
    let alm = |lmax: usize| {
        let mut alm = vec![Complex::new(0.0, 0.0); (lmax + 1) * (lmax + 2) / 2];
        white_alm_into(&mut Stream::new(5, 1, 1, 1).unwrap(), lmax, &mut alm).unwrap();
        alm
    };
    let at = |lmax: usize, l: usize, m: usize| m * (2 * lmax + 1 - m) / 2 + l;
    let small = alm(17);
    for lmax in [18, 40, 100] {
        let large = alm(lmax);
        for l in 0..=17 {
            for m in 0..=l {
                assert_eq!(large[at(lmax, l, m)], small[at(17, l, m)]);
            }
        }
    }
    let mut normals = vec![0.0; 18 * 19];
    Stream::new(5, 1, 1, 1).unwrap().fill_normals(&mut normals);
    for l in 0..=17 {
        for m in 0..=l {
            let k = usize::try_from(normals_before(l as u64, m as u64)).unwrap();
            let a = small[at(17, l, m)];
            if m == 0 {
                assert_eq!((a.re, a.im), (normals[k], 0.0));
            } else {
                let half = std::f64::consts::FRAC_1_SQRT_2;
                assert_eq!((a.re, a.im), (half * normals[k], half * normals[k + 1]));
            }
        }
    }
    // Unit spectrum.
    let lmax = 300;
    let large = alm(lmax);
    let mut power = 0.0;
    for l in 0..=lmax {
        for m in 0..=l {
            power += large[at(lmax, l, m)].norm_sqr() * if m == 0 { 1.0 } else { 2.0 };
        }
    }
    let modes = ((lmax + 1) * (lmax + 1)) as f64;
    assert!((power / modes - 1.0).abs() < 4.0 * (2.0 / modes).sqrt());
}

/// Orders made one by one, from the words of the stream, are those of the whole.
#[test]
fn naive_orders_white_alm() {
    let lmax = 23;
    let len = (lmax + 1) * (lmax + 2) / 2;
    let mut whole = vec![Complex::new(0.0, 0.0); len];
    white_alm_into(&mut Stream::new(9, 2, 4, 1).unwrap(), lmax, &mut whole).unwrap();
    let mut stream = Stream::new(9, 2, 4, 1).unwrap();
    let words: Vec<u64> = (0..2 * len).map(|_| stream.word()).collect();
    let mut start = 0;
    for m in 0..=lmax {
        let mut order = vec![Complex::new(9.0, 9.0); lmax + 1 - m];
        white_order_into(&words, lmax, m, &mut order).unwrap();
        assert_eq!(order, whole[start..start + order.len()]);
        start += order.len();
        assert!(white_order_into(&words[1..], lmax, m, &mut order).is_err());
        order.push(Complex::new(0.0, 0.0));
        assert!(white_order_into(&words, lmax, m, &mut order).is_err());
    }
    assert!(white_order_into(&words, lmax, lmax + 1, &mut []).is_ok());
    assert!(white_order_into(&words, usize::MAX, 0, &mut []).is_err());
}

#[test]
fn errors_numbers_out_of_range() {
    for (stage, layer, field) in [
        (256, 0, 0),
        (0, 65_536, 0),
        (0, 0, 16),
        (u32::MAX, u32::MAX, u32::MAX),
    ] {
        assert!(matches!(
            Stream::new(1, stage, layer, field),
            Err(Error::Domain { .. })
        ));
    }
    let mut alm = vec![Complex::new(0.0, 0.0); 5];
    let mut stream = Stream::new(1, 0, 0, 0).unwrap();
    let before = stream.clone();
    assert!(white_alm_into(&mut stream, 2, &mut alm).is_err());
    assert!(white_alm_into(&mut stream, usize::MAX, &mut alm).is_err());
    assert_eq!(stream, before);
}
