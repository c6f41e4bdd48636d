//! F_m on eight rings of equal length to their pixels: direct sums, transpose, levels, ways of writing.

use crate::cap::{direct, levels, on_ring, product};
use dust3d_kernels::fourier::{Eight, Fourier};
use dust3d_kernels::sht::*;
use dust3d_kernels::simd::Level;
use dust3d_tests::random::Random;
use dust3d_tests::tolerance;

/// Eight ring pairs of n pixels, every other one shifted; beside the equator the last has no southern partner.
struct Belt {
    fourier: Fourier,
    table: Vec<[f64; 2]>,
    orders: usize,
    shapes: RingShapes,
    phases: Vec<PhaseTable>,
    equator: bool,
}

impl Belt {
    fn new(n: usize, orders: usize, equator: bool) -> Self {
        let fourier = Fourier::new(n).unwrap();
        let mut table = vec![[0.0; 2]; fourier.table_len()];
        fourier.fill_table(&mut table);
        let shapes = RingShapes {
            pixels: [n; 8],
            shifted: std::array::from_fn(|k| k % 2 == 0),
        };
        let mut phases = vec![PhaseTable::default(); phase_table_len(orders - 1)];
        phase_table(&shapes, &mut phases);
        Self {
            fourier,
            table,
            orders,
            shapes,
            phases,
            equator,
        }
    }

    fn pixels(&self) -> [usize; 2] {
        let n = self.fourier.len();
        [8 * n, if self.equator { 7 * n } else { 8 * n }]
    }

    fn buffers(&self) -> (Vec<Eight>, Vec<Eight>) {
        let unset = Aligned([[f64::NAN; 8]; 2]);
        (
            vec![unset; self.fourier.len()],
            vec![unset; self.fourier.scratch_len()],
        )
    }

    fn synthesis(&self, level: Level, tiles: &[PhaseTile]) -> [Vec<f64>; 2] {
        let places: Vec<usize> = (0..tiles.len()).collect();
        let (mut data, mut scratch) = self.buffers();
        let from = (&places[..], self.orders);
        belt_spectrum_from_phases(level, tiles, from, &self.phases, &self.fourier, &mut data)
            .unwrap();
        self.fourier
            .backward(level, &self.table, &mut data, &mut scratch)
            .unwrap();
        let [mut north, mut south] = self.pixels().map(|n| vec![f64::NAN; n]);
        pixels_from_belt(level, &data, &mut north, &mut south).unwrap();
        [north, south]
    }

    fn adjoint(
        &self,
        level: Level,
        [north, south]: &[Vec<f64>; 2],
        stores: Stores,
    ) -> Vec<PhaseTile> {
        let (mut data, mut scratch) = self.buffers();
        belt_from_pixels(level, north, south, &mut data).unwrap();
        self.fourier
            .forward(level, &self.table, &mut data, &mut scratch)
            .unwrap();
        let mut tiles = vec![[Aligned([[f64::NAN; 8]; 4]); ORDERS]; self.orders.div_ceil(ORDERS)];
        phases_from_belt_spectrum(
            level,
            &data,
            &self.fourier,
            &[1.0; 8],
            &self.phases,
            (&mut tiles.iter_mut().collect::<Vec<_>>(), self.orders),
            stores,
        )
        .unwrap();
        tiles
    }

    /// F_0 real, and nothing on the ring that is not there.
    fn random(&self, seed: u64) -> Vec<PhaseTile> {
        let mut random = Random(seed);
        let mut tiles = vec![[PhaseBlock::default(); ORDERS]; self.orders.div_ceil(ORDERS)];
        for (m, block) in tiles.as_flattened_mut()[..self.orders]
            .iter_mut()
            .enumerate()
        {
            for (part, lanes) in block.0.iter_mut().enumerate() {
                if m > 0 || part % 2 == 0 {
                    lanes.fill_with(|| random.next());
                }
                if self.equator && part >= 2 {
                    lanes[7] = 0.0;
                }
            }
        }
        tiles
    }

    /// Where a ring lies: southern ones in the opposite order.
    fn start(&self, hemisphere: usize, ring: usize) -> Option<usize> {
        let n = self.fourier.len();
        match hemisphere {
            0 => Some(ring * n),
            _ => self.pixels()[1].checked_sub((ring + 1) * n),
        }
    }
}

/// Fewer orders than half the pixels, as many, more than all (aliasing); with and without the equator.
fn belts() -> Vec<Belt> {
    vec![
        Belt::new(4, 1, true),
        Belt::new(4, 9, true),
        Belt::new(64, 33, false),
        Belt::new(64, 20, true),
        Belt::new(128, 150, true),
        Belt::new(60, 200, false),
    ]
}

#[test]
fn naive_rings_belt() {
    let mut worst: f64 = 0.0;
    for belt in belts() {
        let tiles = belt.random(3);
        for level in levels() {
            let (mut error, mut square) = (0.0, 0.0);
            for (hemisphere, pixels) in belt.synthesis(level, &tiles).iter().enumerate() {
                for ring in 0..8 {
                    let Some(start) = belt.start(hemisphere, ring) else {
                        continue;
                    };
                    let f = on_ring(&tiles, belt.orders, hemisphere, ring);
                    let n = belt.fourier.len();
                    for j in 0..n {
                        let want = direct(&f, belt.shapes.shifted[ring], n, j);
                        error += (pixels[start + j] - want).powi(2);
                        square += want * want;
                    }
                }
            }
            worst = worst.max((error / square).sqrt());
        }
    }
    tolerance::BELT.hold(worst);
}

#[test]
fn adjoint_rings_belt() {
    for belt in belts() {
        let mut random = Random(7);
        let tiles = belt.random(2);
        let maps = belt.pixels().map(|n| random.map(n));
        for level in levels() {
            let image = belt.synthesis(level, &tiles);
            let pairs = || maps.iter().flatten().zip(image.iter().flatten());
            let left: f64 = pairs().map(|(a, b)| a * b).sum();
            let back = belt.adjoint(level, &maps, Stores::Cached);
            let right = product(&tiles, &back, belt.orders, |_| true);
            let size: f64 = pairs().map(|(_, b)| b * b).sum();
            assert!(
                (left - right).abs() < 1e-13 * (size * maps[0].len() as f64).sqrt(),
                "{} {level}: {left} {right}",
                belt.fourier.len()
            );
        }
    }
}

#[test]
fn bits_equal_stores_levels_belt() {
    for belt in belts() {
        let maps = belt.synthesis(Level::detect(), &belt.random(4));
        let mut fused = None;
        for level in levels() {
            let tiles = belt.adjoint(level, &maps, Stores::Cached);
            let streamed = belt.adjoint(level, &maps, Stores::Streamed);
            assert_eq!(tiles, streamed, "{level}");
            if level.name() != "portable" {
                assert_eq!(*fused.get_or_insert_with(|| tiles.clone()), tiles);
            }
        }
    }
}
