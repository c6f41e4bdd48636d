//! Criterion benchmarks of the transforms: the Legendre stage per level, and whole transforms.
//!
//! `cargo bench -p dust3d-benches --bench sht`. Elements are (degree, order, ring pair) triples for the Legendre stage
//! and pixels for whole transforms. Against other programs: `benches/peers/sht.py`.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use dust3d::kernels::Complex;
use dust3d::kernels::healpix::Nside;
use dust3d::kernels::sht::{
    Coefficient, Line, PhaseBlock, PhaseIndex, RingBlock, adjoint, adjoint_scratch_len,
    epsilon_len, epsilon_table, ring_block_count, ring_blocks, start_norms, step_count, step_table,
    synthesis,
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

criterion_group!(benches, legendre, transforms);
criterion_main!(benches);
