//! Numbers of maps and spectra, as the figures and their tables need them.

use crate::kernels::healpix::missing::is_missing;
use crate::plot::Curve;

/// Statistics of a map over its valid pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Statistics {
    pub(super) mean: f64,
    pub(super) std: f64,
    pub(super) min: f64,
    pub(super) median: f64,
    pub(super) max: f64,
    pub(super) missing: usize,
}

/// Columns of a file of [`Statistics::row`]s, the name of the map first.
pub(super) const STATISTICS: [&str; 7] = [
    "map",
    "mean",
    "std",
    "min",
    "median",
    "max",
    "missing_pixels",
];

impl Statistics {
    pub(super) fn of(map: &[f64]) -> Self {
        let mut valid: Vec<f64> = map.iter().copied().filter(|x| !is_missing(*x)).collect();
        let n = valid.len() as f64;
        let mean = valid.iter().sum::<f64>() / n;
        let square = valid.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        valid.sort_unstable_by(f64::total_cmp);
        let at = |index: usize| valid.get(index).copied().unwrap_or(f64::NAN);
        let middle = valid.len() / 2;
        let median = if valid.len().is_multiple_of(2) && middle > 0 {
            0.5 * (at(middle - 1) + at(middle))
        } else {
            at(middle)
        };
        Self {
            mean,
            std: square.sqrt(),
            min: at(0),
            median,
            max: at(valid.len().saturating_sub(1)),
            missing: map.len() - valid.len(),
        }
    }

    pub(super) fn row(&self) -> Vec<f64> {
        vec![
            self.mean,
            self.std,
            self.min,
            self.median,
            self.max,
            self.missing as f64,
        ]
    }
}

/// A spectrum as a curve: means over bands that widen with l, each at its middle. Single multipoles scatter too much to be
/// read; the files hold them all.
pub(super) fn curve(label: &str, colour: usize, c: &[f64], to: usize) -> Curve {
    let points = bands(2, to.min(c.len().saturating_sub(1))).map(|(lo, hi)| {
        let (mut sum, mut weight) = (0.0, 0.0);
        for (l, c) in c.iter().enumerate().take(hi + 1).skip(lo) {
            let w = (2 * l + 1) as f64;
            sum += w * c;
            weight += w;
        }
        (0.5 * (lo + hi) as f64, sum / weight)
    });
    Curve::new(label, colour, points.collect())
}

/// Bands of multipoles for display, a tenth of l wide.
fn bands(from: usize, to: usize) -> impl Iterator<Item = (usize, usize)> {
    let mut lo = from;
    std::iter::from_fn(move || {
        (lo <= to).then(|| {
            let hi = (lo + lo / 10).min(to);
            let band = (lo, hi);
            lo = hi + 1;
            band
        })
    })
}

/// C_l^XY / √(C_l^XX C_l^YY); zero where a spectrum is not positive.
pub(super) fn correlation(xy: &[f64], xx: &[f64], yy: &[f64]) -> Vec<f64> {
    xy.iter()
        .zip(xx)
        .zip(yy)
        .map(|((xy, xx), yy)| {
            if *xx > 0.0 && *yy > 0.0 {
                xy / (xx.sqrt() * yy.sqrt())
            } else {
                0.0
            }
        })
        .collect()
}

/// Mean over the multipoles for which `wanted` holds, weighted by 2l + 1; NaN where there is none.
pub(super) fn mean_over_l(c: &[f64], wanted: impl Fn(usize) -> bool) -> f64 {
    let (mut sum, mut weight) = (0.0, 0.0);
    for (l, c) in c.iter().enumerate().filter(|(l, _)| wanted(*l)) {
        let w = (2 * l + 1) as f64;
        sum += w * c;
        weight += w;
    }
    sum / weight
}

/// Rows of a file of spectra: l, then the value of each at l.
pub(super) fn by_l(spectra: &[&[f64]]) -> Vec<Vec<f64>> {
    let lmax = spectra.iter().map(|c| c.len()).max().unwrap_or(0);
    (0..lmax)
        .map(|l| {
            let values = spectra
                .iter()
                .map(|c| c.get(l).copied().unwrap_or(f64::NAN));
            std::iter::once(l as f64).chain(values).collect()
        })
        .collect()
}

/// Counts of values in `bins` equal bins from `low` to `high`, and the edges of the bins; others are not counted.
pub(super) fn histogram(
    values: impl Iterator<Item = f64>,
    low: f64,
    high: f64,
    bins: usize,
) -> (Vec<f64>, Vec<f64>) {
    let mut counts = vec![0.0; bins];
    for value in values {
        let place = (value - low) / (high - low) * bins as f64;
        if (0.0..bins as f64).contains(&place) {
            counts[place as usize] += 1.0;
        }
    }
    let edges = (0..=bins).map(|i| low + (high - low) * i as f64 / bins as f64);
    (edges.collect(), counts)
}
