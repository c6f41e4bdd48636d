//! A map out of a FITS file.

use super::choose::{choose, known_unit, pixels, unit_factor};
use super::column::Column;
use super::hdu::Hdu;
use super::header::Header;
use super::rows::{Wanted, stream_rows};
use super::select::Selection;
use super::sky::{Indexing, Sky};
use super::stream::Stream;
use crate::error::{Error, Result};
use crate::io::map_file::MapFile;
use crate::io::role::{Role, is_stokes_u};
use crate::kernels::healpix::missing::{MISSING, is_missing};
use crate::kernels::healpix::{Nside, nest2ring};
use std::path::Path;

/// Above this many pixels (Nside 1024) a list that holds fewer than one in [`SPARSEST`] is refused.
const SURELY_FITS: u64 = 12 << 20;
const SPARSEST: u64 = 10_000;

/// Reads the map that `selection` and `role` mean: RING order, COSMO convention, missing pixels as
/// [`MISSING`]; in the unit of `role`, or of the file if there is none.
///
/// # Errors
/// A file that cannot be read, or that is not what its keywords say, or whose keywords say that it is of no use here: one
/// sentence with file, HDU and keyword.
pub fn read(path: &Path, selection: &Selection, role: Option<Role>) -> Result<MapFile> {
    read_stream(Stream::open(path)?, selection, role)
}

/// As [`read`], from memory; errors call the file `name`.
///
/// # Errors
/// As [`read`].
pub fn read_bytes(
    bytes: &[u8],
    name: &str,
    selection: &Selection,
    role: Option<Role>,
) -> Result<MapFile> {
    let stream = Stream::new(bytes, bytes.len() as u64, name)?;
    read_stream(stream, selection, role)
}

fn read_stream(
    mut stream: Stream<'_>,
    selection: &Selection,
    role: Option<Role>,
) -> Result<MapFile> {
    let (hdu, primary) = find_hdu(&mut stream, selection)?;
    let columns = hdu.columns()?;
    let mut sky = Sky::of(&hdu, &columns, &primary)?;
    let wanted = choose(&hdu, &columns, sky.indexing, selection, role)?;
    let column = wanted.column;
    let mut notes = std::mem::take(&mut sky.notes);
    let (mut factor, unit) = match role {
        Some(role) => {
            let (factor, note) = unit_factor(&hdu, column, selection, role)?;
            notes.extend(note);
            (factor, Some(role.unit().to_owned()))
        }
        None => {
            let unit = selection.unit.as_deref().or_else(|| known_unit(column));
            (1.0, unit.map(str::to_owned))
        }
    };
    let is_u = match role {
        Some(role) => matches!(role, Role::StokesU(_)),
        None => is_stokes_u(&column.name),
    };
    if sky.iau && is_u {
        notes.push(format!(
            "{}: POLCCONV is IAU, the sign of U is changed",
            hdu.place()
        ));
        factor = -factor;
    }
    let mut values = read_pixels(&mut stream, &hdu, &columns, &sky, wanted)?;
    if factor != 1.0 {
        for value in values.iter_mut().filter(|value| !is_missing(**value)) {
            *value *= factor;
        }
    }
    Ok(MapFile {
        nside: sky.nside,
        values,
        dtype: wanted.element.dtype(),
        unit,
        blake3: stream.finish()?,
        notes,
    })
}

/// The HDU asked for, or the first with a HEALPix map; and the primary header.
fn find_hdu(stream: &mut Stream<'_>, selection: &Selection) -> Result<(Hdu, Header)> {
    let mut primary: Option<Header> = None;
    let mut seen = Vec::new();
    for number in 0.. {
        let Some(hdu) = Hdu::read(stream, number)? else {
            break;
        };
        let primary = primary.get_or_insert_with(|| hdu.header.clone());
        let is_meant = match &selection.hdu {
            None => hdu.is_healpix(),
            Some(asked) => {
                let name = hdu.place().name.as_deref().unwrap_or_default();
                name.eq_ignore_ascii_case(asked) || asked.parse() == Ok(number)
            }
        };
        if is_meant {
            return Ok((hdu, primary.clone()));
        }
        if seen.len() < 20 {
            seen.push(hdu.summary());
        }
        hdu.skip(stream)?;
    }
    let (file, seen) = (&stream.file, seen.join(", "));
    Err(Error::input(match &selection.hdu {
        None => format!(
            "`{file}` holds no HEALPix map: none of its HDUs {seen} has NSIDE, PIXTYPE = HEALPIX or a column or image of 12 Nside² values; give another file, or say which as in file.fits[HDU=1]"
        ),
        Some(asked) => format!("`{file}` has no HDU {asked}; it has {seen}"),
    }))
}

