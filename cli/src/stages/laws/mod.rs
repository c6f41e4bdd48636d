//! Emission laws of the layers: maps of temperature and spectral index (\[MKD18\], section 6).
//!
//! 1. [`spectra`]: spectra of the observed T and β and their correlation,
//! 2. [`mod@draw`]: for each layer a Gaussian pair with these spectra, remapped ([`mod@remap`]) to the observed distributions and
//!    filtered back,
//! 3. [`calibration`]: factors that make the fit of the total ([`sky`]) agree with the observed,
//! 4. [`apply`]: T_i = s_avg T_avg + s_T δT, β_i = β_avg + s_β δβ, with floors.

pub mod calibration;
pub mod draw;
pub mod remap;
pub mod sky;
pub mod spectra;

pub use calibration::{Calibration, CalibrationStatus, calibrate};
pub use draw::draw;
pub use sky::{Factors, FitStats, LawStats, Sky};
pub use spectra::ObservedLaws;

use crate::parallel;

/// Turns fluctuations into a law in place: average + factor·fluctuation, not below `floor`; returns how many pixels
/// were below.
pub fn apply(map: &mut Vec<f64>, average: f64, factor: f64, floor: f64) -> u64 {
    let mut maps = [std::mem::take(map)];
    let counts = parallel::for_columns(&mut maps, |_, mut pieces| {
        let mut count = 0;
        for x in pieces.iter_mut().flat_map(|piece| piece.iter_mut()) {
            count += u64::from(average + factor * *x < floor);
            *x = sky::law(average, factor, *x, floor);
        }
        count
    });
    let [new] = maps;
    *map = new;
    counts.into_iter().sum()
}
