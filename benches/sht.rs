//! Criterion benchmarks of the transforms: their stages per level, and whole transforms.
//!
//! `cargo bench -p dust3d-benches --bench sht`. Elements are (degree, order, ring pair) triples for the Legendre stage,
//! complex values for Fourier transforms and resampling, and pixels elsewhere. Against other programs: `benches/peers/sht.py`.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use dust3d::kernels::Complex;
use dust3d::kernels::fourier::{Eight, Fourier};
use dust3d::kernels::healpix::Nside;
use dust3d::kernels::sht::{
    Aligned, CapRing, CapRings, CapWindow, Coefficient, Line, MARGIN, ORDERS, PhaseBlock,
    PhaseIndex, PhaseTable, PhaseTile, Resampling, RingBlock, RingShapes, RingTaps, Stores,
    add_to_fine, adjoint, adjoint_scratch_len, belt_from_pixels, belt_spectrum_from_phases,
    cap_factors, cap_from_pixels, cap_length, cap_room, cap_spectrum_from_phases, epsilon_len,
    epsilon_table, phase_table, phase_table_len, phases_from_belt_spectrum,
    phases_from_cap_spectrum, phases_from_fine, pixels_from_belt, pixels_from_cap,
    resampling_factors, resampling_lengths, ring_block_count, ring_blocks, ring_taps, start_norms,
    step_count, step_table, synthesis,
};
use dust3d::kernels::simd::Level;
use dust3d::sht::ShtPlan;

/// One order of the Legendre stage.
fn legendre(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("legendre");
    let nside = 256;
    let (lmax, m) = (512, 100);
    let mut rings = vec![RingBlock::default(); ring_block_count(nside)];
    ring_blocks(nside, lmax, &mut rings).expect("rings");
    let mut epsilon = vec![0.0; epsilon_len(lmax, m)];
    epsilon_table(m, &mut epsilon);
    let mut steps = vec![[0.0; 4]; step_count(lmax, m)];
    step_table(&epsilon, &mut steps).expect("steps");
    let mut norms = vec![0.0; m + 1];
    start_norms(&mut norms);
    let norm = norms[m] / steps[0][3];
    for channels in 1..=3 {
        let mut c: Vec<Coefficient> = vec![[1.0, 0.5, -1.0, 0.25]; channels * steps.len()];
        let mut phases = vec![PhaseBlock::default(); channels * rings.len()];
        let mut scratch = vec![Line::default(); adjoint_scratch_len(steps.len(), channels)];
        group.throughput(Throughput::Elements(
            (channels * (lmax - m + 1) * 8 * rings.len()) as u64,
        ));
        for level in Level::available() {
            let id = format!("{level}/channels {channels}");
            group.bench_function(BenchmarkId::new("synthesis", &id), |b| {
                b.iter(|| {
                    synthesis(
                        level,
                        &rings,
                        m,
                        norm,
                        &steps,
                        channels,
                        &c,
                        PhaseIndex::default(),
                        &mut phases,
                    )
                    .expect("lengths");
                });
            });
            assert!(
                phases.iter().any(|p| p[0][0] != 0.0),
                "nothing was computed"
            );
            group.bench_function(BenchmarkId::new("adjoint", &id), |b| {
                b.iter(|| {
                    phases.fill(PhaseBlock::default());
                    adjoint(
                        level,
                        &rings,
                        m,
                        norm,
                        &steps,
                        channels,
                        PhaseIndex::default(),
                        &phases,
                        &mut c,
                        &mut scratch,
                    )
                    .expect("lengths");
                });
            });
            c.fill([1.0, 0.5, -1.0, 0.25]);
        }
    }
    group.finish();
}

/// A transform across lanes with its table and scratch.
struct Ready {
    fourier: Fourier,
    table: Vec<[f64; 2]>,
    scratch: Vec<Eight>,
}

impl Ready {
    fn new(n: usize) -> Self {
        let fourier = Fourier::new(n).expect("smooth");
        let mut table = vec![[0.0; 2]; fourier.table_len()];
        fourier.fill_table(&mut table);
        let scratch = vec![Eight::default(); fourier.scratch_len()];
        Self {
            fourier,
            table,
            scratch,
        }
    }
}

fn computed<const N: usize>(values: &[Aligned<N>]) {
    let some = values.iter().any(|x| x[0].iter().any(|&x| x != 0.0));
    assert!(some, "nothing was computed");
}

