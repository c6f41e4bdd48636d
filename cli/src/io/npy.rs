//! `.npy` files of numpy: one map of shape (12 Nside²), or several of shape (k, 12 Nside²), RING order.

use super::fits::Selection;
use super::fits::write::MapTable;
use super::map_file::MapFile;
use super::raw::{encode_raw, nside_of_len};
use super::role::Role;
use crate::config::Dtype;
use crate::error::{Error, Result};
use crate::kernels::Complex;
use crate::kernels::healpix::missing::{MISSING, is_missing};
use std::fs::File;
use std::io::Read;
use std::path::Path;

const MAGIC: &[u8; 6] = b"\x93NUMPY";
/// No header of a plain array is longer.
const LONGEST_HEADER: usize = 1 << 16;

/// The header (version 1.0) of an array of `shape`.
fn header(shape: &str, descr: &str) -> Vec<u8> {
    let mut text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({shape}), }}");
    // Data begin at a multiple of 64; the header ends with a newline.
    let len = (10 + text.len() + 1).next_multiple_of(64);
    text.extend(std::iter::repeat_n(' ', len - 10 - text.len() - 1));
    text.push('\n');
    let mut bytes = MAGIC.to_vec();
    bytes.extend_from_slice(&[1, 0]);
    bytes.extend_from_slice(&(text.len() as u16).to_le_bytes());
    bytes.extend_from_slice(text.as_bytes());
    bytes
}

/// The `.npy` file of `table`: one map as a vector, several as the rows of a matrix; missing pixels as
/// [`MISSING`].
///
/// # Errors
/// As [`MapTable::nside`]; or what the sink returns.
pub fn write(
    table: &MapTable<'_>,
    dtype: Dtype,
    sink: &mut dyn FnMut(&[u8]) -> Result<()>,
) -> Result<()> {
    let npix = table.nside()?.npix();
    let shape = match table.columns {
        [_] => format!("{npix},"),
        columns => format!("{}, {npix}", columns.len()),
    };
    let descr = match dtype {
        Dtype::F32 => "<f4",
        Dtype::F64 => "<f8",
    };
    sink(&header(&shape, descr))?;
    for column in table.columns {
        for chunk in column.values.chunks(1 << 13) {
            sink(&encode_raw(chunk, dtype))?;
        }
    }
    Ok(())
}

/// The `.npy` file of coefficients, complex128 in healpy's order, m-major, m ≥ 0.
///
/// # Errors
/// What the sink returns.
pub fn write_alm(values: &[Complex<f64>], sink: &mut dyn FnMut(&[u8]) -> Result<()>) -> Result<()> {
    sink(&header(&format!("{},", values.len()), "<c16"))?;
    values
        .chunks(1 << 13)
        .try_for_each(|chunk| sink(&super::c128::encode(chunk)))
}

/// Reads the map that `selection` (a number from 1) or `role` (I, Q, U are 1, 2, 3) means.
///
/// # Errors
/// A file that cannot be read, or that is no array of maps of f32 or f64; the sentence names it.
pub fn read(path: &Path, selection: &Selection, role: Option<Role>) -> Result<MapFile> {
    let failed = |cause| Error::io("read the map", path, &cause);
    let file = File::open(path).map_err(failed)?;
    let meta = file.metadata().map_err(failed)?;
    if meta.is_dir() {
        return Err(failed(std::io::ErrorKind::IsADirectory.into()));
    }
    read_from(file, meta.len(), selection, role).map_err(|error| error.within(path.display()))
}

/// As [`read`], from `len` bytes.
///
/// # Errors
/// As [`read`].
pub fn read_from(
    mut input: impl Read,
    len: u64,
    selection: &Selection,
    role: Option<Role>,
) -> Result<MapFile> {
    let mut hasher = blake3::Hasher::new();
    let mut take = |bytes: &mut [u8]| -> Result<()> {
        input
            .read_exact(bytes)
            .map_err(|cause| match cause.kind() {
                std::io::ErrorKind::UnexpectedEof => {
                    Error::input("the file is cut short; copy it again")
                }
                _ => Error::new(crate::ErrorKind::Io, format!("cannot read it: {cause}")),
            })?;
        hasher.update(bytes);
        Ok(())
    };
    let mut start = [0; 8];
    take(&mut start)?;
    if !start.starts_with(MAGIC) {
        return Err(Error::input(
            "it does not begin as a .npy file does; write it with numpy.save",
        ));
    }
    let (prefix, header_len) = if start[6] == 1 {
        let mut bytes = [0; 2];
        take(&mut bytes)?;
        (10, usize::from(u16::from_le_bytes(bytes)))
    } else {
        let mut bytes = [0; 4];
        take(&mut bytes)?;
        (12, u32::from_le_bytes(bytes) as usize)
    };
    if header_len > LONGEST_HEADER {
        return Err(Error::input(
            "its header is longer than that of any plain array; write it with numpy.save",
        ));
    }
    let mut text = vec![0; header_len];
    take(&mut text)?;
    let array = Array::parse(&String::from_utf8_lossy(&text))?;
    let data = len.saturating_sub(prefix + header_len as u64);
    let size = array.dtype.size() as u64;
    if array
        .count
        .checked_mul(array.npix)
        .and_then(|all| all.checked_mul(size))
        != Some(data)
    {
        return Err(Error::input(format!(
            "its shape ({}, {}) does not agree with the {data} bytes that follow; copy the file again",
            array.count, array.npix
        )));
    }
    let nside = nside_of_len(array.npix * size, array.dtype)?;
    let number = array.number(selection, role)?;
    let mut values = Vec::new();
    let mut buffer = vec![0; 1 << 16];
    for map in 0..array.count {
        let mut left = array.npix * size;
        while left > 0 {
            let count = left.min(buffer.len() as u64) as usize;
            let chunk = &mut buffer[..count];
            take(chunk)?;
            if map + 1 == number {
                array.decode(chunk, &mut values);
            }
            left -= count as u64;
        }
    }
    let factor = match (&selection.unit, role) {
        (Some(unit), Some(role)) => role
            .factor(unit)
            .ok_or_else(|| Error::usage(format!("[unit={unit}] is no unit of {}", role.title())))?,
        _ => 1.0,
    };
    for (pixel, value) in values.iter_mut().enumerate() {
        if is_missing(*value) {
            *value = MISSING;
        } else if value.is_infinite() {
            return Err(Error::input(format!(
                "pixel {pixel} is infinite; write NaN or {MISSING:e} where there is no value"
            )));
        } else {
            *value *= factor;
        }
    }
    Ok(MapFile {
        nside,
        values,
        dtype: array.dtype,
        unit: role
            .map(|role| role.unit().to_owned())
            .or(selection.unit.clone()),
        blake3: hasher.finalize().to_hex().to_string(),
        notes: Vec::new(),
    })
}

