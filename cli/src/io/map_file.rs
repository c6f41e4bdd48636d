//! A map in a file, whatever its format.

use super::manifest::{FileRecord, Manifest};
use super::raw;
use crate::config::Dtype;
use crate::error::{Error, Result};
use std::fs::File;
use std::path::{Path, PathBuf};

/// Where a map comes from: a file and, by its name, a format. Other formats become further variants.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum MapSource {
    /// A raw map.
    Raw {
        /// The file.
        path: PathBuf,
        /// Its element type, from the extension.
        dtype: Dtype,
    },
}

/// A map as it is in its file.
#[derive(Debug, Clone, PartialEq)]
pub struct MapFile {
    /// Resolution, a power of two.
    pub nside: u32,
    /// 12 Nside² values in RING order, finite or [`MISSING`](crate::kernels::healpix::missing::MISSING).
    pub values: Vec<f64>,
    /// Element type in the file.
    pub dtype: Dtype,
    /// Unit, if the file states one.
    pub unit: Option<String>,
    /// BLAKE3 hash of the file, hexadecimal.
    pub blake3: String,
}

impl MapSource {
    /// The source that `spec` names.
    ///
    /// # Errors
    /// An extension that belongs to no format.
    pub fn parse(spec: impl AsRef<Path>) -> Result<Self> {
        let path = spec.as_ref();
        match dtype_of(path) {
            Some(dtype) => Ok(Self::Raw {
                path: path.to_owned(),
                dtype,
            }),
            None => Err(Error::usage(format!(
                "`{}` is no map: the name must end in .f32 or .f64 (little-endian array in RING order)",
                path.display()
            ))),
        }
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::Raw { path, .. } => path,
        }
    }

    /// What the manifest of the run to which the file belongs says of it, if it belongs to one.
    #[must_use]
    pub fn record(&self) -> Option<FileRecord> {
        let path = std::fs::canonicalize(self.path()).ok()?;
        path.ancestors().skip(1).take(2).find_map(|dir| {
            let files = Manifest::read(dir).ok()?.files;
            files
                .into_iter()
                .find(|record| dir.join(&record.path) == path)
        })
    }

    /// Reads and checks the file: length, Nside, every value finite or missing.
    ///
    /// # Errors
    /// A file that cannot be read, or holds no map; the sentence names it.
    pub fn read(&self) -> Result<MapFile> {
        match self {
            Self::Raw { path, dtype } => {
                let open = || {
                    let file = File::open(path)?;
                    let meta = file.metadata()?;
                    if meta.is_dir() {
                        return Err(std::io::ErrorKind::IsADirectory.into());
                    }
                    Ok((file, meta.len()))
                };
                let (file, len) =
                    open().map_err(|cause| Error::io("read the map", path, &cause))?;
                let (nside, values, blake3) = raw::read(file, len, *dtype, path)
                    .map_err(|error| error.within(path.display()))?;
                Ok(MapFile {
                    nside,
                    values,
                    dtype: *dtype,
                    unit: None,
                    blake3,
                })
            }
        }
    }
}

/// The element type of a raw map by the extension of its name.
pub(super) fn dtype_of(path: &Path) -> Option<Dtype> {
    match path.extension()?.to_str()? {
        "f32" => Some(Dtype::F32),
        "f64" => Some(Dtype::F64),
        _ => None,
    }
}
