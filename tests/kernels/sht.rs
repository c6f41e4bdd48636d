//! Tests of the Legendre stage: against 50 and more digits, level against level, transpose, scratch.

use dust3d_kernels::Complex;
use dust3d_kernels::sht::*;
use dust3d_kernels::simd::Level;
use dust3d_tests::random::Random;
use dust3d_tests::reference::rows;
use dust3d_tests::tolerance;

/// Tables of one order.
struct Order {
    m: usize,
    epsilon: Vec<f64>,
    steps: Vec<Step>,
    norm: f64,
    wigner: Vec<WignerStep>,
    wigner_norm: [f64; 2],
    factors: Vec<f64>,
    /// Where, and how, synthesis writes.
    index: PhaseIndex<'static>,
}

impl Order {
    fn new(lmax: usize, m: usize) -> Self {
        let mut epsilon = vec![0.0; epsilon_len(lmax, m)];
        epsilon_table(m, &mut epsilon);
        let mut steps = vec![[0.0; 4]; step_count(lmax, m)];
        step_table(&epsilon, &mut steps).unwrap();
        let mut norms = vec![0.0; m + 1];
        start_norms(&mut norms);
        let mut wigner = vec![[0.0; 4]; wigner_step_count(lmax, m)];
        wigner_step_table(m, &epsilon, &mut wigner);
        let mut spin_norms = vec![[0.0; 2]; m + 1];
        wigner_norms(&mut spin_norms);
        let scale = wigner.first().map_or(1.0, |s| s[3]);
        let mut factors = vec![f64::NAN; spin_factor_len(lmax)];
        spin_factor_table(&mut factors);
        Self {
            m,
            norm: norms[m] / steps[0][3],
            wigner_norm: spin_norms[m].map(|n| n / scale),
            epsilon,
            steps,
            wigner,
            factors,
            index: PhaseIndex::default(),
        }
    }

    /// F_m of `alm` (l = m …) on rings.
    fn scalar(&self, level: Level, rings: &[RingBlock], alm: &[Complex<f64>]) -> Vec<PhaseBlock> {
        let mut c = vec![[f64::NAN; 4]; self.steps.len()];
        scalar_coefficients(level, alm, &self.epsilon, &self.steps, 1, 0, &mut c);
        let mut out = vec![PhaseBlock::default(); rings.len()];
        synthesis(
            level,
            rings,
            self.m,
            self.norm,
            &self.steps,
            1,
            &c,
            self.index,
            &mut out,
        )
        .unwrap();
        out
    }

    /// F_m of Q sin²θ, U sin²θ by the shared recurrence.
    fn pair(
        &self,
        level: Level,
        rings: &[RingBlock],
        e: &[Complex<f64>],
        b: &[Complex<f64>],
    ) -> Vec<PhaseBlock> {
        let mut c = vec![[f64::NAN; 4]; 2 * self.steps.len()];
        let (degrees, padded) = mixing_scratch_len(e.len());
        let mut degrees = vec![Complex::new(f64::NAN, 1.0); degrees];
        let mut padded = vec![f64::NAN; padded];
        spin2_coefficients(
            level,
            self.m,
            e,
            b,
            &self.factors,
            &self.epsilon,
            &self.steps,
            2,
            0,
            &mut c,
            &mut degrees,
            &mut padded,
        );
        let mut out = vec![PhaseBlock::default(); 2 * rings.len()];
        synthesis(
            level,
            rings,
            self.m,
            self.norm,
            &self.steps,
            2,
            &c,
            self.index,
            &mut out,
        )
        .unwrap();
        out
    }

