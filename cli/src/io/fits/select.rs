//! `file.fits[Q_POLARISATION]`, `file.fits[2]`, `file.fits[HDU=2][I_STOKES][unit=K_CMB]`: which map of a file is meant.

use crate::error::{Error, Result};
use std::fmt;
use std::path::{Path, PathBuf};

/// Which map of a FITS file is meant; whatever is not given follows from the file and from what the map is wanted for.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Selection {
    /// `[HDU=…]`: the number, 0 for the primary HDU, or the EXTNAME. Default: the first HDU with a HEALPix map.
    pub hdu: Option<String>,
    /// `[…]`: TTYPEn, or n from 1 (the plane, of an image). Default: by what the map is wanted for, else the first.
    pub column: Option<String>,
    /// `[unit=…]`: the unit of the values, in place of TUNITn.
    pub unit: Option<String>,
}

/// The file and the selection of `spec`; brackets that belong to the name of an existing file are left to it.
pub(in crate::io) fn parse(spec: &Path) -> Result<(PathBuf, Selection)> {
    let mut selection = Selection::default();
    let Some(whole) = spec.to_str().filter(|_| !spec.exists()) else {
        return Ok((spec.to_owned(), selection));
    };
    let mut path = whole;
    while let Some((rest, group)) = path
        .strip_suffix(']')
        .and_then(|inner| inner.rsplit_once('['))
    {
        path = rest;
        let group = group.trim();
        let (slot, value) = match group.split_once('=') {
            Some((key, value)) if key.trim().eq_ignore_ascii_case("hdu") => {
                (&mut selection.hdu, value.trim())
            }
            Some((key, value)) if key.trim().eq_ignore_ascii_case("unit") => {
                (&mut selection.unit, value.trim())
            }
            _ => (&mut selection.column, group),
        };
        if value.is_empty() || slot.is_some() {
            return Err(Error::usage(format!(
                "`{whole}`: [{group}] is empty or given twice; write file.fits[COLUMN], file.fits[HDU=1][COLUMN] or file.fits[COLUMN][unit=K_CMB]"
            )));
        }
        *slot = Some(value.to_owned());
    }
    Ok((PathBuf::from(path), selection))
}

impl fmt::Display for Selection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(hdu) = &self.hdu {
            write!(f, "[HDU={hdu}]")?;
        }
        if let Some(column) = &self.column {
            write!(f, "[{column}]")?;
        }
        if let Some(unit) = &self.unit {
            write!(f, "[unit={unit}]")?;
        }
        Ok(())
    }
}
