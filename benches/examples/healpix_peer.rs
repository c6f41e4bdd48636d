//! The HEALPix operations of this project, for comparison with others: see `benches/peers/healpix.py`.
//!
//! Reads requests on stdin, one a line, and answers each with one JSON line:
//!
//! ```text
//! points NSIDE FOLDER            theta phi x y z ring nested, raw 8-byte numbers, one file each
//! map NSIDE NSIDE_OUT            a map of `value(p)`
//! time OP ORDER LEVEL REPEATS    best time in ms; OP as in `Job::run`, ORDER ring or nested
//! discs RADIUS ORDER LEVEL REPEATS    around every 8192nd point, rad: time of all, number of discs and of ranges
//! stream REPEATS                 GB/s read and written by a copy of the map
//! write FOLDER                   the last result: p0 … p7 (u64), f0 … f3 (f64), ranges (u64), map (f64)
//! ```

use dust3d_benches::best;
use dust3d_kernels::healpix::resample::{degrade_ring, to_nested, to_ring};
use dust3d_kernels::healpix::{Location, Nside, disc, interp, nest2ring_into, nested};
use dust3d_kernels::healpix::{ring, ring2nest_into};
use dust3d_kernels::simd::Level;
use std::hint::black_box;
use std::io::{BufRead, Write};

fn words(path: &str) -> Vec<u64> {
    let bytes = std::fs::read(path).expect("input file");
    let (chunks, _) = bytes.as_chunks::<8>();
    chunks.iter().map(|b| u64::from_le_bytes(*b)).collect()
}

fn numbers(path: &str) -> Vec<f64> {
    words(path).into_iter().map(f64::from_bits).collect()
}

fn write(path: &str, words: impl Iterator<Item = u64>) {
    let file = std::fs::File::create(path).expect("output file");
    let mut file = std::io::BufWriter::new(file);
    for word in words {
        file.write_all(&word.to_le_bytes()).expect("output file");
    }
}

/// The value of pixel p of the map: whole numbers below 2³², multiplied up and scaled without rounding.
fn value(p: u64) -> f64 {
    ((p.wrapping_mul(2_654_435_761) & 0xffff_ffff) as f64) / 4_294_967_296.0
}

#[derive(Default)]
struct Job {
    nside: Option<Nside>,
    theta: Vec<f64>,
    phi: Vec<f64>,
    xyz: [Vec<f64>; 3],
    ring: Vec<u64>,
    nested: Vec<u64>,
    map_nside: Option<[Nside; 2]>,
    map: Vec<f64>,
    pixels: [Vec<u64>; 8],
    floats: [Vec<f64>; 4],
    ranges: Vec<[u64; 2]>,
    out: Vec<f64>,
}

impl Job {
    fn points(&mut self, nside: &str, folder: &str) {
        self.nside = Some(
            nside
                .parse()
                .map(Nside::new)
                .expect("NSIDE")
                .expect("NSIDE"),
        );
        let file = |name: &str| format!("{folder}/{name}");
        self.theta = numbers(&file("theta"));
        self.phi = numbers(&file("phi"));
        self.xyz = ["x", "y", "z"].map(|name| numbers(&file(name)));
        self.ring = words(&file("ring"));
        self.nested = words(&file("nested"));
        let n = self.theta.len();
        self.pixels = std::array::from_fn(|_| vec![0; n]);
        self.floats = std::array::from_fn(|_| vec![0.0; n]);
    }

    fn map(&mut self, nside: &str, nside_out: &str) {
        let [nside, out] =
            [nside, nside_out].map(|n| n.parse().map(Nside::new).expect("NSIDE").expect("NSIDE"));
        self.map_nside = Some([nside, out]);
        self.map = (0..nside.npix()).map(value).collect();
    }

