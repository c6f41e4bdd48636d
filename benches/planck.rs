//! Criterion benchmarks of the emission laws: vector functions, Planck function, modified blackbodies, their fit.
//!
//! Every result is checked against a scalar before it is timed; each kernel stands beside a plain scalar version.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use dust3d_benches::emission::{Layer, Noisy};
use dust3d_kernels::dispatch;
use dust3d_kernels::fit::mbb::{MbbFit, fit_into};
use dust3d_kernels::planck::mbb::{MbbNode, mbb_add_iqu};
use dust3d_kernels::planck::spectrum;
use dust3d_kernels::simd::{Lanes, Level, math};
use dust3d_kernels::units::NU0_GHZ;
use std::hint::black_box;

const N: usize = 4096;

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * b.abs()
}

#[inline(always)]
fn map<L: Lanes>(token: L::Token, x: &[f64], out: &mut [f64], f: impl Fn(L) -> L) {
    for (x, out) in x.as_chunks::<8>().0.iter().zip(out.as_chunks_mut::<8>().0) {
        f(L::load(token, x)).store(out);
    }
}

fn functions(c: &mut Criterion) {
    let x: Vec<f64> = (0..N).map(|i| 1e-3 + 20.0 * i as f64 / N as f64).collect();
    let mut out = vec![0.0; N];
    let mut group = c.benchmark_group("math");
    group.throughput(Throughput::Elements(N as u64));
    macro_rules! bench {
        ($name:literal, $scalar:expr, $lanes:expr) => {
            let scalar: fn(f64) -> f64 = $scalar;
            for level in Level::available() {
                let run = |out: &mut [f64]| {
                    dispatch!(level, |token: L| map::<L>(
                        token,
                        &x,
                        out,
                        #[inline(always)]
                        |v| $lanes(token, v)
                    ));
                };
                run(&mut out);
                assert!(
                    x.iter()
                        .zip(&out)
                        .all(|(&x, &y)| close(y, scalar(x), 1e-14))
                );
                group.bench_function(BenchmarkId::new(format!("{}/{level}", $name), N), |b| {
                    b.iter(|| run(black_box(&mut out)));
                });
            }
            group.bench_function(BenchmarkId::new(concat!($name, "/std"), N), |b| {
                b.iter(|| {
                    for (o, &x) in out.iter_mut().zip(black_box(&x)) {
                        *o = scalar(x);
                    }
                });
            });
        };
    }
    bench!("exp", f64::exp, math::exp);
    bench!("expm1", f64::exp_m1, math::expm1);
    bench!("ln", f64::ln, math::ln);
    bench!("sin", f64::sin, |t, v| math::sin_cos(t, v).0);
    bench!("pow", |x| x.powf(1.7), |t, v| math::pow(
        t,
        v,
        Lanes::splat(t, 1.7)
    ));
    group.finish();
}

fn planck(c: &mut Criterion) {
    let layer = Layer::new(N);
    let mut out = vec![0.0; N];
    let mut group = c.benchmark_group("planck");
    group.throughput(Throughput::Elements(N as u64));
    for level in Level::available() {
        let run =
            |out: &mut [f64]| spectrum::planck_into(level, 545.0, &layer.t, out).expect("lengths");
        run(&mut out);
        assert!(layer.t.iter().zip(&out).all(|(&t, &b)| close(
            b,
            spectrum::planck_scalar(545.0, t),
            1e-14
        )));
        group.bench_function(BenchmarkId::new(level.name(), N), |b| {
            b.iter(|| run(black_box(&mut out)));
        });
    }
    group.bench_function(BenchmarkId::new("scalar", N), |b| {
        b.iter(|| {
            for (o, &t) in out.iter_mut().zip(black_box(&layer.t)) {
                *o = spectrum::planck_scalar(545.0, t);
            }
        });
    });
    group.finish();
}

fn emission(c: &mut Criterion) {
    let layer = Layer::new(N);
    let mut group = c.benchmark_group("mbb_add_iqu");
    let nodes: Vec<MbbNode> = (0..10)
        .map(|k| MbbNode::new(200.0 + 4.0 * f64::from(k), NU0_GHZ, 0.1).expect("frequency"))
        .collect();
    let list: Vec<&[MbbNode]> = nodes.iter().map(std::slice::from_ref).collect();
    for (name, bands) in [
        ("one", &list[..1]),
        ("ten", &list[..]),
        ("band10", &[&nodes[..]][..]),
    ] {
        let evaluations = bands.iter().map(|b| b.len()).sum::<usize>() * N;
        group.throughput(Throughput::Elements(evaluations as u64));
        let mut out = vec![vec![0.0; N]; 3 * bands.len()];
        for level in Level::available() {
            let run = |out: &mut [Vec<f64>]| {
                let mut views: Vec<&mut [f64]> = out.iter_mut().map(Vec::as_mut_slice).collect();
                mbb_add_iqu(level, bands, layer.iqu(), &layer.t, &layer.beta, &mut views)
                    .expect("lengths");
            };
            out.iter_mut().flatten().for_each(|x| *x = 0.0);
            run(&mut out);
            for (b, band) in bands.iter().enumerate() {
                for p in 0..N {
                    let law: f64 = band
                        .iter()
                        .map(|n| 0.1 * n.scaling_scalar(layer.t[p], layer.beta[p]))
                        .sum();
                    for (s, template) in layer.iqu().iter().enumerate() {
                        assert!(close(out[3 * b + s][p], template[p] * law, 1e-13));
                    }
                }
            }
            group.bench_function(BenchmarkId::new(format!("{name}/{level}"), N), |b| {
                b.iter(|| run(black_box(&mut out)));
            });
        }
        group.bench_function(BenchmarkId::new(format!("{name}/scalar"), N), |b| {
            b.iter(|| {
                for p in 0..N {
                    for (band, out) in bands.iter().zip(out.chunks_mut(3)) {
                        let law: f64 = band
                            .iter()
                            .map(|n| 0.1 * n.scaling_scalar(layer.t[p], layer.beta[p]))
                            .sum();
                        for (o, x) in out.iter_mut().zip(layer.iqu()) {
                            o[p] += x[p] * law;
                        }
                    }
                }
                black_box(&mut out);
            });
        });
    }
    group.finish();
}

fn fit(c: &mut Criterion) {
    let fit = MbbFit::default();
    let mut group = c.benchmark_group("mbb_fit");
    group.throughput(Throughput::Elements(N as u64));
    for (name, noise) in [("noise-free", 0.0), ("noisy", 1.0)] {
        let data = Noisy::new(N, noise);
        let maps = data.maps();
        let (mut tau, mut t, mut beta) = (vec![0.0; N], vec![0.0; N], vec![0.0; N]);
        for level in Level::available() {
            let mut run = || {
                fit_into(level, &fit, &maps, &mut tau, &mut t, &mut beta, None).expect("lengths")
            };
            let counts = run();
            assert_eq!(counts.fitted, N as u64);
            if noise == 0.0 {
                assert!(t.iter().zip(&data.t).all(|(a, b)| close(*a, *b, 1e-8)));
            }
            let mut run = || {
                fit_into(level, &fit, &maps, &mut tau, &mut t, &mut beta, None).expect("lengths")
            };
            group.bench_function(BenchmarkId::new(format!("{name}/{level}"), N), |b| {
                b.iter(&mut run);
            });
        }
    }
    group.finish();
}

criterion_group!(benches, functions, planck, emission, fit);
criterion_main!(benches);
