//! Values put in their pixels: in order, or by a list.

use super::choose::pixels;
use super::column::Column;
use super::hdu::Hdu;
use super::rows::{Wanted, stream_rows};
use super::sky::{Indexing, Sky};
use super::stream::Stream;
use crate::error::Result;
use crate::kernels::healpix::missing::{MISSING, is_missing};
use crate::kernels::healpix::{Nside, nest2ring};

/// Above this many pixels (Nside 512) a list that holds fewer than one in [`SPARSEST`] is refused.
const SURELY_FITS: u64 = 3 << 20;
const SPARSEST: u64 = 10_000;

/// The values of the columns in RING order, missing pixels as [`MISSING`].
pub(super) fn read_pixels(
    stream: &mut Stream<'_>,
    hdu: &Hdu,
    columns: &[Column],
    sky: &Sky,
    wanted: &[Wanted<'_>],
) -> Result<Vec<Vec<f64>>> {
    for wanted in wanted {
        check_count(hdu, sky, wanted.column)?;
    }
    let mut maps = Maps::new(hdu, sky, wanted.len())?;
    match sky.indexing {
        Indexing::Run { first, .. } => {
            let mut next = first;
            stream_rows(stream, hdu, wanted, |columns| {
                for (map, values) in columns.iter().enumerate() {
                    for (pixel, &value) in (next..).zip(values) {
                        maps.put(map, pixel, value)?;
                    }
                }
                next += columns.first().map_or(0, |values| values.len() as u64);
                Ok(())
            })?;
        }
        Indexing::Column(number) => {
            let list = pixels(columns, number).filter(|list| {
                let agrees = |wanted: &Wanted<'_>| wanted.column.repeat == list.column.repeat;
                wanted.iter().all(agrees)
            });
            let Some(list) = list else {
                return hdu.place().refuse(
                    &format!("TFORM{number}"),
                    format_args!(
                        "column {number}, which holds the numbers of the pixels, does not count as many in a row as the map; the header is damaged, or the column no map: choose another"
                    ),
                );
            };
            let all: Vec<_> = std::iter::once(list)
                .chain(wanted.iter().copied())
                .collect();
            stream_rows(stream, hdu, &all, |columns| {
                let [pixels, columns @ ..] = columns else {
                    return Ok(());
                };
                for (row, &pixel) in pixels.iter().enumerate() {
                    let pixel = maps.listed(number, pixel)?;
                    for (map, values) in columns.iter().enumerate() {
                        maps.put(map, pixel, values.get(row).copied().unwrap_or(MISSING))?;
                    }
                }
                Ok(())
            })?;
        }
    }
    Ok(maps.values)
}

/// The length of the first column agrees with NSIDE; that of the wanted one must, too.
fn check_count(hdu: &Hdu, sky: &Sky, column: &Column) -> Result<()> {
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
    match sky.indexing {
        Indexing::Run { count: wanted, .. } if count != wanted => hdu.place().refuse(
            &format!("TFORM{}", column.number),
            format_args!(
                "'{}' in {} rows makes {count} values, but the first column has {wanted}; the header is damaged, or the column no map: choose another",
                column.form, hdu.rows
            ),
        ),
        _ => Ok(()),
    }
}

/// The maps as they are filled.
struct Maps<'a> {
    hdu: &'a Hdu,
    sky: &'a Sky,
    nside: Nside,
    values: Vec<Vec<f64>>,
    /// For lists: which pixels have been met.
    met: Vec<bool>,
}

impl<'a> Maps<'a> {
    fn new(hdu: &'a Hdu, sky: &'a Sky, count: usize) -> Result<Self> {
        // At most 8192: no overflow, and what it takes was compared with the length of the file.
        let npix = sky.npix() as usize;
        let listed = matches!(sky.indexing, Indexing::Column(_));
        Ok(Self {
            hdu,
            sky,
            nside: Nside::new(sky.nside.into())?,
            values: vec![vec![MISSING; npix]; count],
            met: vec![false; if listed { npix } else { 0 }],
        })
    }

    /// Puts a value in pixel `pixel`, below npix, of the order of the file.
    fn put(&mut self, map: usize, pixel: u64, value: f64) -> Result<()> {
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
        if let Some(place) = self.values[map].get_mut(ring as usize) {
            *place = value;
        }
        Ok(())
    }

    /// The next pixel of a list.
    fn listed(&mut self, column: usize, pixel: f64) -> Result<u64> {
        let npix = self.sky.npix();
        let refuse = |sentence: String| {
            self.hdu.place().refuse(
                &format!("TTYPE{column}"),
                format!("{sentence}; the data are damaged or the column holds no pixels: copy or download the file again"),
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
            Some(met) if !*met => {
                *met = true;
                Ok(number)
            }
            _ => refuse(format!("pixel {number} is listed twice")),
        }
    }

    /// The file's own value for none, to the precision of f32.
    fn is_bad(&self, value: f64) -> bool {
        (value - self.sky.bad_data).abs() <= 1e-5 * self.sky.bad_data.abs()
    }
}
