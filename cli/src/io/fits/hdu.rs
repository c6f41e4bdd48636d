//! What one HDU holds: its rows and columns, and how many bytes they take.
//!
//! An image is a table of one row, whose columns are its planes of HEALPix length.

use super::column::{Column, Element};
use super::header::{BLOCK, Header};
use super::place::Place;
use super::stream::Stream;
use crate::error::Result;
use crate::io::raw::LARGEST_NSIDE;

/// An HDU whose header has been read and whose data come next.
#[derive(Debug)]
pub(super) struct Hdu {
    pub(super) header: Header,
    pub(super) kind: Kind,
    /// Rows of the table.
    pub(super) rows: u64,
    /// Bytes of a row.
    pub(super) row_len: u64,
    /// Bytes of all data without the padding.
    data_len: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Image,
    Table,
    /// ASCII tables and what else there may be.
    Other,
}

impl Hdu {
    /// Reads the next header; `None` at the end of the file.
    pub(super) fn read(stream: &mut Stream<'_>, number: usize) -> Result<Option<Self>> {
        let Some(header) = Header::read(stream, number)? else {
            return Ok(None);
        };
        let kind = match header.text("XTENSION")? {
            _ if number == 0 => Kind::Image,
            Some("IMAGE" | "IUEIMAGE") => Kind::Image,
            Some("BINTABLE" | "A3DTABLE") => Kind::Table,
            _ => Kind::Other,
        };
        let (axes, data_len) = data_size(&header)?;
        let (row_len, rows) = match (kind, axes.as_slice()) {
            (Kind::Table, &[row_len, rows]) => {
                if header.integer("BITPIX")? != Some(8) {
                    return header.place.refuse(
                        "BITPIX",
                        "a binary table must have 8; the header is damaged, copy or download the file again",
                    );
                }
                (row_len, rows)
            }
            (Kind::Table, _) => {
                return header.place.refuse(
                    "NAXIS",
                    "a binary table must have 2; the header is damaged, copy or download the file again",
                );
            }
            _ => (data_len, 1),
        };
        if data_len > stream.remaining() {
            let key = if kind == Kind::Table {
                "NAXIS2"
            } else {
                "NAXIS"
            };
            return header.place.refuse(
                key,
                format_args!(
                    "the header announces {data_len} bytes of data, but no more than {} follow; the file is cut short or its header damaged: copy or download it again",
                    stream.remaining()
                ),
            );
        }
        Ok(Some(Self {
            header,
            kind,
            rows,
            row_len,
            data_len,
        }))
    }

    pub(super) const fn place(&self) -> &Place {
        &self.header.place
    }

    /// Passes over the data to the next header.
    pub(super) fn skip(&self, stream: &mut Stream<'_>) -> Result<()> {
        self.skip_after(stream, 0)
    }

    /// The same after `read` bytes of the data.
    pub(super) fn skip_after(&self, stream: &mut Stream<'_>, read: u64) -> Result<()> {
        let padded = self.data_len.div_ceil(BLOCK as u64) * BLOCK as u64;
        stream.skip(self.data_len.saturating_sub(read))?;
        // Some programs leave out the padding at the end of the file.
        if padded > self.data_len && !stream.is_at_end()? {
            stream.skip(padded - self.data_len)?;
        }
        Ok(())
    }

    /// The columns of the table or planes of the image; none of anything else.
    pub(super) fn columns(&self) -> Result<Vec<Column>> {
        match self.kind {
            Kind::Table => self.table_columns(),
            Kind::Image => self.planes(),
            Kind::Other => Ok(Vec::new()),
        }
    }

    fn table_columns(&self) -> Result<Vec<Column>> {
        let fields = self.header.size("TFIELDS")?;
        if fields > 999 {
            return self.place().refuse(
                "TFIELDS",
                format_args!("{fields} is more than the 999 columns that FITS allows; the header is damaged, copy or download the file again"),
            );
        }
        let mut columns: Vec<Column> = Vec::new();
        let mut offset = 0_u64;
        for number in 1..=fields as usize {
            let column = Column::of_table(&self.header, number, offset)?;
            offset = offset.saturating_add(column.width);
            columns.push(column);
        }
        if offset != self.row_len {
            return self.place().refuse(
                "NAXIS1",
                format_args!(
                    "a row of {} bytes, but the columns (TFORM1 to TFORM{fields}) take {offset}; the header is damaged, copy or download the file again",
                    self.row_len
                ),
            );
        }
        Ok(columns)
    }

