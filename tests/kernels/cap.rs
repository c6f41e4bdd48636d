//! F_m on rings of any length to their pixels: direct sums, transpose, levels, maps alone and together.

use dust3d_kernels::Complex;
use dust3d_kernels::fourier::{Eight, Fourier};
use dust3d_kernels::sht::*;
use dust3d_kernels::simd::Level;
use dust3d_tests::random::Random;
use dust3d_tests::tolerance;

type Alm = Complex<f64>;

/// A length, its table, and one over the transform of the window.
struct Length {
    fourier: Fourier,
    table: Vec<[f64; 2]>,
    factors: Vec<f64>,
}

/// Eight ring pairs of 4 · quarter pixels.
struct Block {
    quarters: [usize; 8],
    orders: usize,
    shapes: RingShapes,
    table: Vec<PhaseTable>,
    lengths: Vec<Option<Length>>,
    window: CapWindow,
}

/// North and south of each map.
type Maps = [[Vec<f64>; 2]; CAP_MAPS];

impl Block {
    fn new(quarters: [usize; 8], orders: usize) -> Self {
        let shapes = RingShapes {
            pixels: quarters.map(|q| 4 * q),
            shifted: [true, true, false, true, true, false, true, true],
        };
        let mut table = vec![PhaseTable::default(); phase_table_len(orders - 1)];
        phase_table(&shapes, &mut table);
        let lengths = quarters.map(|quarter| {
            (quarter > 0).then(|| {
                let n = cap_length(quarter, orders);
                let fourier = Fourier::new(n).unwrap();
                let mut table = vec![[0.0; 2]; fourier.table_len()];
                fourier.fill_table(&mut table);
                let mut factors = vec![0.0; if n == quarter { 0 } else { n / 2 + 1 }];
                cap_factors(n, &mut factors);
                Length {
                    fourier,
                    table,
                    factors,
                }
            })
        });
        Self {
            quarters,
            orders,
            shapes,
            table,
            lengths: lengths.into(),
            window: CapWindow::new(),
        }
    }

    fn rings(&self) -> CapRings<'_> {
        std::array::from_fn(|k| {
            let length = self.lengths[k].as_ref()?;
            Some(CapRing {
                quarter: self.quarters[k],
                fourier: &length.fourier,
                factors: &length.factors,
            })
        })
    }

    /// Pixels of the northern rings before each one, and of all.
    fn start(&self, ring: usize) -> usize {
        self.shapes.pixels[..ring].iter().sum()
    }

    /// F_m, (maps, orders/8) → maps; where `maps` is one, the second is not there.
    fn synthesis(&self, level: Level, maps: usize, tiles: &[PhaseTile]) -> Maps {
        let rings = self.rings();
        let each = self.orders.div_ceil(ORDERS);
        let places: Vec<usize> = (0..maps * each).collect();
        let (first, second) = places.split_at(each);
        let mut data = vec![Aligned([[f64::NAN; 8]; 2]); cap_room(&rings)];
        let which = ([first, second], self.orders);
        cap_spectrum_from_phases(level, tiles, which, &self.table, &rings, &mut data).unwrap();
        let len = self.start(8);
        let mut out: Maps = std::array::from_fn(|k| {
            std::array::from_fn(|_| vec![f64::NAN; if k < maps { len } else { 0 }])
        });
        let mut rest = &mut data[..];
        for (k, ring) in rings.iter().enumerate() {
            let Some(ring) = ring else { continue };
            let data = rest.split_off_mut(..ring.room()).unwrap();
            let length = self.lengths[k].as_ref().unwrap();
            let mut scratch = vec![Eight::default(); ring.fourier.scratch_len()];
            let points = &mut data[MARGIN..MARGIN + ring.fourier.len()];
            ring.fourier
                .backward(level, &length.table, points, &mut scratch)
                .unwrap();
            let range = self.start(k)..self.start(k + 1);
            let cut = out.each_mut().map(|m| {
                m.each_mut()
                    .map(|m| m.get_mut(range.clone()).unwrap_or_default())
            });
            pixels_from_cap(level, ring, &self.window, data, cut).unwrap();
        }
        out
    }

    /// Maps → F_m, the transpose.
    fn adjoint(&self, level: Level, maps: &Maps, stores: Stores) -> Vec<PhaseTile> {
        let rings = self.rings();
        let mut data = vec![Aligned([[f64::NAN; 8]; 2]); cap_room(&rings)];
        let mut rest = &mut data[..];
        for (k, ring) in rings.iter().enumerate() {
            let Some(ring) = ring else { continue };
            let data = rest.split_off_mut(..ring.room()).unwrap();
            let range = self.start(k)..self.start(k + 1);
            let cut = maps.each_ref().map(|m| {
                m.each_ref()
                    .map(|m| m.get(range.clone()).unwrap_or_default())
            });
            cap_from_pixels(level, ring, &self.window, cut, data).unwrap();
            let length = self.lengths[k].as_ref().unwrap();
            let mut scratch = vec![Eight::default(); ring.fourier.scratch_len()];
            let points = &mut data[MARGIN..MARGIN + ring.fourier.len()];
            ring.fourier
                .forward(level, &length.table, points, &mut scratch)
                .unwrap();
        }
        let each = self.orders.div_ceil(ORDERS);
        let mut tiles = vec![[Aligned([[f64::NAN; 8]; 4]); ORDERS]; CAP_MAPS * each];
        let mut all: Vec<_> = tiles.iter_mut().collect();
        let (first, second) = all.split_at_mut(each);
        let to = ([first, second], self.orders);
        let table = &self.table;
        phases_from_cap_spectrum(level, &data, &rings, &[1.0; 8], table, to, stores).unwrap();
        tiles
    }

    fn random(&self, seed: u64) -> Vec<PhaseTile> {
        let mut random = Random(seed);
        let mut tiles =
            vec![[PhaseBlock::default(); ORDERS]; CAP_MAPS * self.orders.div_ceil(ORDERS)];
        for (k, block) in tiles.as_flattened_mut().iter_mut().enumerate() {
            for (part, lanes) in block.0.iter_mut().enumerate() {
                // F_0 is real
                if !(k % (self.orders.div_ceil(ORDERS) * ORDERS) == 0 && part % 2 == 1) {
                    lanes.fill_with(|| random.next());
                }
            }
        }
        tiles
    }
}

