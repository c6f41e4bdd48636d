//! Frequencies as users write them, and integers beyond the range of TOML.

use serde::de::{Deserializer, Error as _, Visitor};
use serde::{Deserialize, de};
use std::fmt;

/// "100 µm" in GHz: c / 100 µm, exact.
pub const MICRON_100_GHZ: f64 = 2997.92458;

/// c in GHz µm.
const LIGHT_GHZ_MICRON: f64 = 299_792.458;

/// A frequency in GHz from `353`, `353GHz` or a wavelength `100um`; positive and finite.
#[must_use]
pub fn parse_frequency(text: &str) -> Option<f64> {
    let text = text.trim();
    let number = |digits: &str| digits.trim().parse::<f64>().ok();
    let nu = if let Some(digits) = text.strip_suffix("um").or_else(|| text.strip_suffix("µm")) {
        LIGHT_GHZ_MICRON / number(digits)?
    } else {
        number(text.strip_suffix("GHz").unwrap_or(text))?
    };
    (nu.is_finite() && nu > 0.0).then_some(nu)
}

/// Reads a list of frequencies, each a number of GHz or a string for [`parse_frequency`].
pub(super) fn frequencies_from<'de, D: Deserializer<'de>>(input: D) -> Result<Vec<f64>, D::Error> {
    #[derive(Deserialize)]
    #[serde(
        untagged,
        expecting = "a frequency: a number of GHz, or a wavelength such as \"100um\""
    )]
    enum Entry {
        Number(f64),
        Text(String),
    }
    Vec::<Entry>::deserialize(input)?
        .into_iter()
        .map(|entry| match entry {
            Entry::Number(nu) => Ok(nu),
            Entry::Text(text) => parse_frequency(&text).ok_or_else(|| {
                D::Error::custom(format!(
                    "`{text}` is no frequency; write GHz or a wavelength such as 100um"
                ))
            }),
        })
        .collect()
}

/// Reads a seed: an integer, or a string of digits, as TOML integers end at 2^63.
pub(super) fn seed_from<'de, D: Deserializer<'de>>(input: D) -> Result<u64, D::Error> {
    struct Seed;
    impl Visitor<'_> for Seed {
        type Value = u64;
        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("an integer from 0 to 2^64 - 1")
        }
        fn visit_u64<E: de::Error>(self, seed: u64) -> Result<u64, E> {
            Ok(seed)
        }
        fn visit_i64<E: de::Error>(self, seed: i64) -> Result<u64, E> {
            u64::try_from(seed).map_err(|_| E::invalid_value(de::Unexpected::Signed(seed), &self))
        }
        fn visit_str<E: de::Error>(self, text: &str) -> Result<u64, E> {
            text.parse()
                .map_err(|_| E::invalid_value(de::Unexpected::Str(text), &self))
        }
    }
    input.deserialize_any(Seed)
}
