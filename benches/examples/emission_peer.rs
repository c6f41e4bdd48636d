//! The emission kernels and the fit of this project, for comparison with others: see `benches/peers/mbb.py`, `fit.py`.
//!
//! ```text
//! emission_peer mbb FILE NPIX LAYERS     FILE: per layer I, Q, U, T, beta, raw f64
//! emission_peer fit FILE NPIX            FILE: intensities at 353, 545, 857, 2997.92458 GHz, raw f64
//! ```
//! Reads requests on stdin, one a line, and answers each with one JSON line:
//!
//! ```text
//! list THREADS LEVEL NU...      I, Q, U of all layers at each frequency: time in ms
//! band THREADS LEVEL NU...      the mean over the frequencies as one band
//! fit THREADS LEVEL             tau, T, beta of every pixel: time in ms, counts
//! write PATH                    the last result, raw f64
//! ```

use dust3d_kernels::fit::mbb::{FitCounts, MbbFit, fit_into};
use dust3d_kernels::planck::mbb::{MbbLayer, MbbNode, mbb_layers_into};
use dust3d_kernels::simd::Level;
use dust3d_kernels::units::NU0_GHZ;
use std::io::{BufRead, Write};
use std::time::Instant;

/// Pixels of a chunk, as in the command.
const CHUNK: usize = dust3d::parallel::CHUNK;

/// As in the command: maps are aligned, and what is freed is used again.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn read(path: &str) -> Vec<f64> {
    let bytes = std::fs::read(path).expect("input file");
    let (chunks, _) = bytes.as_chunks::<8>();
    chunks.iter().map(|b| f64::from_le_bytes(*b)).collect()
}

/// Splits every map of `out` into chunks and deals them out to threads.
fn in_chunks(out: &mut [Vec<f64>], threads: usize, run: impl Fn(usize, &mut [&mut [f64]]) + Sync) {
    let pieces = out.first().map_or(0, |m| m.len().div_ceil(CHUNK));
    let mut chunks: Vec<Vec<&mut [f64]>> = (0..pieces).map(|_| vec![]).collect();
    for map in out {
        for (list, chunk) in chunks.iter_mut().zip(map.chunks_mut(CHUNK)) {
            list.push(chunk);
        }
    }
    let share = pieces.div_ceil(threads).max(1);
    std::thread::scope(|scope| {
        let run = &run;
        let mut parts = chunks.chunks_mut(share).enumerate();
        let first = parts.next();
        for (k, part) in parts {
            scope.spawn(move || work(part, k * share, run));
        }
        if let Some((k, part)) = first {
            work(part, k * share, run);
        }
    });
}

fn work(part: &mut [Vec<&mut [f64]>], first: usize, run: &impl Fn(usize, &mut [&mut [f64]])) {
    for (k, maps) in part.iter_mut().enumerate() {
        run((first + k) * CHUNK, maps);
    }
}

fn emission(
    data: &[f64],
    npix: usize,
    band: bool,
    threads: usize,
    level: Level,
    nu: &[f64],
    out: &mut [Vec<f64>],
) {
    let n = nu.len() as f64;
    let weight = if band { 1.0 / n } else { 1.0 };
    let nodes: Vec<MbbNode> = nu
        .iter()
        .map(|&nu| MbbNode::new(nu, NU0_GHZ, weight).expect("frequency"))
        .collect();
    let bands: Vec<&[MbbNode]> = if band {
        vec![&nodes]
    } else {
        nodes.iter().map(std::slice::from_ref).collect()
    };
    in_chunks(out, threads, |start, maps| {
        let length = maps[0].len();
        let layers: Vec<MbbLayer<'_, f64, 3>> = data
            .chunks_exact(5 * npix)
            .map(|layer| {
                let map = |k: usize| &layer[k * npix + start..k * npix + start + length];
                MbbLayer {
                    templates: [map(0), map(1), map(2)],
                    t: map(3),
                    beta: map(4),
                }
            })
            .collect();
        mbb_layers_into(level, &bands, &layers, maps).expect("lengths");
    });
}

fn fit(data: &[f64], npix: usize, threads: usize, level: Level, out: &mut [Vec<f64>]) -> FitCounts {
    let fit = MbbFit::default();
    let total = std::sync::Mutex::new(FitCounts::default());
    in_chunks(out, threads, |start, maps| {
        let [tau, t, beta] = maps else { return };
        let n = tau.len();
        let pieces: [&[f64]; 4] =
            std::array::from_fn(|f| &data[f * npix + start..f * npix + start + n]);
        let counts = fit_into(level, &fit, &pieces, tau, t, beta, None).expect("lengths");
        *total.lock().expect("no panic") += counts;
    });
    total.into_inner().expect("no panic")
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let data = read(&arguments[2]);
    let npix: usize = arguments[3].parse().expect("NPIX");
    // Grows only: pages fresh from the system cost as much as what is computed on them.
    let mut all: Vec<Vec<f64>> = vec![];
    let mut used = 0;
    for line in std::io::stdin().lock().lines() {
        let line = line.expect("stdin");
        let words: Vec<&str> = line.split_whitespace().collect();
        let answer = match words.as_slice() {
            ["write", path] => {
                let bytes: Vec<u8> = all[..used]
                    .iter()
                    .flatten()
                    .flat_map(|x| x.to_le_bytes())
                    .collect();
                std::fs::write(path, bytes).expect("output file");
                "{}".to_owned()
            }
            [job, threads, level, nu @ ..] => {
                let threads: usize = threads.parse().expect("THREADS");
                let level = if *level == "best" {
                    Level::detect()
                } else {
                    Level::by_name(level).expect("LEVEL")
                };
                let nu: Vec<f64> = nu.iter().map(|x| x.parse().expect("NU")).collect();
                used = match *job {
                    "list" => 3 * nu.len(),
                    _ => 3,
                };
                all.resize_with(used.max(all.len()), || vec![0.0; npix]);
                let out = &mut all[..used];
                let start = Instant::now();
                let counts = match *job {
                    "fit" => Some(fit(&data, npix, threads, level, out)),
                    _ => {
                        emission(&data, npix, *job == "band", threads, level, &nu, out);
                        None
                    }
                };
                let ms = start.elapsed().as_secs_f64() * 1e3;
                let fitted = counts.map_or(0, |c| c.fitted);
                format!("{{\"ms\": {ms}, \"level\": \"{level}\", \"fitted\": {fitted}}}")
            }
            _ => break,
        };
        println!("{answer}");
        std::io::stdout().flush().expect("stdout");
    }
}
