//! Values of a few columns, streamed from the rows of a table.

use super::column::{Column, Element};
use super::hdu::Hdu;
use super::stream::Stream;
use crate::error::Result;

/// Bytes decoded at a time.
const CHUNK: usize = 1 << 16;

/// A column whose numbers are read.
#[derive(Clone, Copy)]
pub(super) struct Wanted<'a> {
    pub(super) column: &'a Column,
    pub(super) element: Element,
}

/// Reads the table up to its last row and gives the values of the wanted columns to `sink`, some rows at a time, in the
/// order of `wanted`.
///
/// A table of short rows is read many rows at a time. Of longer rows one column is given in pieces, and of several those
/// of one row are held.
pub(super) fn stream_rows(
    stream: &mut Stream<'_>,
    hdu: &Hdu,
    wanted: &[Wanted<'_>],
    mut sink: impl FnMut(&[Vec<f64>]) -> Result<()>,
) -> Result<()> {
    let mut values = vec![Vec::new(); wanted.len()];
    if hdu.row_len <= CHUNK as u64 {
        short_rows(stream, hdu, wanted, &mut values, &mut sink)
    } else {
        for _ in 0..hdu.rows {
            long_row(stream, hdu, wanted, &mut values, &mut sink)?;
        }
        Ok(())
    }
}

fn short_rows(
    stream: &mut Stream<'_>,
    hdu: &Hdu,
    wanted: &[Wanted<'_>],
    values: &mut [Vec<f64>],
    sink: &mut impl FnMut(&[Vec<f64>]) -> Result<()>,
) -> Result<()> {
    // Within usize: a row is no longer than a chunk.
    let row_len = (hdu.row_len as usize).max(1);
    let per_chunk = (CHUNK / row_len) as u64;
    let mut buffer = vec![0; CHUNK];
    let mut left = hdu.rows;
    while left > 0 {
        let rows = left.min(per_chunk);
        let bytes = &mut buffer[..rows as usize * row_len];
        stream.fill(bytes)?;
        for (Wanted { column, element }, values) in wanted.iter().zip(values.iter_mut()) {
            values.clear();
            let range = column.offset as usize..(column.offset + column.width) as usize;
            for row in bytes.chunks_exact(row_len) {
                let field = row.get(range.clone()).unwrap_or_default();
                decode(hdu, column, *element, field, values)?;
            }
        }
        sink(values)?;
        left -= rows;
    }
    Ok(())
}

fn long_row(
    stream: &mut Stream<'_>,
    hdu: &Hdu,
    wanted: &[Wanted<'_>],
    values: &mut [Vec<f64>],
    sink: &mut impl FnMut(&[Vec<f64>]) -> Result<()>,
) -> Result<()> {
    let mut order: Vec<usize> = (0..wanted.len()).collect();
    order.sort_unstable_by_key(|&index| wanted[index].column.offset);
    let mut position = 0;
    let mut buffer = vec![0; CHUNK];
    for index in order {
        let Wanted { column, element } = wanted[index];
        // Asked for twice, a column is behind us.
        if column.offset < position {
            return Err(hdu.place().error(format_args!(
                "{} is wanted twice; name another column",
                column.title()
            )));
        }
        stream.skip(column.offset - position)?;
        let mut left = column.width;
        while left > 0 {
            let count = left.min(CHUNK as u64) as usize;
            stream.fill(&mut buffer[..count])?;
            decode(hdu, column, element, &buffer[..count], &mut values[index])?;
            left -= count as u64;
            // Of one column nothing has to be kept; several must be complete before they can be paired.
            if wanted.len() == 1 {
                sink(values)?;
                values[index].clear();
            }
        }
        position = column.offset + column.width;
    }
    if wanted.len() > 1 {
        sink(values)?;
        values.iter_mut().for_each(Vec::clear);
    }
    stream.skip(hdu.row_len - position)
}

fn decode(
    hdu: &Hdu,
    column: &Column,
    element: Element,
    bytes: &[u8],
    out: &mut Vec<f64>,
) -> Result<()> {
    column.decode(element, bytes, out).map_err(|byte| {
        hdu.place().keyword(
            &format!("TFORM{}", column.number),
            format_args!("a logical value is the byte {byte}, neither T nor F; the data are damaged, copy or download the file again"),
        )
    })
}