/// What a header says.
struct Array {
    dtype: Dtype,
    big_endian: bool,
    count: u64,
    npix: u64,
}

impl Array {
    fn parse(text: &str) -> Result<Self> {
        let after = |key: &str| text.split_once(key).map(|(_, rest)| rest.trim_start());
        let descr = after("'descr':").and_then(|rest| rest.strip_prefix('\'')?.split('\'').next());
        let (dtype, big_endian) = match descr {
            Some("<f8" | "=f8") => (Dtype::F64, false),
            Some("<f4" | "=f4") => (Dtype::F32, false),
            Some(">f8") => (Dtype::F64, true),
            Some(">f4") => (Dtype::F32, true),
            other => {
                return Err(Error::input(format!(
                    "its type {} is neither f32 nor f64; convert it with astype(\"f8\")",
                    other.unwrap_or("(none)").escape_debug()
                )));
            }
        };
        let shape: Option<Vec<u64>> = after("'shape':").and_then(|rest| {
            let (list, _) = rest.strip_prefix('(')?.split_once(')')?;
            let parts = list
                .split(',')
                .map(str::trim)
                .filter(|part| !part.is_empty());
            parts.map(|part| part.parse().ok()).collect()
        });
        let fortran = after("'fortran_order':").is_some_and(|rest| rest.starts_with("True"));
        let (count, npix) = match shape.as_deref() {
            Some(&[npix]) => (1, npix),
            Some(&[count, npix]) if !fortran || count == 1 => (count, npix),
            _ => {
                return Err(Error::input(
                    "its shape is neither (12 Nside²) nor (maps, 12 Nside²) in C order; write one map, or numpy.ascontiguousarray of several",
                ));
            }
        };
        Ok(Self {
            dtype,
            big_endian,
            count,
            npix,
        })
    }

    /// Which of the maps, from 1.
    fn number(&self, selection: &Selection, role: Option<Role>) -> Result<u64> {
        let asked = match selection.column.as_deref() {
            Some("I") => Some(1),
            Some("Q") => Some(2),
            Some("U") => Some(3),
            Some(text) => text.parse().ok(),
            None if self.count == 1 => Some(1),
            None => match role {
                None | Some(Role::Intensity(_)) => Some(1),
                Some(Role::StokesQ(_)) => Some(2),
                Some(Role::StokesU(_)) => Some(3),
                Some(_) => None,
            },
        };
        asked
            .filter(|number| (1..=self.count).contains(number))
            .ok_or_else(|| {
                Error::input(format!(
                    "it holds {} maps; say which one by its number from 1, as in file.npy[2]",
                    self.count
                ))
            })
    }

    fn decode(&self, bytes: &[u8], out: &mut Vec<f64>) {
        match (self.dtype, self.big_endian) {
            (Dtype::F64, false) => {
                out.extend(bytes.as_chunks().0.iter().map(|&b| f64::from_le_bytes(b)));
            }
            (Dtype::F64, true) => {
                out.extend(bytes.as_chunks().0.iter().map(|&b| f64::from_be_bytes(b)));
            }
            (Dtype::F32, false) => {
                out.extend(
                    bytes
                        .as_chunks()
                        .0
                        .iter()
                        .map(|&b| f64::from(f32::from_le_bytes(b))),
                );
            }
            (Dtype::F32, true) => {
                out.extend(
                    bytes
                        .as_chunks()
                        .0
                        .iter()
                        .map(|&b| f64::from(f32::from_be_bytes(b))),
                );
            }
        }
    }
}
