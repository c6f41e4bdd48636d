//! A map in a file, whatever its format.

use super::fits::{self, Selection};
use super::manifest::{FileRecord, Manifest};
use super::npy;
use super::raw;
use super::role::Role;
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
    /// A map of a FITS file.
    Fits {
        /// The file.
        path: PathBuf,
        /// Which of its maps.
        selection: Selection,
    },
    /// A map of a `.npy` file.
    Npy {
        /// The file.
        path: PathBuf,
        /// Which of its maps.
        selection: Selection,
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
    /// What the file leaves open and had to be assumed, a sentence each.
    pub notes: Vec<String>,
}

impl MapSource {
    /// The source that `spec` names.
    ///
    /// # Errors
    /// An extension that belongs to no format.
    pub fn parse(spec: impl AsRef<Path>) -> Result<Self> {
        let spec = spec.as_ref();
        let (path, selection) = fits::parse(spec)?;
        match Container::of(&path) {
            Some(Container::Fits) => Ok(Self::Fits { path, selection }),
            Some(Container::Npy) => Ok(Self::Npy { path, selection }),
            Some(Container::Raw(dtype)) if selection == Selection::default() => {
                Ok(Self::Raw { path, dtype })
            }
            Some(Container::Raw(_)) => Err(Error::usage(format!(
                "`{}`: a raw map is alone in its file; leave out {selection}",
                spec.display()
            ))),
            None => Err(Error::usage(format!(
                "`{}` is no map: the name must end in .fits or .fits.gz, in .npy, or in .f32 or .f64 (little-endian array in RING order)",
                spec.display()
            ))),
        }
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::Raw { path, .. } | Self::Fits { path, .. } | Self::Npy { path, .. } => path,
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
        self.read_for(None)
    }

    /// As [`read`](Self::read), for a purpose: of a file of several maps the one that serves it is read, and a unit that
    /// the file states is converted. A raw map is taken to be in the unit of the role.
    ///
    /// # Errors
    /// As [`read`](Self::read); or no such map, or a unit that cannot be converted.
    pub fn read_as(&self, role: Role) -> Result<MapFile> {
        self.read_for(Some(role))
    }

    fn read_for(&self, role: Option<Role>) -> Result<MapFile> {
        match self {
            Self::Fits { path, selection } => fits::read(path, selection, role),
            Self::Npy { path, selection } => npy::read(path, selection, role),
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
                    unit: role.map(|role| role.unit().to_owned()),
                    blake3,
                    notes: Vec::new(),
                })
            }
        }
    }
}

/// The kind of a file, by the extension of its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Container {
    Raw(Dtype),
    Fits,
    Npy,
}

impl Container {
    pub(super) fn of(path: &Path) -> Option<Self> {
        let extension = |path: &Path| Some(path.extension()?.to_str()?.to_ascii_lowercase());
        let outer = extension(path)?;
        let inner = match outer.as_str() {
            "gz" => extension(Path::new(path.file_stem()?))?,
            _ => outer.clone(),
        };
        match (outer.as_str(), inner.as_str()) {
            (_, "fits" | "fit" | "fts") => Some(Self::Fits),
            ("npy", _) => Some(Self::Npy),
            _ => dtype_of(path).map(Self::Raw),
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
