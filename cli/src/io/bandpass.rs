//! Bandpass tables: text with two columns, frequency in GHz and weight, or a table of a FITS file.

use super::fits::{self, Selection};
use super::map_file::Container;
use crate::error::{Error, Result};
use std::path::Path;

/// The response of a detector.
#[derive(Debug, Clone, PartialEq)]
pub struct Bandpass {
    /// Frequencies, GHz, increasing.
    pub nu_ghz: Vec<f64>,
    /// Weights as PySM3 takes them: response to power, any normalisation.
    pub weight: Vec<f64>,
}

impl Bandpass {
    /// Reads a table, and gives it a name: that of the file, or of the table in a FITS file (`file.fits[BANDPASS_F143]`),
    /// whose `BANDPASS_` is left out.
    ///
    /// A table in FITS has the columns WAVENUMBER or FREQUENCY (whose TUNIT may be cm⁻¹, m⁻¹, Hz, MHz, GHz, THz; without one, cm⁻¹
    /// and GHz) and TRANSMISSION, RESPONSE or WEIGHT, as the reduced instrument models of Planck have it. Rows up to frequency 0,
    /// with which some tables of a spectrometer begin, are left out.
    ///
    /// # Errors
    /// As [`Bandpass::parse`], or a file that cannot be read.
    pub fn read(spec: &Path) -> Result<(Self, String)> {
        let (path, selection) = fits::parse(spec)?;
        if Container::of(&path) == Some(Container::Fits) {
            return fits::read_bandpass(&path, &selection);
        }
        if selection != Selection::default() {
            return Err(Error::usage(format!(
                "`{}`: a bandpass in a text file is alone in it; leave out {selection}",
                spec.display()
            )));
        }
        let text = std::fs::read_to_string(&path)
            .map_err(|cause| Error::io("read the bandpass", &path, &cause))?;
        let band = Self::parse(&text).map_err(|error| error.within(path.display()))?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        Ok((band, name.into_owned()))
    }

    /// Reads lines of two numbers, apart from empty lines and comments (`#`); columns are separated by blanks or a comma.
    ///
    /// # Errors
    /// A line that is something else, frequencies that decrease, no line at all.
    pub fn parse(text: &str) -> Result<Self> {
        let mut rows: Vec<[f64; 2]> = Vec::new();
        for (number, line) in text.lines().enumerate() {
            let content = line.split('#').next().unwrap_or_default();
            let fields: Vec<&str> = content
                .split([' ', '\t', ','])
                .filter(|field| !field.is_empty())
                .collect();
            let number = number + 1;
            let bad = |what: &str| Error::input(format!("line {number} of the bandpass {what}"));
            let [nu, weight] = match fields.as_slice() {
                [] => continue,
                [nu, weight] => [nu, weight]
                    .map(|field| field.parse::<f64>().ok().filter(|value| value.is_finite())),
                _ => return Err(bad("does not hold two numbers, GHz and weight")),
            };
            let (Some(nu), Some(weight)) = (nu, weight) else {
                return Err(bad("does not hold two numbers, GHz and weight"));
            };
            if nu <= 0.0 || rows.last().is_some_and(|[before, _]| nu < *before) {
                return Err(bad(
                    "has a frequency that is not above 0, or below the one before; sort the table, in GHz",
                ));
            }
            rows.push([nu, weight]);
        }
        if rows.is_empty() {
            return Err(Error::input(
                "the bandpass has no line; it needs two columns, GHz and weight",
            ));
        }
        Ok(Self::of_rows(&rows))
    }

    /// The table of rows (GHz, weight) whose frequencies do not decrease.
    ///
    /// Where one frequency is there twice, the response has a step. To the trapezoid rule that is one row with the mean of
    /// the two sides, each weighted by the interval on its side.
    pub(super) fn of_rows(rows: &[[f64; 2]]) -> Self {
        let mut band = Self {
            nu_ghz: Vec::new(),
            weight: Vec::new(),
        };
        let mut rest = rows;
        while let Some(&[nu, first]) = rest.first() {
            let count = rest.iter().take_while(|row| row[0] == nu).count();
            let (same, after) = rest.split_at(count);
            let last = same.last().map_or(first, |row| row[1]);
            let left = band.nu_ghz.last().map_or(0.0, |before| nu - before);
            let right = after.first().map_or(0.0, |row| row[0] - nu);
            let weight = if first == last || left + right == 0.0 {
                last
            } else {
                (first * left + last * right) / (left + right)
            };
            band.nu_ghz.push(nu);
            band.weight.push(weight);
            rest = after;
        }
        band
    }
}
