//! `dust3d map diff`.

use super::super::print;
use super::statistics::Statistics;
use crate::error::{Error, Result};
use crate::io::{MapFile, MapSource, write_map_file};
use crate::kernels::healpix::missing::{MISSING, is_missing};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  dust3d map diff run1/templates/I_1.f64 run2/templates/I_1.f64\n  dust3d map diff a.f64 b.f64 --out difference.f64 --tolerance 1e-11"
)]
pub(in super::super) struct Args {
    /// The map
    #[arg(value_name = "A")]
    first: String,
    /// The map subtracted from it
    #[arg(value_name = "B")]
    second: String,
    /// Also write A − B here (.f32, .f64, .fits or .npy)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Fail (status 1) if rms(A − B) exceeds this multiple of rms(B), or other pixels are missing
    #[arg(long, value_name = "X")]
    tolerance: Option<f64>,
}

pub(super) fn execute(args: &Args) -> Result<()> {
    let a = MapSource::parse(&args.first)?.read()?;
    let b = MapSource::parse(&args.second)?.read()?;
    if a.nside != b.nside {
        return Err(Error::input(format!(
            "`{}` has Nside {} and `{}` has {}; bring them to one Nside first (dust3d map degrade)",
            args.first, a.nside, args.second, b.nside
        )));
    }
    let difference = Difference::of(&a, &b);
    if let Some(path) = &args.out {
        write_map_file(path, &difference.values)?;
    }
    let all = Statistics::of(&difference.values);
    let relative = all.rms / difference.rms_b;
    print(&format!(
        "pixels compared     {}\nmissing in one only {}\nlargest |A - B|     {:e} (pixel {})\nmean A - B          {:e}\nrms A - B           {:e}\nrms A, B            {:e}, {:e}\nrms A - B / rms B   {:e}\ncorrelation         {:.9}\n",
        difference.values.len() - all.missing,
        difference.one_missing,
        all.max.abs().max(all.min.abs()),
        difference.largest,
        all.mean,
        all.rms,
        difference.rms_a,
        difference.rms_b,
        if all.rms == 0.0 { 0.0 } else { relative },
        difference.correlation,
    ))?;
    match args.tolerance {
        Some(tolerance) if difference.one_missing > 0 || all.rms > tolerance * difference.rms_b => {
            Err(Error::input(format!(
                "`{}` and `{}` differ by more than {tolerance:e} of the latter's rms",
                args.first, args.second
            )))
        }
        _ => Ok(()),
    }
}

/// A − B where both have a value, and what belongs to the same pixels.
struct Difference {
    values: Vec<f64>,
    one_missing: usize,
    largest: usize,
    rms_a: f64,
    rms_b: f64,
    correlation: f64,
}

impl Difference {
    fn of(a: &MapFile, b: &MapFile) -> Self {
        let pairs = || a.values.iter().copied().zip(b.values.iter().copied());
        let values: Vec<f64> = pairs()
            .map(|(a, b)| {
                if is_missing(a) || is_missing(b) {
                    MISSING
                } else {
                    a - b
                }
            })
            .collect();
        let both = || pairs().filter(|(a, b)| !is_missing(*a) && !is_missing(*b));
        let size = |value: f64| if is_missing(value) { -1.0 } else { value.abs() };
        let (x, y): (Vec<f64>, Vec<f64>) = both().unzip();
        let (x, y) = (Statistics::of(&x), Statistics::of(&y));
        let covariance = both()
            .map(|(a, b)| (a - x.mean) * (b - y.mean))
            .sum::<f64>()
            / both().count() as f64;
        Self {
            one_missing: pairs()
                .filter(|(a, b)| is_missing(*a) != is_missing(*b))
                .count(),
            largest: (0..values.len())
                .max_by(|&i, &j| size(values[i]).total_cmp(&size(values[j])))
                .unwrap_or(0),
            rms_a: x.rms,
            rms_b: y.rms,
            correlation: covariance / (x.std * y.std),
            values,
        }
    }
}
