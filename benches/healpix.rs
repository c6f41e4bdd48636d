//! Criterion benchmarks of the HEALPix operations: every level, pixel by pixel with the scalar functions, and cdshealpix
//! where it has the operation.
//!
//! `cargo bench -p dust3d-benches --bench healpix`. Elements are points or pixels of a map, or discs. Every result is
//! compared with the scalar functions' or cdshealpix' before it is timed. Against healpy and ducc0:
//! `benches/peers/healpix.py`.

use cdshealpix::compass_point::MainWind;
use cdshealpix::{nested as cds, ring as cds_ring};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, BenchmarkId, Criterion, Throughput};
use criterion::{criterion_group, criterion_main};
use dust3d_kernels::healpix::resample::{degrade_ring, to_nested, to_ring};
use dust3d_kernels::healpix::{Location, NO_PIXEL, Nside, disc, interp, nest2ring, nest2ring_into};
use dust3d_kernels::healpix::{nested, ring, ring2nest, ring2nest_into};
use dust3d_kernels::simd::Level;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::hint::black_box;
use std::ops::Range;

const N: usize = 1 << 15;
const NSIDES: [u64; 3] = [64, 2048, 1 << 20];

/// SW, W, NW, N, NE, E, SE, S.
const WINDS: [MainWind; 8] = {
    use MainWind::{E, N, NE, NW, S, SE, SW, W};
    [SW, W, NW, N, NE, E, SE, S]
};

/// Points spread evenly at random, and the pixels that hold them.
struct Points {
    nside: Nside,
    theta: Vec<f64>,
    phi: Vec<f64>,
    lat: Vec<f64>,
    xyz: [Vec<f64>; 3],
    ring: Vec<u64>,
    nested: Vec<u64>,
}

impl Points {
    fn new(nside: Nside) -> Self {
        let mut random = dust3d_benches::random(nside.get());
        let theta: Vec<f64> = (0..N).map(|_| (2.0 * random() - 1.0).acos()).collect();
        let phi: Vec<f64> = (0..N).map(|_| TAU * random()).collect();
        let points = || theta.iter().zip(&phi);
        Self {
            nside,
            lat: theta.iter().map(|t| FRAC_PI_2 - t).collect(),
            xyz: [
                points().map(|(t, p)| t.sin() * p.cos()).collect(),
                points().map(|(t, p)| t.sin() * p.sin()).collect(),
                theta.iter().map(|t| t.cos()).collect(),
            ],
            ring: points()
                .map(|(&t, &p)| ring::ang2pix(nside, t, p).expect("angles"))
                .collect(),
            nested: points()
                .map(|(&t, &p)| nested::ang2pix(nside, t, p).expect("angles"))
                .collect(),
            theta,
            phi,
        }
    }
}

type Group<'a> = BenchmarkGroup<'a, WallTime>;

/// Times one program on one operation.
fn time(group: &mut Group<'_>, nside: Nside, program: &str, mut run: impl FnMut()) {
    let id = BenchmarkId::new(program, nside.get());
    group.bench_function(id, |b| b.iter(&mut run));
}

/// Times every level; each runs in any case, so that there is a result to check whatever the filter.
fn levels(group: &mut Group<'_>, nside: Nside, mut run: impl FnMut(Level)) {
    for level in Level::available() {
        run(level);
        time(group, nside, level.name(), || run(level));
    }
}

fn close(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-14)
}

