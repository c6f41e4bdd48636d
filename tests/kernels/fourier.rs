//! Fourier transforms of eight sequences at once.

use dust3d_kernels::Complex;
use dust3d_kernels::fourier::{Eight, Fourier};
use dust3d_kernels::sht::Aligned;
use dust3d_kernels::simd::Level;
use dust3d_tests::random::Random;
use dust3d_tests::tolerance;

/// All radices, single passes, one and several of each, primes times powers.
const LENGTHS: [usize; 27] = [
    1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 16, 27, 30, 36, 49, 64, 81, 100, 128, 180, 256, 343, 1050,
    1024, 2160, 4096,
];

fn levels() -> Vec<Level> {
    ["portable", "avx2", "avx512"]
        .into_iter()
        .filter_map(Level::by_name)
        .collect()
}

fn pseudo_random(n: usize) -> Vec<Eight> {
    let mut random = Random(7);
    let mut next = || 0.5 * random.next();
    (0..n)
        .map(|_| {
            let mut x = Eight::default();
            x.as_flattened_mut().fill_with(&mut next);
            x
        })
        .collect()
}

struct Ready {
    fourier: Fourier,
    table: Vec<[f64; 2]>,
    scratch: Vec<Eight>,
}

fn ready(n: usize) -> Ready {
    let fourier = Fourier::new(n).expect("smooth");
    assert_eq!(fourier.len(), n);
    let mut table = vec![[f64::NAN; 2]; fourier.table_len()];
    fourier.fill_table(&mut table);
    Ready {
        fourier,
        table,
        scratch: vec![Aligned([[f64::NAN; 8]; 2]); fourier.scratch_len()],
    }
}

/// Direct sums, both directions and both orders, on harmonics spread over the range.
#[test]
fn naive_lengths_fourier() {
    let mut worst: f64 = 0.0;
    for n in LENGTHS {
        let mut r = ready(n);
        let x = pseudo_random(n);
        for level in levels() {
            for (sign, ordered) in [(-1.0, false), (1.0, false), (-1.0, true), (1.0, true)] {
                // what comes in order and what at its position
                let input_at = |j: usize| if ordered { r.fourier.position(j) } else { j };
                let output_at = |k: usize| if ordered { k } else { r.fourier.position(k) };
                let mut data = x.clone();
                for (j, x) in x.iter().enumerate() {
                    data[input_at(j)] = *x;
                }
                match (sign < 0.0, ordered) {
                    (true, false) => r
                        .fourier
                        .forward(level, &r.table, &mut data, &mut r.scratch),
                    (true, true) => {
                        r.fourier
                            .forward_ordered(level, &r.table, &mut data, &mut r.scratch)
                    }
                    (false, false) => {
                        r.fourier
                            .backward_ordered(level, &r.table, &mut data, &mut r.scratch)
                    }
                    (false, true) => r
                        .fourier
                        .backward(level, &r.table, &mut data, &mut r.scratch),
                }
                .expect("lengths");
                let (mut error, mut size) = (0.0, 0.0);
                for k in (0..n).step_by(1 + n / 16) {
                    for lane in [0, 5] {
                        let (mut sum, mut lost) = (Complex::new(0.0, 0.0), Complex::new(0.0, 0.0));
                        for (j, x) in x.iter().enumerate() {
                            let angle =
                                sign * std::f64::consts::TAU * (j * k % n) as f64 / n as f64;
                            let term = Complex::new(x[0][lane], x[1][lane])
                                * Complex::new(angle.cos(), angle.sin())
                                - lost;
                            // Kahan: the reference would be worse than what it judges
                            let next = sum + term;
                            lost = (next - sum) - term;
                            sum = next;
                        }
                        let z = &data[output_at(k)];
                        error += (Complex::new(z[0][lane], z[1][lane]) - sum).norm_sqr();
                        size += sum.norm_sqr();
                    }
                }
                worst = worst.max((error / size).sqrt());
            }
        }
    }
    tolerance::FOURIER.hold(worst);
}

/// AVX2 and AVX-512 to the bit; harmonics at distinct places; lanes do not touch each other.
#[test]
fn levels_agree_fourier() {
    for n in LENGTHS {
        let mut r = ready(n);
        let mut places: Vec<_> = (0..n).map(|k| r.fourier.position(k)).collect();
        places.sort_unstable();
        assert!(places.into_iter().eq(0..n));
        let x = pseudo_random(n);
        let mut results = vec![];
        for level in levels().into_iter().filter(|l| l.name() != "portable") {
            let mut data = x.clone();
            r.fourier
                .forward(level, &r.table, &mut data, &mut r.scratch)
                .expect("lengths");
            results.push(data);
        }
        assert!(results.windows(2).all(|w| w[0] == w[1]), "{n}");
        let mut alone = x.clone();
        for x in &mut alone {
            for part in &mut x.0 {
                part[..3].fill(0.0);
                part[4..].fill(1e300);
            }
        }
        if let (Some(all), Some(level)) = (results.last(), levels().last()) {
            r.fourier
                .forward(*level, &r.table, &mut alone, &mut r.scratch)
                .expect("lengths");
            assert!(
                alone
                    .iter()
                    .zip(all)
                    .all(|(a, b)| a[0][3] == b[0][3] && a[1][3] == b[1][3])
            );
        }
    }
}

/// Lengths out of reach, slices of wrong length, the next good length.
#[test]
fn edge_lengths_fourier() {
    assert!(
        [0, 11, 17, 2 * 13, 1 << 33]
            .iter()
            .all(|&n| Fourier::new(n).is_none())
    );
    for (least, good) in [
        (0, 2),
        (3, 4),
        (15, 16),
        (17, 18),
        (1025, 1050),
        (4097, 4116),
        (21, 24),
    ] {
        assert_eq!(Fourier::good_length(least), good);
        assert!(Fourier::new(good).is_some());
        let quick = Fourier::quick_length(least);
        assert!(quick >= good && (quick == good || quick <= least + least / 16));
        let work = |n| Fourier::new(n).map(|f| f.work());
        assert!(work(quick) <= work(good), "{least}");
    }
    let mut r = ready(12);
    let level = Level::detect();
    let mut data = pseudo_random(12);
    assert!(
        r.fourier
            .forward(level, &r.table, &mut data[..11], &mut r.scratch)
            .is_err()
    );
    assert!(
        r.fourier
            .forward(level, &r.table[1..], &mut data, &mut r.scratch)
            .is_err()
    );
    assert!(
        r.fourier
            .forward(level, &r.table, &mut data, &mut r.scratch[1..])
            .is_err()
    );
}
