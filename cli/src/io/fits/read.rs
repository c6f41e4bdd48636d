//! A map out of a FITS file.

use super::choose::{choose, known_unit, partner, unit_factor};
use super::frame::Frame;
use super::hdu::Hdu;
use super::header::Header;
use super::pixels::read_pixels;
use super::select::Selection;
use super::sky::Sky;
use super::stream::Stream;
use crate::error::{Error, Result};
use crate::io::map_file::MapFile;
use crate::io::role::{Role, stokes};
use crate::kernels::healpix::missing::is_missing;
use std::path::Path;

/// Reads the map that `selection` and `role` mean: RING order, COSMO convention, missing pixels as
/// [`MISSING`](crate::kernels::healpix::missing::MISSING); in the unit of `role`, or of the file if there is none.
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
    let (factor, unit) = match role {
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
    let stokes = stokes(role, &column.name);
    if sky.iau && stokes == Some('U') {
        notes.push(format!(
            "{}: POLCCONV is IAU, the sign of U is changed",
            hdu.place()
        ));
    }
    let mut all = vec![wanted];
    if sky.frame != Frame::Galactic && matches!(stokes, Some('Q' | 'U')) {
        all.push(partner(&hdu, &columns, &sky, wanted, stokes, role)?);
        if stokes == Some('U') {
            all.reverse();
        }
    }
    let mut maps = read_pixels(&mut stream, &hdu, &columns, &sky, &all)?;
    if sky.iau && (all.len() == 2 || stokes == Some('U')) {
        scale(maps.last_mut(), -1.0);
    }
    if sky.frame != Frame::Galactic {
        rotate(&hdu, &sky, &mut maps)?;
        notes.push(format!(
            "{}: COORDSYS is {}, the map is rotated to Galactic through its harmonic coefficients",
            hdu.place(),
            sky.frame.name()
        ));
    }
    let which = usize::from(all.len() == 2 && stokes == Some('U'));
    let mut values = maps.swap_remove(which);
    scale(Some(&mut values), factor);
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

/// Multiplies what is not missing.
fn scale(values: Option<&mut Vec<f64>>, factor: f64) {
    if factor != 1.0 {
        let values = values.into_iter().flatten();
        for value in values.filter(|value| !is_missing(**value)) {
            *value *= factor;
        }
    }
}

/// To Galactic coordinates.
fn rotate(hdu: &Hdu, sky: &Sky, maps: &mut [Vec<f64>]) -> Result<()> {
    let missing = maps.iter().flatten().filter(|value| is_missing(**value));
    match missing.count() {
        0 => Ok(sky.frame.rotate(sky.nside, maps)?),
        count => hdu.place().refuse(
            "COORDSYS",
            format_args!(
                "the map is in {} coordinates and must be rotated, but {count} pixels are missing, so that its harmonic coefficients are not known; give it in Galactic coordinates, or fill the pixels",
                sky.frame.name()
            ),
        ),
    }
}