/// Blocks: at the pole, where orders alias; lengths that are prime, smooth, mixed; narrow bands; rings missing.
fn blocks() -> Vec<Block> {
    vec![
        Block::new([1, 2, 3, 4, 5, 6, 7, 8], 30),
        Block::new([1, 2, 3, 4, 0, 0, 0, 0], 3),
        Block::new([17, 18, 19, 20, 21, 22, 23, 24], 40),
        Block::new([97, 98, 99, 100, 101, 102, 103, 104], 187),
        Block::new([97, 101, 103, 107, 109, 113, 127, 131], 9),
        Block::new([17, 19, 23, 29, 31, 37, 0, 0], 200),
        Block::new([509, 510, 511, 512, 512, 512, 512, 512], 17),
    ]
}

pub(crate) fn levels() -> impl Iterator<Item = Level> {
    ["portable", "avx2", "avx512"]
        .into_iter()
        .filter_map(Level::by_name)
}

/// Σ_m (2 − δ_m0) Re F_m e^{imφ}, φ = φ₀ + 2πj/n.
pub(crate) fn direct(f: &[Alm], shifted: bool, n: usize, j: usize) -> f64 {
    let shift = usize::from(shifted);
    f.iter()
        .enumerate()
        .map(|(m, f)| {
            // in units of π/n, period 2n
            let turn = (m * (2 * j + shift)) % (2 * n);
            let (s, c) = (std::f64::consts::PI * turn as f64 / n as f64).sin_cos();
            let e = Alm::new(c, s);
            (f * e).re * if m == 0 { 1.0 } else { 2.0 }
        })
        .sum()
}

/// F_m of one hemisphere on a ring.
pub(crate) fn on_ring(
    tiles: &[PhaseTile],
    orders: usize,
    hemisphere: usize,
    ring: usize,
) -> Vec<Alm> {
    let blocks = tiles.as_flattened().iter().take(orders);
    blocks
        .map(|b| Alm::new(b[2 * hemisphere][ring], b[2 * hemisphere + 1][ring]))
        .collect()
}

/// Σ_m (2 − δ_m0) a_m b_m of one map on the rings that are there.
pub(crate) fn product(
    a: &[PhaseTile],
    b: &[PhaseTile],
    orders: usize,
    there: impl Fn(usize) -> bool,
) -> f64 {
    let blocks = a.as_flattened().iter().zip(b.as_flattened()).take(orders);
    blocks
        .enumerate()
        .map(|(m, (a, b))| {
            let lanes = a.as_flattened().iter().zip(b.as_flattened()).enumerate();
            let there = lanes.filter(|(i, _)| there(i % 8));
            let weight = if m == 0 { 1.0 } else { 2.0 };
            weight * there.map(|(_, (a, b))| a * b).sum::<f64>()
        })
        .sum()
}

