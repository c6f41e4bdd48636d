//! The HEALPix keywords of a header: what the pixels of its columns are.

use super::column::Column;
use super::frame::Frame;
use super::hdu::{Hdu, Kind, nside_of};
use super::header::Header;
use crate::error::Result;
use crate::io::raw::LARGEST_NSIDE;
use crate::kernels::healpix::missing::MISSING;

/// What the pixels are.
#[derive(Debug, Clone)]
pub(super) struct Sky {
    pub(super) frame: Frame,
    pub(super) nside: u32,
    pub(super) nested: bool,
    pub(super) indexing: Indexing,
    /// What stands for no value, besides NaN and [`MISSING`].
    pub(super) bad_data: f64,
    /// POLCCONV = IAU: U has the other sign.
    pub(super) iau: bool,
    /// What had to be assumed.
    pub(super) notes: Vec<String>,
}

/// Which pixels the rows are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Indexing {
    /// `count` from `first` on.
    Run { first: u64, count: u64 },
    /// Those in the column of this number.
    Column(usize),
}

impl Sky {
    /// What `hdu` says; `primary` is the primary header, where some programs write what holds of all HDUs.
    pub(super) fn of(hdu: &Hdu, columns: &[Column], primary: &Header) -> Result<Self> {
        let header = &hdu.header;
        let mut notes = Vec::new();
        let frame = Frame::of(header, primary, &mut notes)?;
        let explicit = is_explicit(header)? && hdu.kind == Kind::Table;
        let pixels = columns
            .iter()
            .find(|column| column.element.is_some())
            .map_or(0, |column| column.repeat.saturating_mul(hdu.rows));
        let nside = nside(header, pixels, explicit)?;
        let nested = match header
            .text("ORDERING")?
            .map(str::to_ascii_uppercase)
            .as_deref()
        {
            Some("RING") => false,
            Some("NESTED" | "NEST") => true,
            None | Some("") => {
                notes.push(format!("{}: no ORDERING, RING is assumed", header.place));
                false
            }
            Some(other) => {
                return header.place.refuse(
                    "ORDERING",
                    format_args!("'{other}' is neither RING nor NESTED; correct it, or write the map in one of these orders"),
                );
            }
        };
        let indexing = if explicit {
            Indexing::Column(pixel_column(hdu, columns)?)
        } else {
            Indexing::Run {
                first: first_pixel(header, pixels, nside)?,
                count: pixels,
            }
        };
        let bad_data = match header.real("BAD_DATA")? {
            Some(value) => value,
            None => primary.real("BAD_DATA").ok().flatten().unwrap_or(MISSING),
        };
        Ok(Self {
            frame,
            nside,
            nested,
            indexing,
            bad_data,
            iau: is_iau(header, primary)?,
            notes,
        })
    }

    pub(super) const fn npix(&self) -> u64 {
        12 * self.nside as u64 * self.nside as u64
    }
}

/// INDXSCHM says it, or else OBJECT.
fn is_explicit(header: &Header) -> Result<bool> {
    match header
        .text("INDXSCHM")?
        .map(str::to_ascii_uppercase)
        .as_deref()
    {
        Some("EXPLICIT") => Ok(true),
        Some("IMPLICIT") => Ok(false),
        Some("SPARSE") => Ok(true),
        None | Some("") => Ok(header
            .text("OBJECT")?
            .is_some_and(|text| text.eq_ignore_ascii_case("PARTIAL"))),
        Some(other) => header.place.refuse(
            "INDXSCHM",
            format_args!("'{other}' is neither IMPLICIT nor EXPLICIT; correct the header"),
        ),
    }
}

fn nside(header: &Header, pixels: u64, explicit: bool) -> Result<u32> {
    let refuse = |sentence: String| header.place.refuse("NSIDE", sentence);
    let Some(stated) = header.integer("NSIDE")? else {
        return match nside_of(pixels) {
            Some(nside) if !explicit => Ok(nside),
            _ if explicit => refuse(
                "the keyword is missing, and a list of pixels means nothing without it; add it"
                    .to_owned(),
            ),
            _ => refuse(format!(
                "the keyword is missing, and {pixels} values are not 12 Nside² for any power of two up to {LARGEST_NSIDE}; give a HEALPix map"
            )),
        };
    };
    match u32::try_from(stated) {
        Ok(nside) if nside.is_power_of_two() && nside <= LARGEST_NSIDE => Ok(nside),
        Ok(nside) if nside.is_power_of_two() => refuse(format!(
            "{nside} is larger than {LARGEST_NSIDE}; degrade the map first"
        )),
        _ => refuse(format!(
            "{stated} is not a power of two; correct the header, or resample the map"
        )),
    }
}

/// The first of consecutive pixels: 0 for a whole map; for part of one FIRSTPIX, if LASTPIX agrees with the length.
fn first_pixel(header: &Header, pixels: u64, nside: u32) -> Result<u64> {
    let npix = 12 * u64::from(nside) * u64::from(nside);
    // FIRSTPIX and LASTPIX of whole maps are not looked at: degraded maps often keep those of the original.
    if pixels == npix {
        return Ok(0);
    }
    let whole = header
        .text("OBJECT")?
        .is_some_and(|text| text.eq_ignore_ascii_case("FULLSKY"));
    let stated = |key: &str| -> Result<Option<u64>> {
        Ok(header.integer(key)?.and_then(|value| value.try_into().ok()))
    };
    if let (Some(first), Some(last)) = (stated("FIRSTPIX")?, stated("LASTPIX")?)
        && !whole
        && last < npix
        && last
            .checked_sub(first)
            .is_some_and(|count| count + 1 == pixels)
    {
        return Ok(first);
    }
    header.place.refuse(
        "NSIDE",
        format_args!(
            "{nside} means {npix} pixels, but the table or image holds {pixels}; the header is wrong or the file damaged: correct NSIDE, or copy or download it again"
        ),
    )
}

/// The column with the numbers of the pixels: by its name, else the first.
fn pixel_column(hdu: &Hdu, columns: &[Column]) -> Result<usize> {
    let named = |column: &&Column| {
        [
            "PIXEL", "PIX", "HPIX", "PIXNUM", "HEALPIX", "IPIX", "INDEX", "PIXELS",
        ]
        .iter()
        .any(|name| column.name.eq_ignore_ascii_case(name))
    };
    let Some(column) = columns.iter().find(named).or(columns.first()) else {
        return hdu.place().refuse(
            "TFIELDS",
            "there is no column; the header is damaged, copy or download the file again",
        );
    };
    if column.element.is_some_and(|element| element.is_integer()) {
        return Ok(column.number);
    }
    hdu.place().refuse(
        &format!("TFORM{}", column.number),
        format_args!(
            "INDXSCHM or OBJECT announces a list of pixels, but {} ('{}') holds no integers; correct the header, or write the whole map",
            column.title(),
            column.form
        ),
    )
}

fn is_iau(header: &Header, primary: &Header) -> Result<bool> {
    let stated = match header.text("POLCCONV")? {
        Some(text) => Some(text),
        None => primary.text("POLCCONV")?,
    };
    match stated.map(str::to_ascii_uppercase).as_deref() {
        None | Some("" | "COSMO" | "UNKNOWN" | "UNDEFINED") => Ok(false),
        Some("IAU") => Ok(true),
        Some(other) => header.place.refuse(
            "POLCCONV",
            format_args!("'{other}' is neither COSMO nor IAU; correct the header, the sign of U depends on it"),
        ),
    }
}