    /// F_m of Q and U by the spin-weighted functions.
    fn polar_pair(
        &self,
        level: Level,
        rings: &[RingBlock],
        e: &[Complex<f64>],
        b: &[Complex<f64>],
    ) -> Vec<PhaseBlock> {
        let mut c = vec![[f64::NAN; 4]; self.wigner.len()];
        wigner_coefficients(self.m, e, b, &self.wigner, &mut c);
        let mut out = vec![PhaseBlock::default(); 2 * rings.len()];
        wigner_synthesis(
            level,
            rings,
            self.m,
            self.wigner_norm,
            &self.wigner,
            &c,
            self.index,
            &mut out,
        )
        .unwrap();
        out
    }
}

fn unit(len: usize, at: usize) -> Vec<Complex<f64>> {
    let mut a = vec![Complex::default(); len];
    a[at] = Complex::new(1.0, 0.0);
    a
}

fn pseudo_random(len: usize, seed: u64) -> Vec<Complex<f64>> {
    let mut random = Random(seed);
    (0..len)
        .map(|_| Complex::new(random.next(), random.next()))
        .collect()
}

/// λ_lm, X1, X2 at l to 8192 and colatitudes to 1e-11, relative to √((2l+1)/4π), which they never exceed by much.
#[test]
fn mp_points_legendre() {
    let table = include_str!("../data/sht/legendre.txt");
    // nearer to the pole than 0.01, and elsewhere
    let (mut scalar, mut polar) = ([0.0f64; 2], [0.0f64; 2]);
    let mut main = 0.0f64;
    for row in rows(table) {
        let (l, m, theta) = (row[0] as usize, row[1] as usize, row[2]);
        let order = Order::new(l, m);
        let ring = [RingBlock::from_colatitudes(&[theta; 8], l).unwrap()];
        let one = unit(l - m + 1, l - m);
        let none = vec![Complex::default(); l - m + 1];
        let zone = usize::from(theta > 0.01);
        let scale = ((2 * l + 1) as f64 / (4.0 * std::f64::consts::PI)).sqrt();
        for level in Level::available() {
            let south = if (l - m) % 2 == 0 { 1.0 } else { -1.0 };
            let f = order.scalar(level, &ring, &one)[0];
            if ring[0].m_limit >= m {
                scalar[zone] = scalar[zone]
                    .max((f[0][3] - row[3]).abs() / scale)
                    .max((f[2][5] - south * row[3]).abs() / scale);
            } else {
                assert!(row[3].abs() < 1e-18, "polar limit at {l} {m} {theta}");
            }
            if l < 2 {
                continue;
            }
            // Q of E is −X1, U of E is i X2
            let error = |got: &[PhaseBlock], sin2: f64| {
                ((got[0][0][1] / sin2 + row[4]).abs())
                    .max((got[1][1][6] / sin2 - row[5]).abs())
                    .max((got[0][2][1] / sin2 + south * row[4]).abs())
                    .max((got[1][3][0] / sin2 + south * row[5]).abs())
                    / scale
            };
            if ring[0].m_limit >= m {
                polar[zone] =
                    polar[zone].max(error(&order.polar_pair(level, &ring, &one, &none), 1.0));
                if ring[0].sin2_min > 0.0008 {
                    let f = order.pair(level, &ring, &one, &none);
                    main = main.max(error(&f, 1.0 / ring[0].inv_sin2[0]));
                }
            }
        }
    }
    tolerance::SHT_LEGENDRE_POLE.hold(scalar[0]);
    tolerance::SHT_LEGENDRE.hold(scalar[1]);
    tolerance::SHT_WIGNER_POLE.hold(polar[0]);
    tolerance::SHT_WIGNER.hold(polar[1]);
    tolerance::SHT_SHARED_RECURRENCE.hold(main);
}

