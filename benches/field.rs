//! Line-of-sight ratios, pitch scan, residual sharing with the cap, normal deviates.
//!
//! Ids are kernel/level/size. Every workload's result is checked before it is timed.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use dust3d_kernels::field::Model;
use dust3d_kernels::field::line_of_sight::{ratios_into, ratios_scratch_len};
use dust3d_kernels::fit::l1::{scan_add, scan_scratch_len};
use dust3d_kernels::healpix::{Nside, ring};
use dust3d_kernels::random::Stream;
use dust3d_kernels::simd::Level;
use dust3d_kernels::split::{renormalise_into, renormalise_scratch_len};
use std::hint::black_box;

const LAYERS: usize = 6;

fn edges() -> [f64; LAYERS + 1] {
    let mut edges = [0.0; LAYERS + 1];
    for (i, edge) in edges.iter_mut().enumerate().skip(1) {
        *edge = 10_f64.powf((3.0 * i as f64 + 1.0) / 5.0 + 1.0) / 1000.0;
    }
    edges
}

/// Every pixel of a small map: the latitudes of a large one in their proportions.
fn directions(nside: u64) -> Vec<[f64; 3]> {
    let nside = Nside::new(nside).expect("a power of two");
    (0..nside.npix())
        .map(|p| ring::pix2vec(nside, p).expect("a pixel of the map"))
        .collect()
}

fn ratios(level: Level, model: &Model, directions: &[[f64; 3]], maps: &mut [Vec<f64>]) {
    let mut slices: Vec<&mut [f64]> = maps.iter_mut().map(|m| &mut m[..]).collect();
    let (q, u) = slices.split_at_mut(LAYERS);
    let mut scratch = [0.0; ratios_scratch_len()];
    ratios_into(level, model, &edges(), directions, q, u, &mut scratch).expect("lengths fit");
}

fn bench_ratios(c: &mut Criterion) {
    let mut group = c.benchmark_group("line_of_sight_ratios");
    let model = Model::default();
    let directions = directions(16);
    for level in Level::available() {
        let mut maps = vec![vec![0.0; directions.len()]; 2 * LAYERS];
        ratios(level, &model, &directions, &mut maps);
        // The two rings of pixels nearest to the equator mirror each other.
        let n = directions.len();
        for layer in 0..LAYERS {
            let (q, u) = (&maps[layer], &maps[LAYERS + layer]);
            assert!(q.iter().all(|x| x.abs() <= model.grains.p0));
            assert_eq!((q[0], u[0]), (q[n - 4], -u[n - 4]));
        }
        group.throughput(Throughput::Elements((n * LAYERS) as u64));
        group.bench_function(BenchmarkId::new(level.name(), 16), |b| {
            b.iter(|| ratios(level, black_box(&model), &directions, &mut maps));
        });
    }
    group.finish();
}

fn bench_scan(c: &mut Criterion) {
    let mut group = c.benchmark_group("pitch_scan");
    let model = Model::default();
    let directions: Vec<_> = directions(8)
        .into_iter()
        .filter(|d| d[2].abs() >= 15_f64.to_radians().sin())
        .collect();
    let n = directions.len();
    let mut maps = vec![vec![0.0; n]; 2 * LAYERS];
    let intensity = vec![vec![1.0; n]; LAYERS];
    let intensity: Vec<&[f64]> = intensity.iter().map(|m| &m[..]).collect();
    let pitches: Vec<f64> = (-60..=-5).map(|q| f64::from(q).to_radians()).collect();
    for level in Level::available() {
        ratios(level, &model, &directions, &mut maps);
        let sum = |maps: &[Vec<f64>]| -> Vec<f64> {
            (0..n).map(|p| maps.iter().map(|m| m[p]).sum()).collect()
        };
        let (q, u) = (sum(&maps[..LAYERS]), sum(&maps[LAYERS..]));
        let mut sums = vec![0.0; pitches.len()];
        let mut scratch = vec![0.0; scan_scratch_len(pitches.len())];
        let mut scan = |sums: &mut [f64]| {
            sums.fill(0.0);
            let edges = edges();
            scan_add(
                level,
                &model,
                &edges,
                &directions,
                &intensity,
                &q,
                &u,
                &pitches,
                sums,
                &mut scratch,
            )
            .expect("lengths fit");
        };
        scan(&mut sums);
        // −33°, the angle the maps were made with, is number 27 of the scan.
        let least = sums.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(sums[27] == least && least < 1e-12 * n as f64);
        group.throughput(Throughput::Elements((n * pitches.len()) as u64));
        group.bench_function(BenchmarkId::new(level.name(), n), |b| {
            b.iter(|| scan(&mut sums));
        });
    }
    group.finish();
}

fn bench_renormalise(c: &mut Criterion) {
    let mut group = c.benchmark_group("renormalise");
    let n = 4096;
    let mut stream = Stream::new(1, 0, 0, 0).expect("small numbers");
    // Layers over three decades of intensity, 5 % polarised on average: a tenth of the pixels need the cap.
    let intensity: Vec<Vec<f64>> = (0..LAYERS)
        .map(|_| (0..n).map(|_| stream.normal().exp()).collect())
        .collect();
    let intensity: Vec<&[f64]> = intensity.iter().map(|m| &m[..]).collect();
    let predicted: Vec<Vec<f64>> = (0..2 * LAYERS)
        .map(|m| {
            (0..n)
                .map(|p| 0.06 * stream.normal() * intensity[m % LAYERS][p])
                .collect()
        })
        .collect();
    let observed: Vec<Vec<f64>> = (0..2)
        .map(|_| (0..n).map(|_| 0.4 * stream.normal()).collect())
        .collect();
    let mut scratch = vec![0.0; renormalise_scratch_len(LAYERS)];
    let mut maps = predicted.clone();
    let mut run = |maps: &mut [Vec<f64>]| {
        for (m, p) in maps.iter_mut().zip(&predicted) {
            m.copy_from_slice(p);
        }
        let mut slices: Vec<&mut [f64]> = maps.iter_mut().map(|m| &mut m[..]).collect();
        let (q, u) = slices.split_at_mut(LAYERS);
        renormalise_into(
            0.25,
            &intensity,
            &observed[0],
            &observed[1],
            q,
            u,
            &mut scratch,
        )
        .expect("lengths fit")
    };
    let counts = run(&mut maps);
    println!("renormalise: {counts:?} of {n} pixels");
    assert!(counts.capped > 0 && counts.missing == 0);
    for p in 0..n {
        let sum: f64 = maps[..LAYERS].iter().map(|m| m[p]).sum();
        assert!((sum - observed[0][p]).abs() < 1e-12);
    }
    group.throughput(Throughput::Elements(n as u64));
    group.bench_function(BenchmarkId::new("scalar", n), |b| b.iter(|| run(&mut maps)));
    group.finish();
}

fn bench_normals(c: &mut Criterion) {
    let mut group = c.benchmark_group("normals");
    let mut stream = Stream::new(1, 0, 0, 0).expect("small numbers");
    let mut out = vec![0.0; 8192];
    stream.fill_normals(&mut out);
    let mean = out.iter().sum::<f64>() / out.len() as f64;
    assert!(mean.abs() < 0.05);
    group.throughput(Throughput::Elements(out.len() as u64));
    group.bench_function(BenchmarkId::new("scalar", out.len()), |b| {
        b.iter(|| stream.fill_normals(black_box(&mut out)));
    });
    group.finish();
}

criterion_group!(
    benches,
    bench_ratios,
    bench_scan,
    bench_renormalise,
    bench_normals
);
criterion_main!(benches);
