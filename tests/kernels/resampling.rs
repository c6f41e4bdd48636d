//! Equidistant rings to those of a map: trigonometric series by direct sums, transpose, lengths.

use dust3d_kernels::Complex;
use dust3d_kernels::fourier::{Eight, Fourier};
use dust3d_kernels::sht::*;
use dust3d_kernels::simd::Level;
use dust3d_tests::random::Random;
use dust3d_tests::tolerance;

struct Ready {
    lmax: usize,
    coarse: (Fourier, Vec<[f64; 2]>),
    fine: (Fourier, Vec<[f64; 2]>),
    factors: Vec<[f64; 2]>,
    carriers: Vec<Carrier>,
    taps: Vec<RingTaps>,
    scratch: Vec<Eight>,
}

impl Ready {
    fn new(nside: u64, lmax: usize) -> Self {
        let (n, m) = resampling_lengths(lmax);
        let transform = |n| {
            let fourier = Fourier::new(n).unwrap();
            let mut table = vec![[0.0; 2]; fourier.table_len()];
            fourier.fill_table(&mut table);
            (fourier, table)
        };
        let (coarse, fine) = (transform(n), transform(m));
        let mut factors = vec![[0.0; 2]; lmax + 1];
        resampling_factors(lmax, (n, m), &mut factors);
        let mut carriers = vec![Carrier::default(); n.div_ceil(16)];
        equidistant_carriers(n, &mut carriers);
        let mut taps = vec![RingTaps::default(); ring_block_count(nside)];
        ring_taps(nside, lmax, m, &mut taps).unwrap();
        let scratch = coarse.0.scratch_len().max(fine.0.scratch_len());
        Self {
            lmax,
            coarse,
            fine,
            factors,
            carriers,
            taps,
            scratch: vec![Eight::default(); scratch],
        }
    }

    fn resampling(&self) -> Resampling<'_> {
        Resampling {
            lmax: self.lmax,
            coarse: &self.coarse.0,
            coarse_table: &self.coarse.1,
            fine: &self.fine.0,
            fine_table: &self.fine.1,
            factors: &self.factors,
        }
    }

    /// Phases (orders, equidistant blocks) → (blocks of the map, orders).
    fn apply(&mut self, level: Level, phases: &[PhaseBlock], stores: Stores) -> Vec<PhaseBlock> {
        let mut coarse = vec![Eight::default(); self.coarse.0.len()];
        let mut fine = vec![Aligned([[f64::NAN; 8]; 2]); self.fine.0.len() + 2 * MARGIN];
        let blocks = self.carriers.len();
        grid_from_phases(level, phases, blocks, &self.carriers, &mut coarse).unwrap();
        let mut scratch = std::mem::take(&mut self.scratch);
        self.resampling()
            .refine(level, &mut coarse, &mut fine, &mut scratch)
            .unwrap();
        self.scratch = scratch;
        let mut out = vec![PhaseBlock::default(); ORDERS * self.taps.len()];
        phases_from_fine(level, &fine, &self.taps, &mut out, stores).unwrap();
        out
    }

    fn transpose(&mut self, level: Level, phases: &[PhaseBlock]) -> Vec<PhaseBlock> {
        let mut coarse = vec![Aligned([[f64::NAN; 8]; 2]); self.coarse.0.len()];
        let mut fine = vec![Eight::default(); self.fine.0.len() + 2 * MARGIN];
        for (tile, taps) in phases.chunks_exact(ORDERS).zip(&self.taps) {
            add_to_fine(level, tile, &[], taps, &mut fine).unwrap();
        }
        let mut scratch = std::mem::take(&mut self.scratch);
        self.resampling()
            .coarsen(level, &mut fine, &mut coarse, &mut scratch)
            .unwrap();
        self.scratch = scratch;
        let blocks = self.carriers.len();
        let mut out = vec![PhaseBlock::default(); ORDERS * blocks];
        phases_from_grid(level, &coarse, &self.carriers, &mut out, blocks).unwrap();
        out
    }
}

/// HEALPix colatitude of a ring pair.
fn colatitude(nside: u64, pair: u64) -> f64 {
    let (i, n) = (pair as f64 + 1.0, nside as f64);
    let u = if i < n {
        i * i / (6.0 * n * n)
    } else {
        (2.0 * i - n) / (6.0 * n)
    };
    2.0 * u.sqrt().asin()
}

/// Σ_k c_k cos kθ for even orders, Σ_k c_k sin kθ for odd ones.
fn series(order: usize, c: &[Complex<f64>], theta: f64) -> Complex<f64> {
    c.iter()
        .enumerate()
        .map(|(k, c)| {
            let x = k as f64 * theta;
            c * if order.is_multiple_of(2) {
                x.cos()
            } else {
                x.sin()
            }
        })
        .sum()
}

fn write(to: &mut PhaseBlock, lane: usize, north: Complex<f64>, south: Complex<f64>) {
    to[0][lane] = north.re;
    to[1][lane] = north.im;
    to[2][lane] = south.re;
    to[3][lane] = south.im;
}

const SIZES: [(u64, usize); 8] = [
    (1, 3),
    (4, 5),
    (4, 60),
    (5, 8),
    (16, 20),
    (16, 33),
    (64, 100),
    (64, 300),
];