/// AVX2 and AVX-512 give the same bits, whatever blocking each prefers.
#[test]
fn levels_agree_legendre() {
    let nside = 32;
    let mut rings = vec![RingBlock::default(); ring_block_count(nside)];
    for lmax in [5, 63, 127] {
        ring_blocks(nside, lmax, &mut rings).unwrap();
        for m in [0, 1, 2, 5, 40, 63, 127].into_iter().filter(|&m| m <= lmax) {
            let mut order = Order::new(lmax, m);
            let e = pseudo_random(lmax - m + 1, 3);
            let b = pseudo_random(lmax - m + 1, 4);
            let run = |order: &Order, level| {
                let mut all = order.scalar(level, &rings, &e);
                all.extend(order.pair(level, &rings, &e, &b));
                all.extend(order.polar_pair(level, &rings, &e, &b));
                all
            };
            let portable = run(&order, Level::portable());
            let fused: Vec<_> = ["avx2", "avx512"]
                .iter()
                .filter_map(|n| Level::by_name(n))
                .map(|level| run(&order, level))
                .collect();
            order.index.stores = Stores::Streamed;
            for level in Level::available() {
                let streamed = run(&order, level);
                let cached = if level == Level::portable() {
                    &portable
                } else {
                    &fused[0]
                };
                assert_eq!(&streamed, cached, "lmax {lmax} m {m} {level}");
            }
            for f in &fused {
                assert_eq!(f, &fused[0], "lmax {lmax} m {m}");
                for (x, y) in f.iter().zip(&portable) {
                    for (x, y) in x.iter().flatten().zip(y.iter().flatten()) {
                        assert!((x - y).abs() < 1e-11, "{x} {y}");
                    }
                }
            }
        }
    }
}

/// Sums → degrees is the transpose of degrees → coefficients, whatever was there before; added, it gives the bits of
/// the sum. AVX2 = AVX-512.
#[test]
fn prop_written_added_mixing() {
    const CHANNELS: usize = 3;
    let inner = |a: &[Complex<f64>], b: &[Complex<f64>]| -> f64 {
        a.iter()
            .zip(b)
            .map(|(a, b)| a.re * b.re + a.im * b.im)
            .sum()
    };
    for lmax in [0, 1, 2, 5, 12, 37] {
        for m in [0, 1, 2, 3, lmax / 2, lmax - lmax.min(1), lmax] {
            if m > lmax {
                continue;
            }
            let order = Order::new(lmax, m);
            let (n, count) = (order.steps.len(), lmax - m + 1);
            let random = pseudo_random(2 * CHANNELS * n, 5);
            let sums: Vec<Coefficient> = random
                .as_chunks::<2>()
                .0
                .iter()
                .map(|[a, b]| [a.re, a.im, b.re, b.im])
                .collect();
            let from = [6, 7, 8].map(|seed| pseudo_random(count, seed));
            let (degrees_len, padded_len) = mixing_scratch_len(count);
            let mut fused: Vec<[Vec<Complex<f64>>; 3]> = Vec::new();
            for level in Level::available() {
                let back = |add: bool, start: [Vec<Complex<f64>>; 3]| {
                    let [mut t, mut e, mut b] = start;
                    scalar_from_sums(
                        level,
                        &sums,
                        &order.epsilon,
                        &order.steps,
                        CHANNELS,
                        0,
                        add,
                        &mut t,
                    );
                    spin2_from_sums(
                        level,
                        m,
                        &sums,
                        &order.factors,
                        &order.epsilon,
                        &order.steps,
                        CHANNELS,
                        1,
                        add,
                        &mut e,
                        &mut b,
                        &mut vec![f64::NAN; padded_len],
                    );
                    [t, e, b]
                };
                let nan = Complex::new(f64::NAN, f64::NAN);
                let written = back(false, [0, 1, 2].map(|_| vec![nan; count]));
                let added = back(true, from.clone());
                for ((written, added), from) in written.iter().zip(&added).zip(&from) {
                    for ((w, a), f) in written.iter().zip(added).zip(from) {
                        assert_eq!(f + w, *a, "lmax {lmax} m {m} {level}");
                    }
                }
                let mut c = vec![[0.0; 4]; CHANNELS * n];
                let (epsilon, steps) = (&order.epsilon, &order.steps);
                scalar_coefficients(level, &from[0], epsilon, steps, CHANNELS, 0, &mut c);
                spin2_coefficients(
                    level,
                    m,
                    &from[1],
                    &from[2],
                    &order.factors,
                    epsilon,
                    steps,
                    CHANNELS,
                    1,
                    &mut c,
                    &mut vec![nan; degrees_len],
                    &mut vec![f64::NAN; padded_len],
                );
                let pairs = c.as_flattened().iter().zip(sums.as_flattened());
                let (forth, size) = pairs.fold((0.0, 0.0), |(sum, size): (f64, f64), (x, y)| {
                    (sum + x * y, size + (x * y).abs())
                });
                let other: f64 = from.iter().zip(&written).map(|(a, b)| inner(a, b)).sum();
                assert!(
                    (forth - other).abs() <= 1e-13 * size,
                    "lmax {lmax} m {m}: {forth} {other}"
                );
                if level.name() != "portable" {
                    fused.push(written);
                }
            }
            for f in &fused {
                assert_eq!(f, &fused[0], "lmax {lmax} m {m}");
            }
        }
    }
}

