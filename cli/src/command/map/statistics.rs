//! Mean, spread and range of the valid pixels of a map.

use crate::kernels::healpix::missing::is_missing;

/// Mean, spread and range of the valid pixels of a map; NaN where there is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Statistics {
    pub(super) missing: usize,
    pub(super) min: f64,
    pub(super) max: f64,
    pub(super) mean: f64,
    pub(super) std: f64,
    pub(super) rms: f64,
}

impl Statistics {
    pub(super) fn of(values: &[f64]) -> Self {
        let valid = || values.iter().copied().filter(|value| !is_missing(*value));
        let count = valid().count();
        let mean = valid().sum::<f64>() / count as f64;
        let mean_square =
            |centre: f64| valid().map(|value| (value - centre).powi(2)).sum::<f64>() / count as f64;
        Self {
            missing: values.len() - count,
            min: valid().fold(f64::NAN, f64::min),
            max: valid().fold(f64::NAN, f64::max),
            mean,
            std: mean_square(mean).sqrt(),
            rms: mean_square(0.0).sqrt(),
        }
    }
}
