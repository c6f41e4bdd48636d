//! Maps between stages: in memory, or in scratch files where those of all layers would not fit.
//!
//! A run of six layers keeps thirty maps between its stages, 12 GB at Nside 2048. Stages that work pixel by pixel take
//! them in slabs ([`slabs`]), so that whether they lie in memory or on disk changes no bit of any result. Scratch files
//! have no name: the system removes them however the program ends.

use crate::error::{Error, Result};
use std::borrow::Cow;
use std::fs::File;
use std::io::Write as _;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Pixels that stages work on at a time; a multiple of [`CHUNK`](crate::parallel::CHUNK).
pub const SLAB: usize = 1 << 20;

/// Maps of up to so many pixels stay in memory, as a rule: thirty of them are 1 GB.
pub const MEMORY_PIXELS: usize = 1 << 22;

/// The pixel ranges that a map of `npix` pixels is worked on in.
pub fn slabs(npix: usize) -> impl Iterator<Item = Range<usize>> {
    (0..npix.div_ceil(SLAB)).map(move |k| k * SLAB..((k + 1) * SLAB).min(npix))
}

/// Where maps are kept.
#[derive(Debug, Clone)]
pub struct Store {
    dir: PathBuf,
    memory_pixels: usize,
}

impl Store {
    /// A store that keeps maps of more than `memory_pixels` pixels in scratch files in `dir`.
    #[must_use]
    pub fn new(dir: &Path, memory_pixels: usize) -> Self {
        Self {
            dir: dir.to_owned(),
            memory_pixels,
        }
    }

    /// Whether maps of so many pixels stay in memory.
    #[must_use]
    pub const fn keeps_in_memory(&self, len: usize) -> bool {
        len <= self.memory_pixels
    }

    /// Keeps a map.
    ///
    /// # Errors
    /// A scratch file cannot be written.
    pub fn keep(&self, map: Vec<f64>) -> Result<Stored> {
        if self.keeps_in_memory(map.len()) {
            return Ok(Stored::Memory(map));
        }
        let mut pieces = self.begin(map.len())?;
        pieces.append(&map)?;
        Ok(pieces.stored)
    }

    /// Begins a map of `len` values that comes piece by piece.
    ///
    /// # Errors
    /// A scratch file cannot be made.
    pub fn begin(&self, len: usize) -> Result<Pieces> {
        let stored = if self.keeps_in_memory(len) {
            Stored::Memory(Vec::with_capacity(len))
        } else {
            let file = tempfile::tempfile_in(&self.dir)
                .map_err(|cause| Error::io("make a scratch file in", &self.dir, &cause))?;
            Stored::Disk {
                file,
                len: 0,
                dir: self.dir.clone(),
            }
        };
        Ok(Pieces { stored })
    }
}

/// A map that comes piece by piece, in order.
#[derive(Debug)]
pub struct Pieces {
    stored: Stored,
}

impl Pieces {
    /// Appends the next values.
    ///
    /// # Errors
    /// The scratch file cannot be written.
    pub fn append(&mut self, values: &[f64]) -> Result<()> {
        match &mut self.stored {
            Stored::Memory(map) => map.extend_from_slice(values),
            Stored::Disk { file, len, dir } => {
                file.write_all(bytemuck::cast_slice(values))
                    .map_err(|cause| Error::io("write a scratch file in", dir, &cause))?;
                *len += values.len();
            }
        }
        Ok(())
    }

    /// The map, complete.
    #[must_use]
    pub fn finish(self) -> Stored {
        self.stored
    }
}

/// A map in memory or on disk.
#[derive(Debug)]
pub enum Stored {
    /// In memory.
    Memory(Vec<f64>),
    /// In a scratch file, in the machine's own byte order.
    Disk {
        /// The file.
        file: File,
        /// Number of values.
        len: usize,
        /// Its directory.
        dir: PathBuf,
    },
}

impl Stored {
    /// Number of values.
    #[must_use]
    pub const fn len(&self) -> usize {
        match self {
            Self::Memory(map) => map.len(),
            Self::Disk { len, .. } => *len,
        }
    }

    /// Whether there are none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The values in `range`, which lies in the map: borrowed, or read from disk. Threads may read at once.
    ///
    /// # Errors
    /// The scratch file cannot be read.
    pub fn view(&self, range: Range<usize>) -> Result<Cow<'_, [f64]>> {
        match self {
            Self::Memory(map) => Ok(Cow::Borrowed(&map[range])),
            Self::Disk { file, dir, .. } => {
                let mut values = vec![0.0; range.len()];
                read_at(
                    file,
                    bytemuck::cast_slice_mut(&mut values),
                    range.start as u64 * 8,
                )
                .map_err(|cause| Error::io("read a scratch file in", dir, &cause))?;
                Ok(Cow::Owned(values))
            }
        }
    }

    /// All values: borrowed, or read from disk.
    ///
    /// # Errors
    /// The scratch file cannot be read.
    pub fn whole(&self) -> Result<Cow<'_, [f64]>> {
        self.view(0..self.len())
    }

    /// The whole map, and the end of the stored one.
    ///
    /// # Errors
    /// The scratch file cannot be read.
    pub fn take(self) -> Result<Vec<f64>> {
        match self {
            Self::Memory(map) => Ok(map),
            Self::Disk { .. } => Ok(self.whole()?.into_owned()),
        }
    }
}

#[cfg(unix)]
fn read_at(file: &File, bytes: &mut [u8], offset: u64) -> std::io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, bytes, offset)
}

#[cfg(windows)]
fn read_at(file: &File, mut bytes: &mut [u8], mut offset: u64) -> std::io::Result<()> {
    use std::os::windows::fs::FileExt as _;
    while !bytes.is_empty() {
        let n = file.seek_read(bytes, offset)?;
        if n == 0 {
            return Err(std::io::ErrorKind::UnexpectedEof.into());
        }
        bytes = &mut bytes[n..];
        offset += n as u64;
    }
    Ok(())
}