/// ⟨Y a, f⟩ = ⟨a, Yᵀ f⟩ for one order, up to three channels, with garbage in the scratch; on few rings, and on more
/// than are taken at once, with rings that join in late or never. AVX2 = AVX-512.
#[test]
fn adjoint_order_legendre() {
    adjoint_orders(16, 37, &[0, 1, 2, 17, 37]);
    adjoint_orders(512, 301, &[0, 3, 120, 290]);
}

fn adjoint_orders(nside: u64, lmax: usize, orders: &[usize]) {
    let mut rings = vec![RingBlock::default(); ring_block_count(nside)];
    ring_blocks(nside, lmax, &mut rings).unwrap();
    for &m in orders {
        let order = Order::new(lmax, m);
        for channels in 1..=3 {
            let mut bits: Vec<(&str, Vec<Coefficient>)> = Vec::new();
            for level in Level::available() {
                let count = channels * order.steps.len();
                let from = pseudo_random(2 * count, 7);
                let c: Vec<Coefficient> = from
                    .as_chunks::<2>()
                    .0
                    .iter()
                    .map(|[a, b]| [a.re, a.im, b.re, b.im])
                    .collect();
                let mut y = vec![PhaseBlock::default(); channels * rings.len()];
                synthesis(
                    level,
                    &rings,
                    m,
                    order.norm,
                    &order.steps,
                    channels,
                    &c,
                    PhaseIndex::default(),
                    &mut y,
                )
                .unwrap();
                let f: Vec<PhaseBlock> = pseudo_random(16 * y.len(), 8)
                    .as_chunks::<16>()
                    .0
                    .iter()
                    .map(|x| {
                        Aligned([0, 1, 2, 3].map(|k| {
                            [0, 1, 2, 3, 4, 5, 6, 7].map(|j| {
                                let z = x[2 * k + j / 4 + if j % 4 < 2 { 0 } else { 8 }];
                                if j % 2 == 0 { z.re } else { z.im }
                            })
                        }))
                    })
                    .collect();
                let active = |k: usize| rings[k % rings.len()].m_limit >= m;
                let product: f64 = y
                    .iter()
                    .zip(&f)
                    .enumerate()
                    .filter(|(k, _)| active(*k))
                    .flat_map(|(_, (y, f))| y.iter().flatten().zip(f.iter().flatten()))
                    .map(|(y, f)| y * f)
                    .sum();
                let run = |fill: f64| {
                    let mut back = vec![[fill; 4]; count];
                    let mut scratch = vec![
                        Aligned([[fill; 8]]);
                        adjoint_scratch_len(order.steps.len(), channels)
                    ];
                    adjoint(
                        level,
                        &rings,
                        m,
                        order.norm,
                        &order.steps,
                        channels,
                        PhaseIndex::default(),
                        &f,
                        &mut back,
                        &mut scratch,
                    )
                    .unwrap();
                    back
                };
                let back = run(0.0);
                assert_eq!(back, run(f64::NAN), "garbage in scratch shows");
                let other: f64 = c
                    .iter()
                    .flatten()
                    .zip(back.iter().flatten())
                    .map(|(a, b)| a * b)
                    .sum();
                let size = |x: f64, y: f64| x + y * y;
                let norm = y
                    .iter()
                    .flat_map(|b| b.iter().flatten())
                    .fold(0.0, |s, &x| size(s, x))
                    .sqrt()
                    * f.iter()
                        .flat_map(|b| b.iter().flatten())
                        .fold(0.0, |s, &x| size(s, x))
                        .sqrt();
                assert!(
                    (product - other).abs() <= 1e-13 * norm,
                    "m {m}: {product} {other}"
                );
                bits.push((level.name(), back));
            }
            let of = |name: &str| bits.iter().find(|b| b.0 == name).map(|b| &b.1);
            if let (Some(a), Some(b)) = (of("avx2"), of("avx512")) {
                assert!(a == b, "Nside {nside}, m {m}, {channels} channels");
            }
        }
    }
}

