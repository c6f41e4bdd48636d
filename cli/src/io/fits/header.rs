//! The header of one HDU: blocks of 36 cards up to END, and its values by keyword.

use super::card::{self, CARD, Value};
use super::place::Place;
use super::stream::Stream;
use crate::error::Result;
use std::collections::HashMap;

/// Headers and data come in blocks of this many bytes.
pub(super) const BLOCK: usize = 2880;
/// A header of more blocks than this (3 600 000 bytes) is taken for a file that has lost its END.
const MOST_BLOCKS: usize = 1250;

/// The values of a header.
#[derive(Debug, Clone)]
pub(super) struct Header {
    pub(super) place: Place,
    values: HashMap<String, Value>,
}

impl Header {
    /// Reads the header of HDU number `hdu`; `None` at the end of the file.
    pub(super) fn read(stream: &mut Stream<'_>, hdu: usize) -> Result<Option<Self>> {
        let mut place = Place::new(&stream.file, hdu);
        if stream.is_at_end()? {
            return if hdu == 0 {
                Err(place.error("the file is empty; copy or download it again"))
            } else {
                Ok(None)
            };
        }
        let mut values = HashMap::new();
        let mut block = [0; BLOCK];
        for count in 0..MOST_BLOCKS {
            // The first card says whether this is FITS at all: look at it before asking for a whole block.
            let (first, rest) = block.split_at_mut(CARD);
            stream.fill(first)?;
            if count == 0 {
                check_first(first, &place)?;
            }
            stream.fill(rest)?;
            for bytes in block.as_chunks::<CARD>().0 {
                if bytes[..8] == *b"END     " {
                    place.name = match values.get("EXTNAME") {
                        Some(Value::Text(name)) if !name.is_empty() => Some(name.clone()),
                        _ => None,
                    };
                    return Ok(Some(Self { place, values }));
                }
                if let Some((keyword, value)) = card::parse(bytes) {
                    // Of two cards the first holds, as in astropy and cfitsio.
                    values.entry(keyword).or_insert(value);
                }
            }
        }
        place.refuse(
            "END",
            "there is no END card within the first 45000 of the header; the file is damaged, copy or download it again",
        )
    }

    /// A string, or a number as it was written.
    pub(super) fn text(&self, key: &str) -> Result<Option<&str>> {
        match self.values.get(key) {
            None | Some(Value::Undefined) => Ok(None),
            Some(Value::Text(text)) => Ok(Some(text.trim())),
            Some(other) => self.wrong(key, other, "a string in quotes"),
        }
    }

    /// An integer; some programs write integers as reals or strings.
    pub(super) fn integer(&self, key: &str) -> Result<Option<i64>> {
        match self.values.get(key) {
            None | Some(Value::Undefined) => Ok(None),
            Some(Value::Integer(value)) => Ok(Some(*value)),
            #[expect(
                clippy::cast_possible_truncation,
                reason = "whole numbers below 2^53 are exact in both types"
            )]
            Some(Value::Real(value)) if value.fract() == 0.0 && value.abs() < 9e15 => {
                Ok(Some(*value as i64))
            }
            Some(value @ Value::Text(text)) => match text.trim().parse() {
                Ok(integer) => Ok(Some(integer)),
                Err(_) => self.wrong(key, value, "an integer"),
            },
            Some(other) => self.wrong(key, other, "an integer"),
        }
    }

    /// An integer that may not be absent or negative.
    pub(super) fn size(&self, key: &str) -> Result<u64> {
        match self.integer(key)? {
            Some(value) => u64::try_from(value).or_else(|_| {
                self.place.refuse(
                    key,
                    format_args!("{value} is negative; the header is damaged, copy or download the file again"),
                )
            }),
            None => self.place.refuse(
                key,
                "the keyword is missing; the header is damaged, copy or download the file again",
            ),
        }
    }

    /// A number.
    pub(super) fn real(&self, key: &str) -> Result<Option<f64>> {
        match self.values.get(key) {
            None | Some(Value::Undefined) => Ok(None),
            Some(Value::Integer(value)) => Ok(Some(*value as f64)),
            Some(Value::Real(value)) => Ok(Some(*value)),
            Some(value @ Value::Text(text)) => match text.trim().parse::<f64>() {
                Ok(real) if real.is_finite() => Ok(Some(real)),
                _ => self.wrong(key, value, "a number"),
            },
            Some(other) => self.wrong(key, other, "a number"),
        }
    }

    /// Whether a logical is there and true.
    pub(super) fn is_true(&self, key: &str) -> bool {
        self.values.get(key) == Some(&Value::Logical(true))
    }

    pub(super) fn has(&self, key: &str) -> bool {
        self.values.contains_key(key)
    }

    fn wrong<T>(&self, key: &str, value: &Value, wanted: &str) -> Result<T> {
        let shown = match value {
            Value::Text(text) => format!("'{text}'"),
            Value::Integer(value) => value.to_string(),
            Value::Real(value) => format!("{value:?}"),
            Value::Logical(value) => if *value { "T" } else { "F" }.to_owned(),
            Value::Undefined => "nothing".to_owned(),
            Value::Broken(text) => format!("`{}`", text.escape_debug()),
        };
        if matches!(value, Value::Broken(text) if text.contains(|c| !(' '..='~').contains(&c))) {
            return self.place.refuse(
                key,
                format_args!("{shown} holds a character that no header may hold; the file is damaged, copy or download it again"),
            );
        }
        self.place.refuse(
            key,
            format_args!(
                "{shown} is not {wanted}; correct the header, or copy or download the file again"
            ),
        )
    }
}

/// The first card of a file or extension is the only sign that there is one.
fn check_first(card: &[u8], place: &Place) -> Result<()> {
    if place.hdu > 0 {
        return if card.starts_with(b"XTENSION=") {
            Ok(())
        } else {
            place.refuse(
                "XTENSION",
                "the extension does not begin with this keyword; the file is damaged, or the sizes in the header before it are wrong: copy or download it again",
            )
        };
    }
    let value = card.strip_prefix(b"SIMPLE  =").unwrap_or_default();
    if value.trim_ascii_start().starts_with(b"T") {
        Ok(())
    } else {
        place.refuse(
            "SIMPLE",
            "the file does not begin with `SIMPLE  = T`, so that it is not FITS; give a FITS file, or give a raw map the extension .f32 or .f64",
        )
    }
}