#[test]
fn naive_rings_cap() {
    let mut worst: f64 = 0.0;
    for block in blocks() {
        let tiles = block.random(block.orders as u64);
        let each = block.orders.div_ceil(ORDERS);
        for level in levels() {
            let maps = block.synthesis(level, CAP_MAPS, &tiles);
            let (mut error, mut square) = (0.0, 0.0);
            for (map, tiles) in maps.iter().zip(tiles.chunks_exact(each)) {
                for (hemisphere, pixels) in map.iter().enumerate() {
                    for ring in 0..8 {
                        let f = on_ring(tiles, block.orders, hemisphere, ring);
                        let (start, n) = (block.start(ring), block.shapes.pixels[ring]);
                        for j in 0..n {
                            let want = direct(&f, block.shapes.shifted[ring], n, j);
                            error += (pixels[start + j] - want).powi(2);
                            square += want * want;
                        }
                    }
                }
            }
            worst = worst.max((error / square).sqrt());
        }
    }
    tolerance::CAP.hold(worst);
}

#[test]
fn adjoint_rings_cap() {
    for block in blocks() {
        let mut random = Random(5);
        let tiles = block.random(1);
        let maps: Maps =
            std::array::from_fn(|_| std::array::from_fn(|_| random.map(block.start(8))));
        for level in levels() {
            let image = block.synthesis(level, CAP_MAPS, &tiles);
            let left: f64 = maps
                .as_flattened()
                .iter()
                .zip(image.as_flattened())
                .flat_map(|(a, b)| a.iter().zip(b))
                .map(|(a, b)| a * b)
                .sum();
            let back = block.adjoint(level, &maps, Stores::Cached);
            let each = block.orders.div_ceil(ORDERS);
            let right: f64 = tiles
                .chunks_exact(each)
                .zip(back.chunks_exact(each))
                .map(|(a, b)| product(a, b, block.orders, |lane| block.quarters[lane] > 0))
                .sum();
            let size: f64 = image.as_flattened().iter().flatten().map(|x| x * x).sum();
            assert!(
                (left - right).abs() < 1e-13 * size.sqrt() * (maps[0][0].len() as f64).sqrt(),
                "{:?} {level}: {left} {right}",
                block.quarters
            );
        }
    }
}

#[test]
fn bits_equal_maps_stores_levels_cap() {
    for block in blocks() {
        let tiles = block.random(2);
        let each = block.orders.div_ceil(ORDERS);
        let fused: Vec<_> = ["avx2", "avx512"]
            .into_iter()
            .filter_map(Level::by_name)
            .collect();
        for level in levels() {
            let both = block.synthesis(level, 2, &tiles);
            for (k, map) in both.iter().enumerate() {
                let alone = block.synthesis(level, 1, &tiles[k * each..(k + 1) * each]);
                assert_eq!(&alone[0], map, "{:?} {level}", block.quarters);
            }
            let back = block.adjoint(level, &both, Stores::Cached);
            let streamed = block.adjoint(level, &both, Stores::Streamed);
            assert_eq!(back, streamed, "{:?} {level}", block.quarters);
            let [_, second] = both;
            let alone = block.adjoint(level, &[second, Default::default()], Stores::Cached);
            assert_eq!(alone[..each], back[each..], "{:?} {level}", block.quarters);
        }
        if let [a, b] = fused[..] {
            let maps = block.synthesis(a, 2, &tiles);
            assert_eq!(maps, block.synthesis(b, 2, &tiles), "{:?}", block.quarters);
            assert_eq!(
                block.adjoint(a, &maps, Stores::Cached),
                block.adjoint(b, &maps, Stores::Streamed),
                "{:?}",
                block.quarters
            );
        }
    }
}

#[test]
fn errors_lengths_cap() {
    let block = Block::new([17, 18, 19, 20, 21, 22, 23, 24], 40);
    let rings = block.rings();
    let level = Level::detect();
    let tiles = block.random(1);
    let mut data = vec![Eight::default(); cap_room(&rings)];
    let places = [0, 1, 2, 3, 4];
    let spectrum = |data: &mut [Eight], places: &[usize], rings: &CapRings<'_>| {
        cap_spectrum_from_phases(
            level,
            &tiles,
            ([places, &[]], 40),
            &block.table,
            rings,
            data,
        )
    };
    assert!(spectrum(&mut data, &places, &rings).is_ok());
    assert!(spectrum(&mut data[1..], &places, &rings).is_err());
    assert!(spectrum(&mut data, &places[1..], &rings).is_err());
    assert!(spectrum(&mut data, &[0, 1, 2, 3, 99], &rings).is_err());
    let mut few = rings;
    for ring in few.iter_mut().flatten() {
        ring.factors = &ring.factors[..ring.factors.len().min(3)];
    }
    assert!(spectrum(&mut data, &places, &few).is_err());
    let ring = rings[0].unwrap();
    let mut map = vec![0.0; 67];
    let data = &mut data[..ring.room()];
    let maps = [[&mut map[..], &mut []], [&mut [], &mut []]];
    assert!(pixels_from_cap(level, &ring, &block.window, data, maps).is_err());
    assert!(cap_from_pixels(level, &ring, &block.window, [[&map, &[]], [&[], &[]]], data).is_err());
}
