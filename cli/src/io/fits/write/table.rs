//! Rows of a binary table, and the padding after them.

use super::super::header::BLOCK;
use super::cards::Cards;
use crate::config::Dtype;
use crate::error::Result;
use crate::io::raw::single;
use crate::kernels::healpix::missing::MISSING;

/// Type code of TFORM.
pub(super) const fn code(dtype: Dtype) -> char {
    match dtype {
        Dtype::F32 => 'E',
        Dtype::F64 => 'D',
    }
}

/// A column of reals.
pub(super) struct Field<'a> {
    pub(super) name: &'a str,
    pub(super) unit: &'a str,
    pub(super) values: &'a [f64],
}

/// Writes TTYPE, TFORM, TUNIT of column `number`.
pub(super) fn describe(cards: &mut Cards, number: usize, name: &str, form: &str, unit: &str) {
    cards.text(&format!("TTYPE{number}"), name, "");
    cards.text(&format!("TFORM{number}"), form, "");
    if !unit.is_empty() && unit != "1" {
        cards.text(&format!("TUNIT{number}"), unit, "");
    }
}

/// Appends big-endian values; f32 as in raw maps, NaN as [`MISSING`].
fn encode(values: &[f64], dtype: Dtype, row: &mut Vec<u8>) {
    match dtype {
        Dtype::F64 => row.extend(values.iter().flat_map(|&value| {
            let value = if value.is_finite() { value } else { MISSING };
            value.to_be_bytes()
        })),
        Dtype::F32 => row.extend(values.iter().flat_map(|&value| single(value).to_be_bytes())),
    }
}

/// Rows of `repeat` values of each column, all of one length, side by side.
pub(super) fn rows(
    fields: &[Field<'_>],
    repeat: usize,
    dtype: Dtype,
    sink: &mut dyn FnMut(&[u8]) -> Result<()>,
) -> Result<()> {
    let count = fields.first().map_or(0, |field| field.values.len());
    let mut row = Vec::new();
    for start in (0..count).step_by(repeat.max(1)) {
        for field in fields {
            let end = field.values.len().min(start + repeat);
            encode(
                field.values.get(start..end).unwrap_or_default(),
                dtype,
                &mut row,
            );
        }
        // Rows of single values are gathered: a sink may well be a file.
        if row.len() >= 1 << 16 {
            sink(&row)?;
            row.clear();
        }
    }
    sink(&row)?;
    pad(fields.len() * count * dtype.size(), sink)
}

/// Zeros up to the end of the block.
pub(super) fn pad(len: usize, sink: &mut dyn FnMut(&[u8]) -> Result<()>) -> Result<()> {
    sink(&[0; BLOCK][..len.next_multiple_of(BLOCK) - len])
}
