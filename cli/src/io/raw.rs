//! Raw maps: headerless little-endian arrays in RING order, their type in the extension, Nside from the length.

use crate::config::Dtype;
use crate::error::{Error, Result};
use crate::kernels::healpix::missing::{MISSING, is_missing};
use std::io::Read;
use std::path::{Path, PathBuf};

/// Largest Nside read: beyond it one map would not fit the memory of the machines the program is made for.
pub const LARGEST_NSIDE: u32 = 8192;

/// Bytes read, hashed and converted at a time.
const CHUNK: usize = 1 << 16;

/// Nside of a raw map of `bytes` bytes.
///
/// # Errors
/// A sentence saying why there is none: not a whole number of values, not 12 Nside² of them, Nside not a power of two
/// or above [`LARGEST_NSIDE`].
pub fn nside_of_len(bytes: u64, dtype: Dtype) -> Result<u32> {
    let size = dtype.size() as u64;
    let name = dtype.name();
    if bytes == 0 {
        return Err(Error::input(
            "it is empty; a raw map holds 12 Nside² values",
        ));
    }
    if !bytes.is_multiple_of(size) {
        return Err(Error::input(format!(
            "{bytes} bytes are no whole number of {name} values; the file is cut short or of another type"
        )));
    }
    let values = bytes / size;
    let nside = (values / 12).isqrt();
    if 12 * nside * nside != values {
        // The likeliest slip is the wrong extension: say so if the other type would fit.
        let other = match dtype {
            Dtype::F32 => Dtype::F64,
            Dtype::F64 => Dtype::F32,
        };
        let hint = if nside_of_len_fits(bytes, other) {
            format!("as {} it would fit: is the extension right?", other.name())
        } else {
            "the file is cut short or no HEALPix map".to_owned()
        };
        return Err(Error::input(format!(
            "{values} {name} values are not 12 Nside² for any Nside; {hint}"
        )));
    }
    match u32::try_from(nside) {
        Ok(nside) if nside.is_power_of_two() && nside <= LARGEST_NSIDE => Ok(nside),
        Ok(nside) if nside.is_power_of_two() => Err(Error::input(format!(
            "Nside {nside} is larger than {LARGEST_NSIDE}; degrade the map first"
        ))),
        _ => Err(Error::input(format!(
            "{values} {name} values mean Nside {nside}, which is not a power of two; resample the map"
        ))),
    }
}

fn nside_of_len_fits(bytes: u64, dtype: Dtype) -> bool {
    let size = dtype.size() as u64;
    let nside = (bytes / size / 12).isqrt();
    bytes.is_multiple_of(size) && 12 * nside * nside * size == bytes && nside.is_power_of_two()
}

/// The values of a raw map in memory, missing pixels as [`MISSING`].
///
/// # Errors
/// As [`nside_of_len`]; or an infinite value, with its pixel.
pub fn decode_raw(bytes: &[u8], dtype: Dtype) -> Result<Vec<f64>> {
    read(bytes, bytes.len() as u64, dtype, Path::new("memory")).map(|(_, values, _)| values)
}

/// The bytes of a raw map. f32 rounds to nearest; a value beyond its range is written as [`MISSING`], as is NaN.
#[must_use]
pub fn encode_raw(values: &[f64], dtype: Dtype) -> Vec<u8> {
    let values = values
        .iter()
        .map(|&value| if value.is_finite() { value } else { MISSING });
    // Arrays of a known length: the compiler makes vectors of the loop.
    match dtype {
        Dtype::F64 => {
            let bytes: Vec<[u8; 8]> = values.map(f64::to_le_bytes).collect();
            bytes.into_flattened()
        }
        Dtype::F32 => {
            let bytes: Vec<[u8; 4]> = values.map(|x| single(x).to_le_bytes()).collect();
            bytes.into_flattened()
        }
    }
}

/// Rounded to f32; [`MISSING`] if there is no value, or none of that size.
#[expect(
    clippy::cast_possible_truncation,
    reason = "rounding to f32 is what is asked for"
)]
pub(super) fn single(value: f64) -> f32 {
    let rounded = value as f32;
    if rounded.is_finite() {
        rounded
    } else {
        MISSING as f32
    }
}

/// Reads `len` bytes: Nside, the values with missing pixels as [`MISSING`], and the BLAKE3 hash of the bytes.
pub(super) fn read(
    input: impl Read,
    len: u64,
    dtype: Dtype,
    path: &Path,
) -> Result<(u32, Vec<f64>, String)> {
    let nside = nside_of_len(len, dtype)?;
    let npix = 12 * nside as usize * nside as usize;
    let mut values = Vec::with_capacity(npix);
    let mut reader = RawReader::new(input, dtype, path);
    reader.read(npix, &mut values)?;
    Ok((nside, values, reader.finish()))
}

/// Reads values one after the other, and hashes their bytes.
#[derive(Debug)]
pub(super) struct RawReader<R> {
    input: R,
    dtype: Dtype,
    path: PathBuf,
    hasher: blake3::Hasher,
    buffer: Vec<u8>,
    pixel: usize,
}

impl<R: Read> RawReader<R> {
    /// Of a file that errors call `path`.
    pub(super) fn new(input: R, dtype: Dtype, path: &Path) -> Self {
        Self {
            input,
            dtype,
            path: path.to_owned(),
            hasher: blake3::Hasher::new(),
            buffer: vec![0; CHUNK],
            pixel: 0,
        }
    }

    /// Appends the next `count` values, missing ones as [`MISSING`].
    ///
    /// # Errors
    /// Fewer are left, or one is infinite.
    pub(super) fn read(&mut self, count: usize, values: &mut Vec<f64>) -> Result<()> {
        let end = values.len() + count;
        while values.len() < end {
            let size = CHUNK.min((end - values.len()) * self.dtype.size());
            let chunk = &mut self.buffer[..size];
            self.input
                .read_exact(chunk)
                .map_err(|cause| Error::io("read", &self.path, &cause))?;
            self.hasher.update(chunk);
            let first = values.len();
            match self.dtype {
                Dtype::F64 => values.extend(
                    chunk
                        .as_chunks()
                        .0
                        .iter()
                        .map(|&bytes| f64::from_le_bytes(bytes)),
                ),
                Dtype::F32 => values.extend(
                    chunk
                        .as_chunks()
                        .0
                        .iter()
                        .map(|&bytes| f64::from(f32::from_le_bytes(bytes))),
                ),
            }
            for value in &mut values[first..] {
                if is_missing(*value) {
                    *value = MISSING;
                } else if value.is_infinite() {
                    return Err(Error::input(format!(
                        "pixel {} is infinite; write NaN or {MISSING:e} where there is no value",
                        self.pixel
                    )));
                }
                self.pixel += 1;
            }
        }
        Ok(())
    }

    /// The hash of what was read.
    pub(super) fn finish(self) -> String {
        self.hasher.finalize().to_hex().to_string()
    }
}
