//! Maps out, in whatever format is asked for.

use super::fits::write::{self as fits, MapColumn, MapTable, Provenance};
use super::manifest::FileRecord;
use super::map_file::Container;
use super::npy;
use super::output::{RunDir, write_streamed};
use super::raw::encode_raw;
use crate::config::Dtype;
use crate::error::{Error, Result};
use crate::kernels::Complex;
use std::path::Path;

/// Format of maps that are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapFormat {
    /// Headerless, one map a file: `.f32`, `.f64`.
    Raw(Dtype),
    /// FITS, several maps a file: `.fits`.
    Fits(Dtype),
    /// numpy: `.npy`.
    Npy(Dtype),
}

impl MapFormat {
    /// The format that the name of a file asks for; `dtype` where the name leaves it open.
    ///
    /// # Errors
    /// A name that belongs to no format.
    pub fn of(path: &Path, dtype: Dtype) -> Result<Self> {
        let compressed = path.extension().is_some_and(|extension| extension == "gz");
        match Container::of(path).filter(|_| !compressed) {
            Some(Container::Raw(dtype)) => Ok(Self::Raw(dtype)),
            Some(Container::Fits) => Ok(Self::Fits(dtype)),
            Some(Container::Npy) => Ok(Self::Npy(dtype)),
            None => Err(Error::usage(format!(
                "`{}` is no name for a map that can be written; it must end in .f32, .f64, .fits or .npy",
                path.display()
            ))),
        }
    }

    /// The extension of its files.
    #[must_use]
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Raw(dtype) => dtype.name(),
            Self::Fits(_) => "fits",
            Self::Npy(_) => "npy",
        }
    }

    /// Type of the values.
    #[must_use]
    pub const fn dtype(self) -> Dtype {
        match self {
            Self::Raw(dtype) | Self::Fits(dtype) | Self::Npy(dtype) => dtype,
        }
    }

    /// The bytes of the file of `table`, in order.
    fn encode(self, table: &MapTable<'_>, sink: &mut dyn FnMut(&[u8]) -> Result<()>) -> Result<()> {
        match self {
            Self::Fits(dtype) => fits::map(table, dtype, sink),
            Self::Npy(dtype) => npy::write(table, dtype, sink),
            Self::Raw(dtype) => match table.columns {
                [one] => one
                    .values
                    .chunks(1 << 13)
                    .try_for_each(|chunk| sink(&encode_raw(chunk, dtype))),
                _ => Err(Error::usage(
                    "a raw file holds one map; write several to .fits or .npy, or each to its own file",
                )),
            },
        }
    }
}

/// Writes the maps of `table` to one file under its final name; nothing is left half-written.
///
/// # Errors
/// Maps of different Nside, several maps for a raw file, or a file that cannot be written.
pub fn write_map(path: &Path, format: MapFormat, table: &MapTable<'_>) -> Result<()> {
    write_streamed(path, |sink| format.encode(table, sink))
}

/// Writes one map, RING order, under its final name, in the format of its extension (`.f32`, `.f64`; `.fits` and `.npy`
/// in f64); nothing is left half-written.
///
/// # Errors
/// Another extension, or a file that cannot be written.
pub fn write_map_file(path: &Path, values: &[f64]) -> Result<()> {
    let column = MapColumn {
        name: "MAP",
        unit: "",
        values,
    };
    let table = MapTable {
        columns: &[column],
        nested: false,
        provenance: &Provenance::default(),
    };
    write_map(path, MapFormat::of(path, Dtype::F64)?, &table)
}

impl RunDir {
    /// Writes the maps of `table`, which belong together: to `stem`.fits all of them, or each to `stem_NAME` with the
    /// extension of `format`.
    ///
    /// # Errors
    /// Maps of different Nside, or a file that cannot be written.
    pub fn maps(
        &self,
        stem: &str,
        quantity: &str,
        format: MapFormat,
        table: &MapTable<'_>,
    ) -> Result<()> {
        if matches!(format, MapFormat::Fits(_)) {
            let names: Vec<&str> = table.columns.iter().map(|column| column.name).collect();
            let quantity = format!("{} of {quantity}", names.join(", "));
            return self.table(&format!("{stem}.fits"), &quantity, format, table);
        }
        for column in table.columns {
            let name = format!("{stem}_{}.{}", column.name, format.extension());
            let one = MapTable {
                columns: std::slice::from_ref(column),
                ..*table
            };
            self.table(
                &name,
                &format!("{} of {quantity}", column.name),
                format,
                &one,
            )?;
        }
        Ok(())
    }

    /// Writes coefficients (`T`, `E`, `B` and their values in healpy's order) that belong together: to `stem`_alm.fits all
    /// of them, or each to `stem_NAME` as .c128 or .npy.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn coefficients(
        &self,
        stem: &str,
        quantity: &str,
        format: MapFormat,
        fields: &[(&str, &[Complex<f64>])],
        lmax: usize,
        unit: &str,
        provenance: &Provenance,
    ) -> Result<()> {
        if matches!(format, MapFormat::Fits(_)) {
            let names: Vec<&str> = fields.iter().map(|(name, _)| *name).collect();
            let name = format!("{stem}_alm.fits");
            let mut file = self.begin(&name)?;
            fits::alm(fields, lmax, unit, provenance, &mut |bytes| {
                file.write(bytes)
            })?;
            return self.record(FileRecord {
                path: name,
                quantity: format!("coefficients {} of {quantity}", names.join(", ")),
                unit: Some(unit.to_owned()),
                nside: None,
                dtype: Some("c128".to_owned()),
                blake3: file.finish()?,
            });
        }
        for (name, values) in fields {
            let quantity = format!("coefficients {name} of {quantity}");
            if !matches!(format, MapFormat::Npy(_)) {
                self.alm(&format!("{stem}_{name}"), &quantity, unit, values)?;
                continue;
            }
            let path = format!("{stem}_{name}.npy");
            let mut file = self.begin(&path)?;
            npy::write_alm(values, &mut |bytes| file.write(bytes))?;
            self.record(FileRecord {
                path,
                quantity,
                unit: Some(unit.to_owned()),
                nside: None,
                dtype: Some("c128".to_owned()),
                blake3: file.finish()?,
            })?;
        }
        Ok(())
    }

    fn table(
        &self,
        name: &str,
        quantity: &str,
        format: MapFormat,
        table: &MapTable<'_>,
    ) -> Result<()> {
        let nside = table.nside()?.get();
        let mut file = self.begin(name)?;
        format.encode(table, &mut |bytes| file.write(bytes))?;
        self.record(FileRecord {
            path: name.to_owned(),
            quantity: quantity.to_owned(),
            unit: table.columns.first().map(|column| column.unit.to_owned()),
            nside: u32::try_from(nside).ok(),
            dtype: Some(format.dtype().name().to_owned()),
            blake3: file.finish()?,
        })
    }
}