/// Fourier transforms across lanes, and the resampling of eight orders to the rings of Nside 512.
fn fourier(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("fourier");
    for n in [360, 1050, 1792, 2048] {
        let mut ready = Ready::new(n);
        let mut data = vec![Aligned([[1e-3; 8]; 2]); n];
        group.throughput(Throughput::Elements(8 * n as u64));
        for level in Level::available() {
            group.bench_function(
                BenchmarkId::new("there and back", format!("{level}/{n}")),
                |b| {
                    b.iter(|| {
                        let Ready {
                            fourier,
                            table,
                            scratch,
                        } = &mut ready;
                        fourier
                            .forward(level, table, &mut data, scratch)
                            .expect("lengths");
                        data.iter_mut()
                            .flat_map(|x| x.as_flattened_mut())
                            .for_each(|x| *x /= n as f64);
                        fourier
                            .backward(level, table, &mut data, scratch)
                            .expect("lengths");
                    });
                },
            );
            computed(&data);
        }
    }
    let (nside, lmax) = (512, 1024);
    let (n, m) = resampling_lengths(lmax);
    let (coarse, fine) = (Ready::new(n), Ready::new(m));
    let mut factors = vec![[0.0; 2]; lmax + 1];
    resampling_factors(lmax, (n, m), &mut factors);
    let mut taps = vec![RingTaps::default(); ring_block_count(nside)];
    ring_taps(nside, lmax, m, &mut taps).expect("taps");
    let mut grid = vec![Eight::default(); m + 2 * MARGIN];
    let mut phases = vec![PhaseBlock::default(); ORDERS * taps.len()];
    let resampling = Resampling {
        lmax,
        coarse: &coarse.fourier,
        coarse_table: &coarse.table,
        fine: &fine.fourier,
        fine_table: &fine.table,
        factors: &factors,
    };
    let mut scratch = vec![Eight::default(); coarse.scratch.len().max(fine.scratch.len())];
    group.throughput(Throughput::Elements(8 * 4 * nside));
    for level in Level::available() {
        group.bench_function(
            BenchmarkId::new("refine", format!("{level}/{nside}:{lmax}")),
            |b| {
                b.iter(|| {
                    let mut values = vec![Aligned([[1.0; 8]; 2]); n];
                    resampling
                        .refine(level, &mut values, &mut grid, &mut scratch)
                        .expect("lengths");
                    phases_from_fine(level, &grid, &taps, &mut phases, Stores::Cached)
                        .expect("lengths");
                });
            },
        );
        computed(&phases);
        let mut values = vec![Eight::default(); n];
        group.bench_function(
            BenchmarkId::new("coarsen", format!("{level}/{nside}:{lmax}")),
            |b| {
                b.iter(|| {
                    grid.fill(Eight::default());
                    for (tile, taps) in phases.chunks_exact(ORDERS).zip(&taps) {
                        add_to_fine(level, tile, &[], taps, &mut grid).expect("lengths");
                    }
                    resampling
                        .coarsen(level, &mut grid, &mut values, &mut scratch)
                        .expect("lengths");
                });
            },
        );
        computed(&values);
    }
    group.finish();
}

/// The rings of a block of the caps, with the transform and the factors of each.
fn cap_rings<'a>(shapes: &RingShapes, lengths: &'a [(Ready, Vec<f64>)]) -> CapRings<'a> {
    std::array::from_fn(|k| {
        Some(CapRing {
            quarter: shapes.pixels[k] / 4,
            fourier: &lengths[k].0.fourier,
            factors: &lengths[k].1,
        })
    })
}

