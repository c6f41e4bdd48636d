//! Maps: a binary table of one column per map, 1024 pixels a row, as healpy and the HEALPix programs write them.

use super::cards::Cards;
use super::provenance::Provenance;
use super::table::{Field, code, describe, rows};
use crate::config::Dtype;
use crate::error::{Error, Result};
use crate::kernels::healpix::Nside;
use crate::kernels::healpix::missing::MISSING;

/// Pixels of a row, for maps that have as many.
const ROW: usize = 1024;

/// One map of a file.
#[derive(Debug, Clone, Copy)]
pub struct MapColumn<'a> {
    /// `I`, `Q`, `U`, or what else it is called.
    pub name: &'a str,
    /// Unit of the values; `1` or nothing if they have none.
    pub unit: &'a str,
    /// 12 Nside² values, RING order unless the table says otherwise.
    pub values: &'a [f64],
}

/// Maps that belong together, such as I, Q and U.
#[derive(Debug, Clone, Copy)]
pub struct MapTable<'a> {
    /// The maps, all of one length.
    pub columns: &'a [MapColumn<'a>],
    /// Whether they are in NESTED order.
    pub nested: bool,
    /// Where they come from.
    pub provenance: &'a Provenance,
}

impl MapTable<'_> {
    /// The Nside of all maps.
    ///
    /// # Errors
    /// There is none: no map, other lengths, or not 12 Nside² values.
    pub fn nside(&self) -> Result<Nside> {
        let Some(first) = self.columns.first() else {
            return Err(Error::input("there is no map to be written"));
        };
        let len = first.values.len();
        if let Some(other) = self
            .columns
            .iter()
            .find(|column| column.values.len() != len)
        {
            return Err(Error::input(format!(
                "{} has {} pixels and {} has {len}; maps in one file must have one Nside",
                other.name,
                other.values.len(),
                first.name
            )));
        }
        Ok(Nside::from_npix(len as u64)?)
    }
}

/// TTYPE of a map called `name`: of the Stokes parameters, Planck's.
fn ttype(name: &str) -> String {
    match name {
        "I" | "Q" | "U" => format!("{name}_STOKES"),
        _ => name.to_owned(),
    }
}

/// The file of `table`, in values of type `dtype`.
///
/// # Errors
/// As [`MapTable::nside`]; or what the sink returns.
pub fn map(
    table: &MapTable<'_>,
    dtype: Dtype,
    sink: &mut dyn FnMut(&[u8]) -> Result<()>,
) -> Result<()> {
    let nside = table.nside()?.get();
    let npix = 12 * (nside * nside) as usize;
    // 12 Nside² is a multiple of 1024 from Nside 16 on; smaller maps have one pixel a row, as healpy writes them.
    let repeat = if npix.is_multiple_of(ROW) { ROW } else { 1 };
    let fields = table.columns.len();
    let mut cards = Cards::table(fields * repeat * dtype.size(), npix / repeat, fields);
    let form = format!("{repeat}{}", code(dtype));
    for (number, column) in (1..).zip(table.columns) {
        describe(&mut cards, number, &ttype(column.name), &form, column.unit);
    }
    cards.text("EXTNAME", "MAP", "");
    cards.text("PIXTYPE", "HEALPIX", "HEALPix pixelisation");
    let ordering = if table.nested { "NESTED" } else { "RING" };
    cards.text("ORDERING", ordering, "order of the pixels, RING or NESTED");
    cards.integer("NSIDE", nside, "resolution parameter of HEALPix");
    cards.integer("FIRSTPIX", 0, "first pixel (from 0)");
    cards.integer("LASTPIX", npix as u64 - 1, "last pixel (from 0)");
    cards.text("INDXSCHM", "IMPLICIT", "every pixel is there, in order");
    cards.text("OBJECT", "FULLSKY", "sky coverage");
    let frame = table.provenance.frame;
    cards.text(
        "COORDSYS",
        frame.letter(),
        &format!("{} coordinates", frame.name()),
    );
    let polarised = table
        .columns
        .iter()
        .any(|column| matches!(column.name, "Q" | "U"));
    cards.logical("POLAR", polarised, "whether there are Q and U");
    cards.text("POLCCONV", "COSMO", "sign of U");
    cards.real("BAD_DATA", MISSING, "value of missing pixels");
    table.provenance.put(&mut cards);
    sink(&Cards::primary())?;
    sink(&cards.finish())?;
    let fields: Vec<_> = table
        .columns
        .iter()
        .map(|&MapColumn { name, unit, values }| Field { name, unit, values })
        .collect();
    rows(&fields, repeat, dtype, sink)
}