    fn run(&mut self, what: &str, is_nested: bool, level: Level, repeats: usize) -> f64 {
        let Self {
            theta,
            phi,
            xyz,
            pixels,
            floats,
            map,
            out,
            ..
        } = self;
        let nside = self.nside.expect("points first");
        let ours = if is_nested { &self.nested } else { &self.ring };
        let [x, y, z] = &*xyz;
        let [a, b, c, d] = floats;
        match what {
            "ang2pix" => best(repeats, || {
                let run = if is_nested {
                    nested::ang2pix_into
                } else {
                    ring::ang2pix_into
                };
                run(level, nside, theta, phi, &mut pixels[0]).expect("good input");
            }),
            "vec2pix" => best(repeats, || {
                let run = if is_nested {
                    nested::vec2pix_into
                } else {
                    ring::vec2pix_into
                };
                run(level, nside, [x, y, z], &mut pixels[0]).expect("good input");
            }),
            "pix2ang" => best(repeats, || {
                let run = if is_nested {
                    nested::pix2ang_into
                } else {
                    ring::pix2ang_into
                };
                run(level, nside, ours, a, b).expect("good input");
            }),
            "pix2vec" => best(repeats, || {
                let run = if is_nested {
                    nested::pix2vec_into
                } else {
                    ring::pix2vec_into
                };
                run(level, nside, ours, [a, b, c]).expect("good input");
            }),
            // Named by the order they start from.
            "reorder_pixels" => best(repeats, || {
                let run = if is_nested {
                    nest2ring_into
                } else {
                    ring2nest_into
                };
                run(level, nside, ours, &mut pixels[0]).expect("good input");
            }),
            "neighbours" => best(repeats, || {
                let run = if is_nested {
                    nested::neighbours_into
                } else {
                    ring::neighbours_into
                };
                let planes = pixels.each_mut().map(|p| p.as_mut_slice());
                run(level, nside, ours, planes).expect("good input");
            }),
            "interpolation" => best(repeats, || {
                let run = if is_nested {
                    interp::nested_into
                } else {
                    interp::ring_into
                };
                let [p, q, r, s, ..] = pixels;
                run(level, nside, theta, phi, [p, q, r, s], [a, b, c, d]).expect("good input");
            }),
            "reorder_map" => {
                let [nside, _] = self.map_nside.expect("map first");
                out.resize(map.len(), 0.0);
                best(repeats, || {
                    let run = if is_nested { to_ring } else { to_nested };
                    run(level, nside, map, out).expect("good input");
                })
            }
            "degrade" => {
                let [nside, nside_out] = self.map_nside.expect("map first");
                out.resize(usize::try_from(nside_out.npix()).expect("npix"), 0.0);
                best(repeats, || {
                    degrade_ring(level, nside, nside_out, map, out).expect("good input");
                })
            }
            _ => panic!("no operation {what}"),
        }
    }

    fn discs(
        &mut self,
        radius: f64,
        is_nested: bool,
        level: Level,
        repeats: usize,
    ) -> (f64, usize) {
        let nside = self.nside.expect("points first");
        let centres: Vec<Location> = (self.theta.iter().zip(&self.phi).step_by(8192))
            .map(|(&theta, &phi)| Location::from_ang(theta, phi).expect("good input"))
            .collect();
        let ranges = &mut self.ranges;
        let run = |ranges: &mut Vec<[u64; 2]>, centre| {
            let add = |r: std::ops::Range<u64>| ranges.push([r.start, r.end]);
            if is_nested {
                disc::nested_ranges(level, nside, centre, radius, Default::default(), add)
            } else {
                disc::ring_ranges(level, nside, centre, radius, Default::default(), add)
            }
            .expect("good input");
        };
        // Timed one at a time, as one uses them; then all, to be looked at.
        let ms = best(repeats, || {
            for &centre in &centres {
                ranges.clear();
                run(ranges, centre);
            }
        });
        ranges.clear();
        for &centre in &centres {
            run(ranges, centre);
        }
        (ms, centres.len())
    }

    fn stream(&mut self, repeats: usize) -> f64 {
        let [a, b, ..] = &mut self.floats;
        (*a, *b) = (self.map.clone(), self.map.clone());
        let ms = best(repeats, || {
            b.copy_from_slice(black_box(a));
            black_box(&b);
        });
        (16 * a.len()) as f64 / ms * 1e-6
    }

    fn write(&self, folder: &str) {
        for (k, p) in self.pixels.iter().enumerate() {
            write(&format!("{folder}/p{k}"), p.iter().copied());
        }
        for (k, f) in self.floats.iter().enumerate() {
            write(&format!("{folder}/f{k}"), f.iter().map(|x| x.to_bits()));
        }
        write(
            &format!("{folder}/ranges"),
            self.ranges.iter().flatten().copied(),
        );
        write(
            &format!("{folder}/map"),
            self.out.iter().map(|x| x.to_bits()),
        );
    }
}

fn level_of(name: &str) -> Level {
    if name == "best" {
        Level::detect()
    } else {
        Level::by_name(name).expect("LEVEL")
    }
}

fn main() {
    let mut job = Job::default();
    for line in std::io::stdin().lock().lines() {
        let line = line.expect("stdin");
        let words: Vec<&str> = line.split_whitespace().collect();
        let answer = match words.as_slice() {
            ["points", nside, folder] => {
                job.points(nside, folder);
                "{}".to_owned()
            }
            ["map", nside, nside_out] => {
                job.map(nside, nside_out);
                "{}".to_owned()
            }
            ["time", what, order, level, repeats] => {
                let level = level_of(level);
                let ms = job.run(
                    what,
                    *order == "nested",
                    level,
                    repeats.parse().expect("REPEATS"),
                );
                format!("{{\"ms\": {ms}, \"level\": \"{level}\"}}")
            }
            ["discs", radius, order, level, repeats] => {
                let radius = radius.parse().expect("RADIUS");
                let repeats = repeats.parse().expect("REPEATS");
                let (ms, count) = job.discs(radius, *order == "nested", level_of(level), repeats);
                let ranges = job.ranges.len();
                format!("{{\"ms\": {ms}, \"discs\": {count}, \"ranges\": {ranges}}}")
            }
            ["stream", repeats] => {
                format!(
                    "{{\"gbs\": {}}}",
                    job.stream(repeats.parse().expect("REPEATS"))
                )
            }
            ["write", folder] => {
                job.write(folder);
                "{}".to_owned()
            }
            _ => break,
        };
        println!("{answer}");
        std::io::stdout().flush().expect("stdout");
    }
}
