//! One column of a table, or plane of an image: where its values are in a row, and what they mean.

use super::header::Header;
use crate::config::Dtype;
use crate::error::Result;
use crate::kernels::healpix::missing::MISSING;

/// Type of a number in the file; all are big-endian.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Element {
    /// `T`, `F` or 0 for undefined.
    Logical,
    Byte,
    Short,
    Int,
    Long,
    Float,
    Double,
}

impl Element {
    pub(super) const fn size(self) -> usize {
        match self {
            Self::Logical | Self::Byte => 1,
            Self::Short => 2,
            Self::Int | Self::Float => 4,
            Self::Long | Self::Double => 8,
        }
    }

    pub(super) const fn is_integer(self) -> bool {
        matches!(self, Self::Byte | Self::Short | Self::Int | Self::Long)
    }

    /// The element type of raw maps that holds these numbers.
    pub(super) const fn dtype(self) -> Dtype {
        match self {
            Self::Int | Self::Long | Self::Double => Dtype::F64,
            _ => Dtype::F32,
        }
    }

    pub(super) const fn of_bitpix(bitpix: i64) -> Option<Self> {
        match bitpix {
            8 => Some(Self::Byte),
            16 => Some(Self::Short),
            32 => Some(Self::Int),
            64 => Some(Self::Long),
            -32 => Some(Self::Float),
            -64 => Some(Self::Double),
            _ => None,
        }
    }

    const fn of_code(code: u8) -> Option<Self> {
        match code {
            b'L' => Some(Self::Logical),
            b'B' => Some(Self::Byte),
            b'I' => Some(Self::Short),
            b'J' => Some(Self::Int),
            b'K' => Some(Self::Long),
            b'E' => Some(Self::Float),
            b'D' => Some(Self::Double),
            _ => None,
        }
    }
}

/// One column.
#[derive(Debug, Clone)]
pub(super) struct Column {
    /// From 1, as in TTYPEn.
    pub(super) number: usize,
    /// TTYPEn; empty if there is none.
    pub(super) name: String,
    /// TUNITn, or BUNIT of an image.
    pub(super) unit: Option<String>,
    /// `None` for what is no column of numbers: strings, bits, complex numbers, lists.
    pub(super) element: Option<Element>,
    /// TFORMn as it stands there.
    pub(super) form: String,
    /// Values per row.
    pub(super) repeat: u64,
    /// Bytes before it in a row.
    pub(super) offset: u64,
    /// Bytes in a row.
    pub(super) width: u64,
    /// Value = `zero` + `scale` · number.
    pub(super) scale: f64,
    pub(super) zero: f64,
    /// The integer that stands for no value.
    pub(super) null: Option<i64>,
}

impl Column {
    /// Column `number` of a binary table, which begins `offset` bytes into the row.
    pub(super) fn of_table(header: &Header, number: usize, offset: u64) -> Result<Self> {
        let key = |name: &str| format!("{name}{number}");
        let tform = key("TFORM");
        let Some(form) = header.text(&tform)? else {
            return header.place.refuse(
                &tform,
                "the keyword is missing; the header is damaged, copy or download the file again",
            );
        };
        let Some((repeat, element, width)) = parse_form(form) else {
            return header.place.refuse(
                &tform,
                format_args!("'{form}' is no form of a column; correct the header, or copy or download the file again"),
            );
        };
        let scale = header.real(&key("TSCAL"))?.unwrap_or(1.0);
        Ok(Self {
            number,
            name: header.text(&key("TTYPE"))?.unwrap_or_default().to_owned(),
            unit: header.text(&key("TUNIT"))?.map(str::to_owned),
            element,
            form: form.to_owned(),
            repeat,
            offset,
            width,
            scale,
            zero: header.real(&key("TZERO"))?.unwrap_or(0.0),
            null: header.integer(&key("TNULL"))?,
        })
    }

    /// What errors call it.
    pub(super) fn title(&self) -> String {
        if self.name.is_empty() {
            format!("column {}", self.number)
        } else {
            format!("column {} (`{}`)", self.number, self.name)
        }
    }

    /// Appends the values of `bytes`, a whole number of elements; `Err` names the byte of a broken logical.
    pub(super) fn decode(
        &self,
        element: Element,
        bytes: &[u8],
        out: &mut Vec<f64>,
    ) -> std::result::Result<(), u8> {
        let plain = self.scale == 1.0 && self.zero == 0.0;
        let physical = |stored: f64| {
            if plain {
                stored
            } else {
                // Two roundings, as astropy does it.
                self.scale * stored + self.zero
            }
        };
        let integer = |stored: i64| {
            if self.null == Some(stored) {
                MISSING
            } else {
                physical(stored as f64)
            }
        };
        match element {
            Element::Double => {
                let words = bytes.as_chunks().0.iter();
                out.extend(words.map(|&word| physical(f64::from_be_bytes(word))));
            }
            Element::Float => {
                let words = bytes.as_chunks().0.iter();
                out.extend(words.map(|&word| physical(f64::from(f32::from_be_bytes(word)))));
            }
            Element::Long => {
                let words = bytes.as_chunks().0.iter();
                out.extend(words.map(|&word| integer(i64::from_be_bytes(word))));
            }
            Element::Int => {
                let words = bytes.as_chunks().0.iter();
                out.extend(words.map(|&word| integer(i64::from(i32::from_be_bytes(word)))));
            }
            Element::Short => {
                let words = bytes.as_chunks().0.iter();
                out.extend(words.map(|&word| integer(i64::from(i16::from_be_bytes(word)))));
            }
            Element::Byte => out.extend(bytes.iter().map(|&byte| integer(i64::from(byte)))),
            Element::Logical => {
                for &byte in bytes {
                    out.push(match byte {
                        b'T' => 1.0,
                        b'F' => 0.0,
                        0 => MISSING,
                        _ => return Err(byte),
                    });
                }
            }
        }
        Ok(())
    }
}

/// Repeat count, type and width in bytes of a TFORM such as `1024E`; `None` if it is none.
fn parse_form(form: &str) -> Option<(u64, Option<Element>, u64)> {
    let digits = form.bytes().take_while(u8::is_ascii_digit).count();
    let (count, rest) = form.split_at(digits);
    let repeat: u64 = if count.is_empty() {
        1
    } else {
        count.parse().ok()?
    };
    let code = *rest.as_bytes().first()?;
    if let Some(element) = Element::of_code(code) {
        // Nothing but blanks may follow the type of a number.
        let width = repeat.checked_mul(element.size() as u64)?;
        return rest[1..]
            .trim()
            .is_empty()
            .then_some((repeat, Some(element), width));
    }
    let width = match code {
        b'A' => repeat,
        b'X' => repeat.div_ceil(8),
        b'C' | b'P' => repeat.checked_mul(8)?,
        b'M' | b'Q' => repeat.checked_mul(16)?,
        _ => return None,
    };
    Some((repeat, None, width))
}