/// One group per operation and order, all Nside in it.
fn each(c: &mut Criterion, name: &str, mut run: impl FnMut(&mut Group<'_>, &Points)) {
    let mut group = c.benchmark_group(name);
    group.throughput(Throughput::Elements(N as u64));
    for nside in NSIDES {
        run(&mut group, &Points::new(Nside::new(nside).expect("nside")));
    }
    group.finish();
}

fn ang2pix(c: &mut Criterion) {
    let mut out = vec![0; N];
    let mut theirs = vec![0; N];
    each(c, "ang2pix_ring", |group, p| {
        let nside = u32::try_from(p.nside.get()).expect("nside");
        let cds = |out: &mut [u64]| {
            for ((out, &lon), &lat) in out.iter_mut().zip(black_box(&p.phi)).zip(&p.lat) {
                *out = cds_ring::hash(nside, lon, lat);
            }
        };
        cds(&mut theirs);
        levels(group, p.nside, |level| {
            ring::ang2pix_into(level, p.nside, &p.theta, &p.phi, &mut out).expect("angles");
        });
        assert!(out == p.ring && out == theirs);
        time(group, p.nside, "cdshealpix", || cds(&mut theirs));
    });
    each(c, "ang2pix_nested", |group, p| {
        let layer = cds::get(depth(p.nside));
        let cds = |out: &mut [u64]| {
            for ((out, &lon), &lat) in out.iter_mut().zip(black_box(&p.phi)).zip(&p.lat) {
                *out = layer.hash(lon, lat);
            }
        };
        cds(&mut theirs);
        levels(group, p.nside, |level| {
            nested::ang2pix_into(level, p.nside, &p.theta, &p.phi, &mut out).expect("angles");
        });
        assert!(out == p.nested && out == theirs);
        time(group, p.nside, "cdshealpix", || cds(&mut theirs));
    });
}

fn depth(nside: Nside) -> u8 {
    u8::try_from(nside.order().expect("power of two")).expect("order")
}

fn vec2pix(c: &mut Criterion) {
    let mut out = vec![0; N];
    each(c, "vec2pix_ring", |group, p| {
        let [x, y, z] = &p.xyz;
        levels(group, p.nside, |level| {
            ring::vec2pix_into(level, p.nside, [x, y, z], &mut out).expect("vectors");
        });
        assert!(out == p.ring);
    });
    each(c, "vec2pix_nested", |group, p| {
        let [x, y, z] = &p.xyz;
        levels(group, p.nside, |level| {
            nested::vec2pix_into(level, p.nside, [x, y, z], &mut out).expect("vectors");
        });
        assert!(out == p.nested);
    });
}

fn pix2ang(c: &mut Criterion) {
    let (mut theta, mut phi) = (vec![0.0; N], vec![0.0; N]);
    let (mut lat, mut lon) = (vec![0.0; N], vec![0.0; N]);
    let same = |theta: &[f64], phi: &[f64], lat: &[f64], lon: &[f64]| {
        let colatitude: Vec<f64> = lat.iter().map(|b| FRAC_PI_2 - b).collect();
        assert!(close(theta, &colatitude) && close(phi, lon));
    };
    each(c, "pix2ang_ring", |group, p| {
        let nside = u32::try_from(p.nside.get()).expect("nside");
        let cds = |lon: &mut [f64], lat: &mut [f64]| {
            for ((&pixel, lon), lat) in black_box(&p.ring).iter().zip(lon).zip(lat) {
                (*lon, *lat) = cds_ring::center(nside, pixel);
            }
        };
        cds(&mut lon, &mut lat);
        levels(group, p.nside, |level| {
            ring::pix2ang_into(level, p.nside, &p.ring, &mut theta, &mut phi).expect("pixels");
        });
        same(&theta, &phi, &lat, &lon);
        time(group, p.nside, "cdshealpix", || cds(&mut lon, &mut lat));
    });
    each(c, "pix2ang_nested", |group, p| {
        let layer = cds::get(depth(p.nside));
        let cds = |lon: &mut [f64], lat: &mut [f64]| {
            for ((&pixel, lon), lat) in black_box(&p.nested).iter().zip(lon).zip(lat) {
                (*lon, *lat) = layer.center(pixel);
            }
        };
        cds(&mut lon, &mut lat);
        levels(group, p.nside, |level| {
            nested::pix2ang_into(level, p.nside, &p.nested, &mut theta, &mut phi).expect("pixels");
        });
        same(&theta, &phi, &lat, &lon);
        time(group, p.nside, "cdshealpix", || cds(&mut lon, &mut lat));
    });
}

fn pix2vec(c: &mut Criterion) {
    let mut out = [vec![0.0; N], vec![0.0; N], vec![0.0; N]];
    let check = |out: &[Vec<f64>; 3], scalar: &dyn Fn(usize) -> [f64; 3]| {
        let [x, y, z] = out;
        assert!((0..N).all(|k| close(&[x[k], y[k], z[k]], &scalar(k))));
    };
    each(c, "pix2vec_ring", |group, p| {
        levels(group, p.nside, |level| {
            let out = out.each_mut().map(|x| x.as_mut_slice());
            ring::pix2vec_into(level, p.nside, &p.ring, out).expect("pixels");
        });
        check(&out, &|k| ring::pix2vec(p.nside, p.ring[k]).expect("pixel"));
    });
    each(c, "pix2vec_nested", |group, p| {
        levels(group, p.nside, |level| {
            let out = out.each_mut().map(|x| x.as_mut_slice());
            nested::pix2vec_into(level, p.nside, &p.nested, out).expect("pixels");
        });
        check(&out, &|k| {
            nested::pix2vec(p.nside, p.nested[k]).expect("pixel")
        });
    });
}

fn orders(c: &mut Criterion) {
    let mut out = vec![0; N];
    let mut theirs = vec![0; N];
    each(c, "ring2nest", |group, p| {
        let layer = cds::get(depth(p.nside));
        let cds = |out: &mut [u64]| {
            for (out, &pixel) in out.iter_mut().zip(black_box(&p.ring)) {
                *out = layer.from_ring(pixel);
            }
        };
        levels(group, p.nside, |level| {
            ring2nest_into(level, p.nside, &p.ring, &mut out).expect("pixels");
        });
        time(group, p.nside, "scalar", || {
            for (out, &pixel) in theirs.iter_mut().zip(&p.ring) {
                *out = ring2nest(p.nside, pixel).expect("pixel");
            }
        });
        cds(&mut theirs);
        assert!(out == p.nested && out == theirs);
        time(group, p.nside, "cdshealpix", || cds(&mut theirs));
    });
    each(c, "nest2ring", |group, p| {
        let layer = cds::get(depth(p.nside));
        let cds = |out: &mut [u64]| {
            for (out, &pixel) in out.iter_mut().zip(black_box(&p.nested)) {
                *out = layer.to_ring(pixel);
            }
        };
        levels(group, p.nside, |level| {
            nest2ring_into(level, p.nside, &p.nested, &mut out).expect("pixels");
        });
        time(group, p.nside, "scalar", || {
            for (out, &pixel) in theirs.iter_mut().zip(&p.nested) {
                *out = nest2ring(p.nside, pixel).expect("pixel");
            }
        });
        cds(&mut theirs);
        assert!(out == p.ring && out == theirs);
        time(group, p.nside, "cdshealpix", || cds(&mut theirs));
    });
}

fn neighbours(c: &mut Criterion) {
    let mut out: [Vec<u64>; 8] = std::array::from_fn(|_| vec![0; N]);
    let mut theirs = out.clone();
    each(c, "neighbours_ring", |group, p| {
        levels(group, p.nside, |level| {
            let out = out.each_mut().map(|x| x.as_mut_slice());
            ring::neighbours_into(level, p.nside, &p.ring, out).expect("pixels");
        });
        assert!((0..N).all(|k| {
            let scalar = ring::neighbours(p.nside, p.ring[k]).expect("pixel");
            scalar.map(|q| q.unwrap_or(NO_PIXEL)) == out.each_ref().map(|plane| plane[k])
        }));
    });
    each(c, "neighbours_nested", |group, p| {
        let layer = cds::get(depth(p.nside));
        let cds = |out: &mut [Vec<u64>; 8]| {
            for (k, &pixel) in black_box(&p.nested).iter().enumerate() {
                let map = layer.neighbours(pixel, false);
                for (plane, wind) in out.iter_mut().zip(WINDS) {
                    plane[k] = map.get(wind).copied().unwrap_or(NO_PIXEL);
                }
            }
        };
        levels(group, p.nside, |level| {
            let out = out.each_mut().map(|x| x.as_mut_slice());
            nested::neighbours_into(level, p.nside, &p.nested, out).expect("pixels");
        });
        cds(&mut theirs);
        assert!(out == theirs);
        time(group, p.nside, "cdshealpix", || cds(&mut theirs));
    });
}

fn interpolation(c: &mut Criterion) {
    let mut pixels: [Vec<u64>; 4] = std::array::from_fn(|_| vec![0; N]);
    let mut weights: [Vec<f64>; 4] = std::array::from_fn(|_| vec![0.0; N]);
    for (name, is_nested) in [
        ("interpolation_ring", false),
        ("interpolation_nested", true),
    ] {
        each(c, name, |group, p| {
            let run = if is_nested {
                interp::nested_into
            } else {
                interp::ring_into
            };
            levels(group, p.nside, |level| {
                let pixels = pixels.each_mut().map(|x| x.as_mut_slice());
                let weights = weights.each_mut().map(|x| x.as_mut_slice());
                run(level, p.nside, &p.theta, &p.phi, pixels, weights).expect("angles");
            });
            let scalar = if is_nested {
                interp::nested
            } else {
                interp::ring
            };
            let tolerance = 1e-14 * p.nside.get() as f64;
            assert!((0..N).all(|k| {
                let stencil = scalar(p.nside, p.theta[k], p.phi[k]).expect("angles");
                (0..4).all(|i| {
                    // At the edge of a cell the pixels may change, but not those with weight.
                    let difference = if stencil.pixels[i] == pixels[i][k] {
                        weights[i][k] - stencil.weights[i]
                    } else {
                        weights[i][k].min(1.0 - weights[i][k])
                    };
                    difference.abs() < tolerance
                })
            }));
        });
    }
}

fn maps(c: &mut Criterion) {
    for name in ["map_to_nested", "map_to_ring"] {
        let mut group = c.benchmark_group(name);
        group.sample_size(10);
        for nside in [64, 2048] {
            let nside = Nside::new(nside).expect("nside");
            let npix = usize::try_from(nside.npix()).expect("npix");
            let map: Vec<f64> = (0..npix).map(|p| (p as f64).sqrt()).collect();
            let mut out = vec![0.0; npix];
            group.throughput(Throughput::Elements(npix as u64));
            let nested_out = name == "map_to_nested";
            levels(&mut group, nside, |level| {
                let run = if nested_out { to_nested } else { to_ring };
                run(level, nside, &map, &mut out).expect("map");
            });
            let place = if nested_out { ring2nest } else { nest2ring };
            assert!(
                (0..nside.npix())
                    .step_by(997)
                    .all(|p| { out[place(nside, p).expect("pixel") as usize] == map[p as usize] })
            );
        }
        group.finish();
    }
}

fn degrade(c: &mut Criterion) {
    let mut group = c.benchmark_group("degrade");
    group.sample_size(10);
    for nside in [64, 2048] {
        let fine = Nside::new(nside).expect("nside");
        let coarse = Nside::new(nside / 4).expect("nside");
        let length = |nside: Nside| usize::try_from(nside.npix()).expect("npix");
        let map: Vec<f64> = (0..length(fine)).map(|p| p as f64).collect();
        let mut out = vec![0.0; length(coarse)];
        group.throughput(Throughput::Elements(fine.npix()));
        levels(&mut group, fine, |level| {
            degrade_ring(level, fine, coarse, &map, &mut out).expect("map");
        });
        assert!((0..coarse.npix()).step_by(997).all(|p| {
            let first = 16 * ring2nest(coarse, p).expect("pixel");
            let mean = (first..first + 16)
                .map(|q| map[nest2ring(fine, q).expect("pixel") as usize])
                .sum::<f64>()
                / 16.0;
            (mean - out[p as usize]).abs() <= 1e-14 * mean
        }));
    }
    group.finish();
}

fn discs(c: &mut Criterion) {
    for radius in [0.02, 1.0, 60.0_f64] {
        let mut group = c.benchmark_group(format!("disc {radius}"));
        for nside in NSIDES {
            let p = Points::new(Nside::new(nside).expect("nside"));
            // A disc of 1° holds 10⁹ of the finest pixels.
            if radius > 0.02 && nside > 2048 {
                continue;
            }
            let radius = radius.to_radians();
            let (theta, phi) = (p.theta[0], p.phi[0]);
            let centre = Location::from_ang(theta, phi).expect("angles");
            let count = |ranges: &[Range<u64>]| ranges.iter().map(|r| r.end - r.start).sum::<u64>();
            let mut ranges: Vec<Range<u64>> = vec![];
            group.throughput(Throughput::Elements(1));
            levels(&mut group, p.nside, |level| {
                ranges.clear();
                let add = |r| ranges.push(r);
                disc::ring_ranges(level, p.nside, centre, radius, Default::default(), add)
                    .expect("disc");
            });
            let pixels = count(&ranges);
            for level in Level::available() {
                let mut nested = || {
                    ranges.clear();
                    let add = |r| ranges.push(r);
                    let inclusion = disc::Inclusion::Centres;
                    disc::nested_ranges(level, p.nside, centre, radius, inclusion, add)
                        .expect("disc");
                };
                nested();
                time(&mut group, p.nside, &format!("{level} nested"), nested);
            }
            assert_eq!(count(&ranges), pixels);
            let cds = || {
                let lat = PI / 2.0 - theta;
                cds::cone_coverage_centers(depth(p.nside), phi, lat, radius).to_ranges()
            };
            assert_eq!(count(&cds()), pixels);
            time(&mut group, p.nside, "cdshealpix nested", || {
                black_box(cds());
            });
        }
        group.finish();
    }
}

criterion_group!(
    benches,
    ang2pix,
    vec2pix,
    pix2ang,
    pix2vec,
    orders,
    neighbours,
    interpolation,
    maps,
    degrade,
    discs
);
criterion_main!(benches);
