//! From values to positions on the colour bar.

use crate::kernels::healpix::missing::is_missing;

/// How values are spread over the colours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// Evenly from `min` to `max`.
    Linear {
        /// Value of the first colour.
        min: f64,
        /// Value of the last colour.
        max: f64,
    },
    /// By sign(v) log(1 + |v| / threshold): linear near zero, logarithmic beyond the threshold on either side.
    SymLog {
        /// Value of the first colour.
        min: f64,
        /// Value of the last colour.
        max: f64,
        /// Where the logarithm sets in, above 0.
        threshold: f64,
    },
}

impl Scale {
    /// A linear scale over all but the lowest and highest percent of the values.
    #[must_use]
    pub fn linear_of(values: &[f64]) -> Self {
        let sorted = sorted(values.iter().copied());
        let (min, max) = widen(quantile(&sorted, 0.01), quantile(&sorted, 0.99));
        Self::Linear { min, max }
    }

    /// A symmetric-log scale. Of signed values: symmetric about zero, up to the magnitude that one value in two hundred
    /// exceeds, logarithmic from the median magnitude on. Of values without sign: over all but the lowest and highest
    /// half percent, logarithmic from the lowest tenth on.
    #[must_use]
    pub fn symlog_of(values: &[f64]) -> Self {
        let signed = sorted(values.iter().copied());
        let negative = signed.first().is_some_and(|lowest| *lowest < 0.0);
        let magnitudes = if negative {
            sorted(signed.iter().map(|value| value.abs()))
        } else {
            signed
        };
        let mut max = quantile(&magnitudes, 0.995);
        if max <= 0.0 {
            max = magnitudes
                .last()
                .copied()
                .filter(|max| *max > 0.0)
                .unwrap_or(1.0);
        }
        let mut threshold = quantile(&magnitudes, if negative { 0.5 } else { 0.1 });
        if threshold <= 0.0 || threshold > max {
            threshold = max / 100.0;
        }
        let low = quantile(&magnitudes, 0.005);
        Self::SymLog {
            min: if negative {
                -max
            } else if low < max {
                low
            } else {
                0.0
            },
            max,
            threshold,
        }
    }

    /// The same scale with one or both ends replaced.
    #[must_use]
    pub fn with_ends(self, low: Option<f64>, high: Option<f64>) -> Self {
        match self {
            Self::Linear { min, max } => Self::Linear {
                min: low.unwrap_or(min),
                max: high.unwrap_or(max),
            },
            Self::SymLog {
                min,
                max,
                threshold,
            } => Self::SymLog {
                min: low.unwrap_or(min),
                max: high.unwrap_or(max),
                threshold,
            },
        }
    }

    /// The values of the first and the last colour.
    #[must_use]
    pub const fn ends(self) -> (f64, f64) {
        match self {
            Self::Linear { min, max } | Self::SymLog { min, max, .. } => (min, max),
        }
    }

    /// Whether the ends differ in the right order and every number is finite.
    #[must_use]
    pub fn is_valid(self) -> bool {
        let (min, max) = self.ends();
        let ends = min.is_finite() && max.is_finite() && min < max;
        ends && match self {
            Self::Linear { .. } => true,
            Self::SymLog { threshold, .. } => threshold.is_finite() && threshold > 0.0,
        }
    }

    /// The scale made ready for many values.
    pub(super) fn spread(self) -> Spread {
        let (min, max) = self.ends();
        let threshold = match self {
            Self::Linear { .. } => None,
            Self::SymLog { threshold, .. } => Some(threshold),
        };
        let low = stretch(threshold, min);
        Spread {
            threshold,
            low,
            length: stretch(threshold, max) - low,
        }
    }

    /// Values worth a mark and a number on the colour bar, and those worth a small mark; in increasing order.
    pub(super) fn ticks(self) -> (Vec<f64>, Vec<f64>) {
        let (min, max) = self.ends();
        match self {
            Self::Linear { .. } => {
                let step = round_step((max - min) / 6.0);
                let first = (min / step).ceil();
                let count = ((max / step).floor() - first).max(0.0) as usize;
                (
                    (0..=count)
                        .map(|index| (first + index as f64) * step)
                        .collect(),
                    Vec::new(),
                )
            }
            Self::SymLog { threshold, .. } => {
                // Nearer to zero the scale is linear and marks would crowd.
                let (near, far) = (0.6 * threshold, min.abs().max(max.abs()));
                let decades = near.log10().floor() as i32..=far.log10().floor() as i32;
                let few = decades.clone().count() < 4 && min >= 0.0;
                let marked: &[f64] = if few { &[1.0, 2.0, 5.0] } else { &[1.0] };
                let series = |factors: &[f64]| -> Vec<f64> {
                    let sizes: Vec<f64> = decades
                        .clone()
                        .flat_map(|power| factors.iter().map(move |factor| decimal(*factor, power)))
                        .filter(|size| *size >= near)
                        .collect();
                    let negative = sizes.iter().rev().map(|size| -size);
                    let all = negative.chain([0.0]).chain(sizes.iter().copied());
                    all.filter(|value| (min..=max).contains(value)).collect()
                };
                (
                    series(marked),
                    series(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]),
                )
            }
        }
    }
}

/// A [`Scale`] made ready for many values.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spread {
    threshold: Option<f64>,
    low: f64,
    length: f64,
}

impl Spread {
    /// Position of a value, 0 at the first colour and 1 at the last, beyond them outside.
    pub(super) fn position(self, value: f64) -> f64 {
        (stretch(self.threshold, value) - self.low) / self.length
    }
}

fn stretch(threshold: Option<f64>, value: f64) -> f64 {
    threshold.map_or(value, |threshold| {
        (value.abs() / threshold).ln_1p().copysign(value)
    })
}

/// `factor` · 10^`power`, the double nearest to it.
fn decimal(factor: f64, power: i32) -> f64 {
    let size = 10.0_f64.powi(power.abs());
    if power < 0 {
        factor / size
    } else {
        factor * size
    }
}

/// 1, 2 or 5 times a power of ten, at least about `rough`.
pub(super) fn round_step(rough: f64) -> f64 {
    let power = 10.0_f64.powf(rough.log10().floor());
    let factor = [1.0, 2.0, 5.0]
        .into_iter()
        .find(|factor| factor * power >= 0.99 * rough);
    factor.unwrap_or(10.0) * power
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.filter(|value| !is_missing(*value)).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted
}

fn quantile(sorted: &[f64], share: f64) -> f64 {
    let last = sorted.len().saturating_sub(1);
    sorted
        .get((share * last as f64).round() as usize)
        .copied()
        .unwrap_or(0.0)
}

/// Ends that differ, so that a constant map has a picture too.
fn widen(min: f64, max: f64) -> (f64, f64) {
    if min < max {
        (min, max)
    } else {
        let margin = if min == 0.0 { 1.0 } else { 0.1 * min.abs() };
        (min - margin, max + margin)
    }
}