/// Wrong lengths and colatitudes are refused.
#[test]
fn edge_lengths_legendre() {
    let level = Level::portable();
    let rings = [RingBlock::default(); 2];
    let steps = [[1.0; 4]; 3];
    let c = [[0.0; 4]; 3];
    let mut out = [PhaseBlock::default(); 2];
    let one = PhaseIndex::default();
    assert!(synthesis(level, &rings, 0, 1.0, &steps, 1, &c, one, &mut out[..1]).is_err());
    assert!(synthesis(level, &rings, 0, 1.0, &steps[..2], 1, &c, one, &mut out).is_err());
    assert!(synthesis(level, &rings, 0, 1.0, &steps, 2, &c, one, &mut out).is_err());
    assert!(synthesis(level, &rings, 0, 1.0, &steps, 0, &[], one, &mut []).is_ok());
    let beyond = PhaseIndex {
        places: Some(&[0, 2]),
        ..one
    };
    assert!(synthesis(level, &rings, 0, 1.0, &steps, 1, &c, beyond, &mut out).is_err());
    assert!(RingBlock::from_colatitudes(&[0.0; 8], 4).is_err());
    assert!(RingBlock::from_colatitudes(&[1.6; 8], 4).is_err());
    assert!(RingBlock::from_colatitudes(&[f64::NAN; 8], 4).is_err());
    assert!(ring_blocks(0, 4, &mut []).is_err());
}

/// Sample rings of every Nside: sizes and places in closed form.
#[test]
fn closed_form_rings() {
    for order in 0..=13 {
        let nside = 1u64 << order;
        let mut next = 0;
        for pair in 0..2 * nside {
            let (north, south, n, shifted) = healpix_ring(nside, pair);
            assert_eq!(north, next);
            assert_eq!(south, 12 * nside * nside - north - n);
            assert_eq!(n, 4 * (pair + 1).min(nside));
            assert!(shifted || pair >= nside);
            next += n;
        }
        let mut rings = vec![RingBlock::default(); ring_block_count(nside)];
        ring_blocks(nside, 2 * nside as usize, &mut rings).unwrap();
        let pair = (2 * nside - 1) as usize;
        assert_eq!(rings[pair / 8].cos[pair % 8], 0.0, "the equator");
        let first = &rings[0];
        let u = 1.0 / (6.0 * (nside * nside) as f64);
        assert!((first.minus_versine[0] + 2.0 * u).abs() <= 1e-15 * u);
        assert!((1.0 / first.inv_sin2[0] - 4.0 * u * (1.0 - u)).abs() <= 1e-15 * u);
    }
}
