//! The transforms of this project, for comparison with others: see `benches/peers/sht.py`.
//!
//! ```text
//! sht_peer time NSIDE LMAX THREADS REPEATS [LEVEL]    one JSON line per transform: best time in ms
//! sht_peer serve                                      the same, requests on stdin, one a line
//! sht_peer synth|adjoint|analysis SPIN NSIDE LMAX THREADS LEVEL IN OUT
//! ```
//! Files hold raw f64: maps, or coefficients as (re, im); for spin 2 the two sets one after the other.

use dust3d::kernels::healpix::Nside;
use dust3d::kernels::simd::Level;
use dust3d::sht::{Analysis, ShtPlan};
use num_complex::Complex;
use std::io::{BufRead, Write};
use std::time::Instant;

type Alm = Complex<f64>;

fn read(path: &str) -> Vec<f64> {
    let bytes = std::fs::read(path).expect("input file");
    bytes
        .as_chunks::<8>()
        .0
        .iter()
        .map(|b| f64::from_le_bytes(*b))
        .collect()
}

fn write(path: &str, data: impl Iterator<Item = f64>) {
    let bytes: Vec<u8> = data.flat_map(f64::to_le_bytes).collect();
    std::fs::write(path, bytes).expect("output file");
}

fn complex(x: &[f64]) -> Vec<Alm> {
    x.as_chunks::<2>()
        .0
        .iter()
        .map(|c| Complex::new(c[0], c[1]))
        .collect()
}

/// Milliseconds this thread has run (Linux): unlike wall time not spoilt by other programs. One thread only.
fn thread_ms() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_whitespace().next()?.parse::<f64>().ok()? * 1e-6)
}

/// Best of `repeats` runs in ms after one that is not counted; with `SHT_CPU` set, their mean CPU time instead.
fn best(repeats: usize, mut run: impl FnMut()) -> f64 {
    run();
    if std::env::var_os("SHT_CPU").is_some()
        && let Some(start) = thread_ms()
    {
        for _ in 0..repeats {
            run();
        }
        return (thread_ms().unwrap_or(f64::NAN) - start) / repeats as f64;
    }
    dust3d_benches::best(repeats, run)
}

/// What to time.
struct Request {
    nside: u64,
    lmax: usize,
    threads: usize,
    repeats: usize,
    level: Level,
    what: String,
}

impl Request {
    fn parse(words: &[&str]) -> Option<Self> {
        Some(Self {
            nside: words.first()?.parse().ok()?,
            lmax: words.get(1)?.parse().ok()?,
            threads: words.get(2)?.parse().ok()?,
            repeats: words.get(3)?.parse().ok()?,
            level: match words.get(4) {
                None | Some(&"best") => Level::detect(),
                Some(name) => Level::by_name(name)?,
            },
            what: words.get(5).unwrap_or(&"all").to_string(),
        })
    }

    fn wants(&self, what: &str) -> bool {
        self.what == "all" || self.what == what
    }

    fn time(&self) {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads)
            .build()
            .expect("threads");
        pool.install(|| self.run());
    }

    fn report(&self, what: &str, ms: f64) {
        println!(
            "{{\"what\":\"{what}\",\"nside\":{},\"lmax\":{},\"threads\":{},\"level\":\"{}\",\"ms\":{ms:.4}}}",
            self.nside, self.lmax, self.threads, self.level
        );
        let _ = std::io::stdout().flush();
    }

    fn run(&self) {
        let nside = Nside::new(self.nside).expect("nside");
        let start = Instant::now();
        let mut plan = ShtPlan::new(nside, self.lmax, self.level).expect("plan");
        if self.wants("plan") {
            self.report("plan", start.elapsed().as_secs_f64() * 1e3);
        }
        let mut numbers = dust3d_benches::random(1);
        let mut random = || numbers() - 0.5;
        let (na, np) = (plan.alm_len(), plan.npix());
        let mut alm = |_| -> Vec<Alm> {
            (0..na)
                .map(|k| Complex::new(random(), if k <= self.lmax { 0.0 } else { random() }))
                .collect()
        };
        let mut alms: Vec<_> = (0..3).map(&mut alm).collect();
        let mut maps = vec![vec![0.0; np]; 3];
        let r = self.repeats;
        let [t, e, b] = &mut alms[..] else { return };
        let [i, q, u] = &mut maps[..] else { return };
        if self.wants("synthesis0") {
            let ms = best(r, || plan.synthesis(t, i).expect("lengths"));
            self.report("synthesis0", ms);
        }
        if self.wants("adjoint0") {
            i.fill(1.0);
            let ms = best(r, || plan.adjoint_synthesis(i, t).expect("lengths"));
            self.report("adjoint0", ms);
        }
        if self.wants("synthesis2") {
            let ms = best(r, || plan.synthesis_spin2(e, b, q, u).expect("lengths"));
            self.report("synthesis2", ms);
        }
        if self.wants("adjoint2") {
            let ms = best(r, || {
                plan.adjoint_synthesis_spin2(q, u, e, b).expect("lengths");
            });
            self.report("adjoint2", ms);
        }
        if self.wants("synthesis_iqu") {
            let ms = best(r, || {
                plan.synthesis_mixed(&[t], &[[e, b]], &mut [i], &mut [[q, u]])
                    .expect("lengths");
            });
            self.report("synthesis_iqu", ms);
        }
        if self.wants("adjoint_iqu") {
            let ms = best(r, || {
                plan.adjoint_synthesis_mixed(&[i], &[[q, u]], &mut [t], &mut [[e, b]])
                    .expect("lengths");
            });
            self.report("adjoint_iqu", ms);
        }
        if self.what == "synthesis_iqu6" || self.what == "adjoint_iqu6" {
            let mut a: Vec<_> = (0..18).map(&mut alm).collect();
            let mut m = vec![vec![0.0; np]; 18];
            let (ta, ea) = a.split_at_mut(6);
            let (im, qm) = m.split_at_mut(6);
            let what = self.what.clone();
            let ms = best(r, || {
                if what == "synthesis_iqu6" {
                    let t: Vec<&[Alm]> = ta.iter().map(|a| &a[..]).collect();
                    let e: Vec<[&[Alm]; 2]> = ea
                        .as_chunks::<2>()
                        .0
                        .iter()
                        .map(|[a, b]| [&a[..], &b[..]])
                        .collect();
                    let mut i: Vec<&mut [f64]> = im.iter_mut().map(|m| &mut m[..]).collect();
                    let mut q: Vec<[&mut [f64]; 2]> = qm
                        .as_chunks_mut::<2>()
                        .0
                        .iter_mut()
                        .map(|[a, b]| [&mut a[..], &mut b[..]])
                        .collect();
                    plan.synthesis_mixed(&t, &e, &mut i, &mut q)
                        .expect("lengths");
                } else {
                    let i: Vec<&[f64]> = im.iter().map(|a| &a[..]).collect();
                    let q: Vec<[&[f64]; 2]> = qm
                        .as_chunks::<2>()
                        .0
                        .iter()
                        .map(|[a, b]| [&a[..], &b[..]])
                        .collect();
                    let mut t: Vec<&mut [Alm]> = ta.iter_mut().map(|m| &mut m[..]).collect();
                    let mut e: Vec<[&mut [Alm]; 2]> = ea
                        .as_chunks_mut::<2>()
                        .0
                        .iter_mut()
                        .map(|[a, b]| [&mut a[..], &mut b[..]])
                        .collect();
                    plan.adjoint_synthesis_mixed(&i, &q, &mut t, &mut e)
                        .expect("lengths");
                }
            });
            self.report(&what, ms);
        }
    }
}