/// F_m ↔ pixels: a block of the belt, and one of the caps for two maps.
fn rings(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("rings");
    let (nside, lmax) = (256, 512);
    let orders: usize = lmax + 1;
    let batches = orders.div_ceil(ORDERS);
    let tiles: Vec<PhaseTile> = vec![[Aligned([[1.0; 8]; 4]); ORDERS]; 2 * batches];
    let places: Vec<usize> = (0..2 * batches).collect();
    let (first, second) = places.split_at(batches);
    let mut table = vec![PhaseTable::default(); phase_table_len(lmax)];
    for (name, block) in [("caps", 16), ("belt", 48)] {
        let shapes = RingShapes::healpix(nside, block);
        phase_table(&shapes, &mut table);
        let pixels: usize = shapes.pixels.iter().sum();
        let mut north = vec![vec![0.0; pixels]; 2];
        let mut south = north.clone();
        let maps = if name == "caps" { 2 } else { 1 };
        group.throughput(Throughput::Elements((2 * maps * pixels) as u64));
        let window = CapWindow::new();
        let mut lengths: Vec<(Ready, Vec<f64>)> = shapes
            .pixels
            .iter()
            .map(|n| {
                let length = if name == "caps" {
                    cap_length(n / 4, orders)
                } else {
                    *n
                };
                let mut factors = vec![0.0; if length == n / 4 { 0 } else { length / 2 + 1 }];
                cap_factors(length, &mut factors);
                (Ready::new(length), factors)
            })
            .collect();
        for level in Level::available() {
            group.bench_function(BenchmarkId::new(name, level), |b| {
                b.iter(|| {
                    if name == "belt" {
                        let Ready {
                            fourier,
                            table: roots,
                            scratch,
                        } = &mut lengths[0].0;
                        let mut data = vec![Eight::default(); fourier.len()];
                        belt_spectrum_from_phases(
                            level,
                            &tiles,
                            (first, orders),
                            &table,
                            fourier,
                            &mut data,
                        )
                        .expect("lengths");
                        fourier
                            .backward(level, roots, &mut data, scratch)
                            .expect("lengths");
                        pixels_from_belt(level, &data, &mut north[0], &mut south[0])
                            .expect("lengths");
                        return;
                    }
                    let all = cap_rings(&shapes, &lengths);
                    let mut data = vec![Eight::default(); cap_room(&all)];
                    let which = ([first, second], orders);
                    cap_spectrum_from_phases(level, &tiles, which, &table, &all, &mut data)
                        .expect("lengths");
                    let mut scratch = vec![Eight::default(); 2048];
                    let mut rest = &mut data[..];
                    let mut start = 0;
                    for (ring, (ready, _)) in all.iter().flatten().zip(&lengths) {
                        let data = rest.split_off_mut(..ring.room()).expect("room");
                        let points = &mut data[MARGIN..MARGIN + ring.fourier.len()];
                        ring.fourier
                            .backward(level, &ready.table, points, &mut scratch)
                            .expect("lengths");
                        let range = start..start + 4 * ring.quarter;
                        start = range.end;
                        let [a, b] = north.get_disjoint_mut([0, 1]).expect("two maps");
                        let [c, d] = south.get_disjoint_mut([0, 1]).expect("two maps");
                        let cut = [
                            [&mut a[range.clone()], &mut c[range.clone()]],
                            [&mut b[range.clone()], &mut d[range]],
                        ];
                        pixels_from_cap(level, ring, &window, data, cut).expect("lengths");
                    }
                });
            });
            assert!(north[0].iter().any(|&x| x != 0.0), "nothing was computed");
            let mut back = vec![[PhaseBlock::default(); ORDERS]; 2 * batches];
            group.bench_function(BenchmarkId::new(format!("{name} adjoint"), level), |b| {
                b.iter(|| {
                    let mut places: Vec<_> = back.iter_mut().collect();
                    let (first, second) = places.split_at_mut(batches);
                    if name == "belt" {
                        let Ready {
                            fourier,
                            table: roots,
                            scratch,
                        } = &mut lengths[0].0;
                        let mut data = vec![Eight::default(); fourier.len()];
                        belt_from_pixels(level, &north[0], &south[0], &mut data).expect("lengths");
                        fourier
                            .forward(level, roots, &mut data, scratch)
                            .expect("lengths");
                        let to = (first, orders);
                        let stores = Stores::Cached;
                        let scale = [1.0; 8];
                        phases_from_belt_spectrum(
                            level, &data, fourier, &scale, &table, to, stores,
                        )
                        .expect("lengths");
                        return;
                    }
                    let all = cap_rings(&shapes, &lengths);
                    let mut data = vec![Eight::default(); cap_room(&all)];
                    let mut scratch = vec![Eight::default(); 2048];
                    let mut rest = &mut data[..];
                    let mut start = 0;
                    for (ring, (ready, _)) in all.iter().flatten().zip(&lengths) {
                        let data = rest.split_off_mut(..ring.room()).expect("room");
                        let range = start..start + 4 * ring.quarter;
                        start = range.end;
                        let cut =
                            [0, 1].map(|k| [&north[k][range.clone()], &south[k][range.clone()]]);
                        cap_from_pixels(level, ring, &window, cut, data).expect("lengths");
                        let points = &mut data[MARGIN..MARGIN + ring.fourier.len()];
                        ring.fourier
                            .forward(level, &ready.table, points, &mut scratch)
                            .expect("lengths");
                    }
                    let to = ([first, second], orders);
                    let stores = Stores::Cached;
                    phases_from_cap_spectrum(level, &data, &all, &[1.0; 8], &table, to, stores)
                        .expect("lengths");
                });
            });
            computed(&back[0]);
        }
    }
    group.finish();
}

/// Whole transforms on one thread.
fn transforms(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("transform");
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("threads");
    for (nside, lmax) in [(64, 191), (256, 512)] {
        for level in Level::available() {
            let nside = Nside::new(nside).expect("nside");
            let mut plan = ShtPlan::new(nside, lmax, level).expect("plan");
            let mut alm = vec![vec![Complex::new(1.0, 0.0); plan.alm_len()]; 2];
            let mut map = vec![vec![0.0; plan.npix()]; 2];
            let [e, b] = &mut alm[..] else { return };
            let [q, u] = &mut map[..] else { return };
            group.throughput(Throughput::Elements(plan.npix() as u64));
            let id = format!("{level}/{}:{lmax}", nside.get());
            group.bench_function(BenchmarkId::new("synthesis", &id), |x| {
                x.iter(|| pool.install(|| plan.synthesis(e, q)).expect("lengths"));
            });
            assert!(q.iter().any(|&q| q != 0.0), "nothing was computed");
            group.bench_function(BenchmarkId::new("synthesis_spin2", &id), |x| {
                x.iter(|| {
                    pool.install(|| plan.synthesis_spin2(e, b, q, u))
                        .expect("lengths");
                });
            });
            group.bench_function(BenchmarkId::new("adjoint", &id), |x| {
                x.iter(|| {
                    pool.install(|| plan.adjoint_synthesis(q, e))
                        .expect("lengths");
                });
            });
            group.bench_function(BenchmarkId::new("adjoint_spin2", &id), |x| {
                x.iter(|| {
                    pool.install(|| plan.adjoint_synthesis_spin2(q, u, e, b))
                        .expect("lengths");
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, legendre, fourier, rings, transforms);
criterion_main!(benches);