    /// One plane if the image has 12 Nside² elements; several if its last axis counts such planes.
    fn planes(&self) -> Result<Vec<Column>> {
        let (axes, _) = data_size(&self.header)?;
        let elements: u64 = axes.iter().product();
        let planes = match axes.as_slice() {
            _ if nside_of(elements).is_some() => 1,
            [rest @ .., planes] if *planes > 0 && nside_of(rest.iter().product()).is_some() => {
                *planes
            }
            _ => return Ok(Vec::new()),
        };
        let bitpix = self.header.integer("BITPIX")?.unwrap_or_default();
        let Some(element) = Element::of_bitpix(bitpix) else {
            return self.place().refuse(
                "BITPIX",
                format_args!("{bitpix} is none of 8, 16, 32, 64, -32, -64; the header is damaged, copy or download the file again"),
            );
        };
        let repeat = elements / planes;
        let width = repeat * element.size() as u64;
        let scale = self.header.real("BSCALE")?.unwrap_or(1.0);
        let zero = self.header.real("BZERO")?.unwrap_or(0.0);
        let null = self.header.integer("BLANK")?;
        let unit = self.header.text("BUNIT")?.map(str::to_owned);
        Ok((0..planes.min(999))
            .map(|plane| Column {
                number: plane as usize + 1,
                name: String::new(),
                unit: unit.clone(),
                element: Some(element),
                form: format!("BITPIX {bitpix}"),
                repeat,
                offset: plane * width,
                width,
                scale,
                zero,
                null,
            })
            .collect())
    }

    /// Whether this is likely to hold a HEALPix map: by its keywords, or by the length of its first column.
    pub(super) fn is_healpix(&self) -> bool {
        let stated = self
            .header
            .text("PIXTYPE")
            .is_ok_and(|text| text.is_some_and(|text| text.eq_ignore_ascii_case("HEALPIX")));
        match self.kind {
            Kind::Other => false,
            Kind::Image => self.columns().is_ok_and(|planes| !planes.is_empty()),
            Kind::Table if stated || self.header.has("NSIDE") => true,
            Kind::Table => self.columns().is_ok_and(|columns| {
                columns
                    .iter()
                    .find(|column| column.element.is_some())
                    .and_then(|column| column.repeat.checked_mul(self.rows))
                    .and_then(nside_of)
                    .is_some()
            }),
        }
    }

    /// What a list of the HDUs of a file says of it.
    pub(super) fn summary(&self) -> String {
        let what = match self.kind {
            Kind::Image if self.data_len == 0 => "empty",
            Kind::Image => "image",
            Kind::Table => "table",
            Kind::Other => "neither image nor binary table",
        };
        match &self.place().name {
            Some(name) => format!("{} ({name}, {what})", self.place().hdu),
            None => format!("{} ({what})", self.place().hdu),
        }
    }
}

/// The Nside of a map of `pixels`, if it is a power of two that can be read.
pub(super) fn nside_of(pixels: u64) -> Option<u32> {
    let nside = (pixels / 12).isqrt();
    let fits = nside.is_power_of_two() && nside <= u64::from(LARGEST_NSIDE);
    (fits && 12 * nside * nside == pixels).then_some(nside as u32)
}

/// The axes, and the bytes of the data: |BITPIX|/8 · GCOUNT · (PCOUNT + Π NAXISn).
fn data_size(header: &Header) -> Result<(Vec<u64>, u64)> {
    let naxis = header.size("NAXIS")?;
    if naxis > 999 {
        return header.place.refuse(
            "NAXIS",
            format_args!("{naxis} is more than the 999 axes that FITS allows; the header is damaged, copy or download the file again"),
        );
    }
    let axes = (1..=naxis)
        .map(|axis| header.size(&format!("NAXIS{axis}")))
        .collect::<Result<Vec<_>>>()?;
    if header.is_true("GROUPS") && axes.first() == Some(&0) {
        return header.place.refuse(
            "GROUPS",
            "random groups are not read; write the map as a binary table",
        );
    }
    if axes.is_empty() {
        return Ok((axes, 0));
    }
    let extra = |key: &str, default: u64| {
        if header.has(key) {
            header.size(key)
        } else {
            Ok(default)
        }
    };
    let (pcount, gcount) = (extra("PCOUNT", 0)?, extra("GCOUNT", 1)?);
    let Some(bitpix) = header
        .integer("BITPIX")?
        .filter(|&bitpix| Element::of_bitpix(bitpix).is_some())
    else {
        return header.place.refuse(
            "BITPIX",
            "it must be 8, 16, 32, 64, -32 or -64; the header is damaged, copy or download the file again",
        );
    };
    let bytes = axes
        .iter()
        .try_fold(1_u64, |product, &axis| product.checked_mul(axis))
        .and_then(|elements| elements.checked_add(pcount))
        .and_then(|elements| elements.checked_mul(gcount))
        .and_then(|elements| elements.checked_mul(bitpix.unsigned_abs() / 8))
        .filter(|&bytes| bytes < 1 << 62);
    match bytes {
        Some(bytes) => Ok((axes, bytes)),
        None => header.place.refuse(
            "NAXIS",
            "the header announces more data than any file can hold; it is damaged, copy or download the file again",
        ),
    }
}