#[test]
fn naive_series_resampling() {
    let pi = std::f64::consts::PI;
    let mut worst: f64 = 0.0;
    for (nside, lmax) in SIZES {
        let mut ready = Ready::new(nside, lmax);
        let mut random = Random(lmax as u64);
        let c: Vec<Vec<_>> = (0..ORDERS)
            .map(|_| {
                (0..=lmax)
                    .map(|_| Complex::new(random.next(), random.next()))
                    .collect()
            })
            .collect();
        let n = ready.coarse.0.len();
        let blocks = ready.carriers.len();
        let mut phases = vec![Aligned([[f64::NAN; 8]; 4]); ORDERS * blocks];
        for (order, c) in c.iter().enumerate() {
            for j in 0..8 * blocks {
                let theta = (j.min(n / 2 - 1) as f64 + 0.5) * pi / n as f64;
                write(
                    &mut phases[order * blocks + j / 8],
                    j % 8,
                    series(order, c, theta),
                    series(order, c, pi - theta),
                );
            }
        }
        let truth_norm = ((lmax + 1) as f64 / 3.0).sqrt();
        for level in ["portable", "avx2", "avx512"]
            .into_iter()
            .filter_map(Level::by_name)
        {
            let out = ready.apply(level, &phases, Stores::Cached);
            let streamed = ready.apply(level, &phases, Stores::Streamed);
            assert_eq!(out, streamed, "{nside} {lmax} {level}");
            let (mut error, mut count) = (0.0, 0.0);
            for pair in 0..2 * nside {
                let theta = colatitude(nside, pair);
                for (order, c) in c.iter().enumerate() {
                    let mut want = PhaseBlock::default();
                    write(
                        &mut want,
                        0,
                        series(order, c, theta),
                        series(order, c, pi - theta),
                    );
                    let got = &out[ORDERS * (pair / 8) as usize + order];
                    for part in 0..4 {
                        let d = got[part][(pair % 8) as usize] - want[part][0];
                        error += d * d;
                        count += 0.5;
                    }
                }
            }
            worst = worst.max((error / count).sqrt() / truth_norm);
        }
    }
    tolerance::RESAMPLING.hold(worst);
}

#[test]
fn adjoint_sizes_resampling() {
    for (nside, lmax) in SIZES {
        let mut ready = Ready::new(nside, lmax);
        let mut random = Random(3);
        let n = ready.coarse.0.len();
        let fill =
            |blocks: usize, pairs: usize, place: &dyn Fn(usize, usize) -> usize, r: &mut Random| {
                let mut out = vec![PhaseBlock::default(); ORDERS * blocks];
                for order in 0..ORDERS {
                    for j in 0..pairs {
                        for part in 0..4 {
                            out[place(order, j / 8)][part][j % 8] = r.next();
                        }
                    }
                }
                out
            };
        let (coarse_blocks, blocks) = (ready.carriers.len(), ready.taps.len());
        let x = fill(
            coarse_blocks,
            n / 2,
            &|o, b| o * coarse_blocks + b,
            &mut random,
        );
        let y = fill(
            blocks,
            2 * nside as usize,
            &|o, b| b * ORDERS + o,
            &mut random,
        );
        let dot = |a: &[PhaseBlock], b: &[PhaseBlock]| -> f64 {
            a.iter()
                .zip(b)
                .flat_map(|(a, b)| a.as_flattened().iter().zip(b.as_flattened()))
                .map(|(a, b)| a * b)
                .sum()
        };
        let mut bits = vec![];
        for name in ["portable", "avx2", "avx512"] {
            let Some(level) = Level::by_name(name) else {
                continue;
            };
            let (ax, aty) = (
                ready.apply(level, &x, Stores::Cached),
                ready.transpose(level, &y),
            );
            let size = (dot(&ax, &ax) * dot(&y, &y)).sqrt();
            let off = (dot(&ax, &y) - dot(&x, &aty)) / size;
            assert!(off.abs() < 2e-15, "{nside} {lmax} {name}: {off}");
            if name != "portable" {
                bits.push((ax, aty));
            }
        }
        assert!(bits.windows(2).all(|w| w[0] == w[1]));
    }
}

#[test]
fn edge_lengths_resampling() {
    let ready = Ready::new(4, 10);
    let level = Level::detect();
    let phases = vec![PhaseBlock::default(); 7];
    let mut grid = vec![Eight::default(); 12];
    let (carriers, step) = (&ready.carriers, ready.carriers.len());
    assert!(grid_from_phases(level, &phases, step, carriers, &mut grid).is_err());
    let mut out = vec![PhaseBlock::default(); 7];
    assert!(phases_from_grid(level, &grid, carriers, &mut out, step).is_err());
    assert!(phases_from_fine(level, &grid, &ready.taps, &mut out, Stores::Cached).is_err());
    assert!(add_to_fine(level, &phases, &[], &ready.taps[0], &mut grid).is_err());
    let mut scratch = vec![Eight::default(); 64];
    let mut fine = vec![Eight::default(); ready.fine.0.len()];
    let mut coarse = vec![Eight::default(); ready.coarse.0.len()];
    let resampling = ready.resampling();
    assert!(
        resampling
            .refine(level, &mut coarse, &mut fine, &mut scratch)
            .is_err()
    );
    assert!(
        resampling
            .coarsen(level, &mut fine, &mut coarse, &mut scratch)
            .is_err()
    );
    let mut taps = vec![RingTaps::default(); 2];
    assert!(ring_taps(4, 10, 100, &mut taps).is_err());
    assert!(ring_taps(0, 10, 100, &mut taps).is_err());
    let mut rings = vec![RingBlock::default(); 1];
    assert!(equidistant_ring_blocks(5, 3, &mut rings).is_err());
    assert!(equidistant_ring_blocks(18, 3, &mut rings).is_err());
    equidistant_ring_blocks(16, 3, &mut rings).unwrap();
    // θ = π/32: cos θ and 1/sin²θ
    let theta = std::f64::consts::PI / 32.0;
    assert!((rings[0].cos[0] - theta.cos()).abs() < 1e-15);
    assert!((rings[0].inv_sin2[0] * theta.sin().powi(2) - 1.0).abs() < 1e-15);
}
