//! Bandpass tables: text with two columns, frequency in GHz and weight.

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
    /// Reads a table.
    ///
    /// # Errors
    /// As [`Bandpass::parse`], or a file that cannot be read.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path)
            .map_err(|cause| Error::io("read the bandpass", path, &cause))?;
        Self::parse(&text).map_err(|error| error.within(path.display()))
    }

    /// Reads lines of two numbers, apart from empty lines and comments (`#`); columns are separated by blanks or a comma.
    ///
    /// # Errors
    /// A line that is something else, frequencies that do not increase, weights that sum to nothing.
    pub fn parse(text: &str) -> Result<Self> {
        let mut band = Self {
            nu_ghz: Vec::new(),
            weight: Vec::new(),
        };
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
            if nu <= band.nu_ghz.last().copied().unwrap_or(0.0) {
                return Err(bad(
                    "has a frequency that is not above the one before; sort the table, in GHz",
                ));
            }
            band.nu_ghz.push(nu);
            band.weight.push(weight);
        }
        if band.nu_ghz.is_empty() {
            return Err(Error::input(
                "the bandpass has no line; it needs two columns, GHz and weight",
            ));
        }
        Ok(band)
    }
}