/// The values of the column in RING order.
fn read_pixels(
    stream: &mut Stream<'_>,
    hdu: &Hdu,
    columns: &[Column],
    sky: &Sky,
    wanted: Wanted<'_>,
) -> Result<Vec<f64>> {
    let column = wanted.column;
    let count = hdu.rows.saturating_mul(column.repeat);
    let npix = sky.npix();
    if npix > SURELY_FITS && count < npix / SPARSEST {
        return hdu.place().refuse(
            "NSIDE",
            format_args!(
                "{} means {npix} pixels, but only {count} are listed, less than one in {SPARSEST}; correct NSIDE if it is wrong, or degrade the map first",
                sky.nside
            ),
        );
    }
    let mut map = Map::new(hdu, sky)?;
    match sky.indexing {
        Indexing::From(first) => {
            // The length of the first column agrees with NSIDE; that of another one must, too.
            if first + count > npix || (first == 0 && count != npix) {
                return hdu.place().refuse(
                    &format!("TFORM{}", column.number),
                    format_args!(
                        "'{}' in {} rows makes {count} values, but Nside {} means {npix}; the header is damaged, or the column no map: choose another",
                        column.form, hdu.rows, sky.nside
                    ),
                );
            }
            let mut next = first;
            stream_rows(stream, hdu, [wanted], |[values]| {
                for &value in values {
                    map.put(next, value)?;
                    next += 1;
                }
                Ok(())
            })?;
        }
        Indexing::Column(number) => {
            let Some(list) =
                pixels(columns, number).filter(|list| list.column.repeat == column.repeat)
            else {
                return hdu.place().refuse(
                    &format!("TFORM{}", column.number),
                    format_args!(
                        "'{}' does not count as many values as column {number}, which holds their pixels; the header is damaged, or the column no map: choose another",
                        column.form
                    ),
                );
            };
            stream_rows(stream, hdu, [list, wanted], |[pixels, values]| {
                pixels
                    .iter()
                    .zip(values)
                    .try_for_each(|(&pixel, &value)| map.put_listed(number, pixel, value))
            })?;
        }
    }
    Ok(map.values)
}

/// The map as it is filled.
struct Map<'a> {
    hdu: &'a Hdu,
    sky: &'a Sky,
    nside: Nside,
    values: Vec<f64>,
    /// For lists: which pixels have been met.
    met: Vec<bool>,
}

impl<'a> Map<'a> {
    fn new(hdu: &'a Hdu, sky: &'a Sky) -> Result<Self> {
        // At most 8192: no overflow, and what it takes was compared with the length of the file.
        let npix = sky.npix() as usize;
        let listed = matches!(sky.indexing, Indexing::Column(_));
        Ok(Self {
            hdu,
            sky,
            nside: Nside::new(sky.nside.into())?,
            values: vec![MISSING; npix],
            met: vec![false; if listed { npix } else { 0 }],
        })
    }

    /// Puts a value in pixel `pixel`, below npix, of the order of the file.
    fn put(&mut self, pixel: u64, value: f64) -> Result<()> {
        if is_missing(value) || self.is_bad(value) {
            return Ok(());
        }
        if value.is_infinite() {
            return Err(self.hdu.place().error(format_args!(
                "the value of pixel {pixel} is infinite; write NaN or {MISSING:e} where there is none"
            )));
        }
        let ring = if self.sky.nested {
            nest2ring(self.nside, pixel)?
        } else {
            pixel
        };
        if let Some(place) = self.values.get_mut(ring as usize) {
            *place = value;
        }
        Ok(())
    }

    /// Puts the value of a pixel from a list.
    fn put_listed(&mut self, column: usize, pixel: f64, value: f64) -> Result<()> {
        let npix = self.sky.npix();
        let refuse = |sentence: String| {
            self.hdu.place().refuse(
                &format!("TTYPE{column}"),
                format!("{sentence}; the data are damaged or the column holds no pixels"),
            )
        };
        if !(pixel >= 0.0 && pixel < npix as f64 && pixel.fract() == 0.0) {
            return refuse(format!(
                "pixel {pixel} is not one of the {npix} (0 to {}) of Nside {}",
                npix - 1,
                self.sky.nside
            ));
        }
        let number = pixel as u64;
        match self.met.get_mut(number as usize) {
            Some(met) if !*met => *met = true,
            _ => return refuse(format!("pixel {number} is listed twice")),
        }
        self.put(number, value)
    }

    /// The file's own value for none, to the precision of f32.
    fn is_bad(&self, value: f64) -> bool {
        (value - self.sky.bad_data).abs() <= 1e-5 * self.sky.bad_data.abs()
    }
}
