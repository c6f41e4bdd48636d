//! What this machine can do at most: multiply-adds and reads per second, at every level and number of threads.
//!
//! `cargo run --release -p dust3d-benches --example limits`
//!
//! The fractions of the hardware limit in `benches/README.md` are relative to these. Best of several rounds.

use dust3d_kernels::dispatch;
use dust3d_kernels::simd::{Lanes, Level};
use std::hint::black_box;
use std::time::Instant;

/// Independent chains of multiply-adds: more than latency times units.
const CHAINS: usize = 12;
const STEPS: usize = 1 << 20;
const ROUNDS: usize = 7;

#[inline(always)]
fn multiply_adds<L: Lanes>(token: L::Token, start: f64) -> f64 {
    let (a, b) = (L::splat(token, 0.999_999), L::splat(token, 1e-6));
    let mut chains = [L::splat(token, start); CHAINS];
    for _ in 0..STEPS {
        for x in &mut chains {
            *x = x.mul_add(a, b);
        }
    }
    let mut sum = L::splat(token, 0.0);
    for x in chains {
        sum += x;
    }
    sum.reduce_sum()
}

#[inline(always)]
fn read<L: Lanes>(token: L::Token, from: &[[f64; 8]]) -> f64 {
    let mut sums = [L::splat(token, 0.0); 8];
    for eight in from.as_chunks::<8>().0 {
        for (sum, x) in sums.iter_mut().zip(eight) {
            *sum += L::load(token, x);
        }
    }
    let mut all = L::splat(token, 0.0);
    for sum in sums {
        all += sum;
    }
    all.reduce_sum()
}

/// The least time of `ROUNDS` in which all threads do their work side by side, seconds.
fn best(threads: usize, work: impl Fn(usize) + Sync) -> f64 {
    let round = || {
        let start = Instant::now();
        std::thread::scope(|scope| {
            for k in 1..threads {
                let work = &work;
                scope.spawn(move || work(k));
            }
            work(0);
        });
        start.elapsed().as_secs_f64()
    };
    (0..ROUNDS).map(|_| round()).fold(f64::INFINITY, f64::min)
}

fn main() {
    let all = std::thread::available_parallelism().map_or(1, usize::from);
    println!("level      threads  G vector multiply-adds/s  GFLOP/s");
    for level in Level::available() {
        for threads in if all > 1 { vec![1, all] } else { vec![1] } {
            let seconds = best(threads, |_| {
                let sum = dispatch!(level, |token: L| multiply_adds::<L>(token, black_box(1.0)));
                black_box(sum);
            });
            let rate = (threads * CHAINS * STEPS) as f64 / seconds * 1e-9;
            println!(
                "{:10} {threads:7} {rate:25.2} {:8.1}",
                level.name(),
                16.0 * rate
            );
        }
    }
    println!("\nread from  threads  GB/s, {}", Level::detect().name());
    // Per thread: in the first cache, in the second, in memory.
    for (name, bytes) in [
        ("24 KiB", 24 << 10),
        ("1 MiB", 1 << 20),
        ("memory", 256 << 20),
    ] {
        let maps: Vec<Vec<[f64; 8]>> = vec![vec![[1.0; 8]; bytes / 64]; all];
        let repeats = ((1 << 28) / bytes).max(1);
        for threads in if all > 1 { vec![1, all] } else { vec![1] } {
            let seconds = best(threads, |k| {
                for _ in 0..repeats {
                    let sum = dispatch!(Level::detect(), |token: L| read::<L>(
                        token,
                        black_box(&maps[k])
                    ));
                    black_box(sum);
                }
            });
            let rate = (threads * repeats * bytes) as f64 / seconds * 1e-9;
            println!("{name:10} {threads:7} {rate:5.1}");
        }
    }
}