fn transform(words: &[&str]) -> Option<()> {
    let [what, spin, nside, lmax, threads, level, input, output] = words else {
        return None;
    };
    let nside = Nside::new(nside.parse().ok()?).ok()?;
    let lmax = lmax.parse().ok()?;
    let level = match *level {
        "best" => Level::detect(),
        name => Level::by_name(name)?,
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.parse().ok()?)
        .build()
        .ok()?;
    let data = read(input);
    pool.install(|| {
        let mut plan = ShtPlan::new(nside, lmax, level).expect("plan");
        let sets = if *spin == "0" { 1 } else { 2 };
        if *what == "synth" {
            let alm = complex(&data);
            let mut map = vec![0.0; sets * plan.npix()];
            let (a, b) = alm.split_at(plan.alm_len());
            let (q, u) = map.split_at_mut(plan.npix());
            if sets == 1 {
                plan.synthesis(a, q).expect("lengths");
            } else {
                plan.synthesis_spin2(a, b, q, u).expect("lengths");
            }
            write(output, map.into_iter());
        } else {
            let mut alm = vec![Complex::default(); sets * plan.alm_len()];
            let (q, u) = data.split_at(plan.npix());
            let (a, b) = alm.split_at_mut(plan.alm_len());
            let analysis = match *what {
                "adjoint" => None,
                "analysis" => Some(Analysis::default()),
                "weighted" => Some(Analysis {
                    iterations: 3,
                    ring_weights: true,
                }),
                "quadrature" => Some(Analysis {
                    iterations: 0,
                    ring_weights: true,
                }),
                _ => {
                    let c = if sets == 1 {
                        plan.analysis_to_accuracy(q, a, 1e-12, 50)
                    } else {
                        plan.analysis_spin2_to_accuracy(q, u, a, b, 1e-12, 50)
                    };
                    eprintln!("{:?}", c.expect("lengths"));
                    write(output, alm.into_iter().flat_map(|c| [c.re, c.im]));
                    return;
                }
            };
            match (sets, analysis) {
                (1, None) => plan.adjoint_synthesis(q, a),
                (1, Some(how)) => plan.analysis(q, a, &how),
                (_, None) => plan.adjoint_synthesis_spin2(q, u, a, b),
                (_, Some(how)) => plan.analysis_spin2(q, u, a, b, &how),
            }
            .expect("lengths");
            write(output, alm.into_iter().flat_map(|c| [c.re, c.im]));
        }
    });
    Some(())
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let done = match words.first() {
        Some(&"time") => Request::parse(&words[1..]).map(|r| r.time()),
        Some(&"serve") => {
            for line in std::io::stdin().lock().lines().map_while(Result::ok) {
                let words: Vec<&str> = line.split_whitespace().collect();
                if let Some(request) = Request::parse(&words) {
                    request.time();
                }
                println!("done");
                let _ = std::io::stdout().flush();
            }
            Some(())
        }
        Some(_) => transform(&words),
        None => None,
    };
    if done.is_none() {
        eprintln!("see the head of benches/examples/sht_peer.rs");
        std::process::exit(2);
    }
}
