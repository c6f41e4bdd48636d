//! Run directories: complete under their name, or not there at all.

use super::c128;
use super::manifest::{FileRecord, MANIFEST, Manifest};
use super::partial::{Partial, check_interrupt, name_beside, remove};
use super::raw::encode_raw;
use crate::config::Dtype;
use crate::error::{Error, Result};
use crate::kernels::Complex;
use rayon::prelude::*;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Values encoded, hashed and written at a time.
const CHUNK: usize = 1 << 16;
/// Chunks encoded together.
const BATCH: usize = 16;

/// A directory in the making. Files are written under a temporary name beside the final one; [`finish`](Self::finish)
/// writes the manifest and moves the directory to its place. Dropped before that, it leaves nothing behind.
///
/// Files may be written from several threads.
#[derive(Debug)]
pub struct RunDir {
    target: PathBuf,
    partial: Partial,
    files: Mutex<Vec<FileRecord>>,
}

impl RunDir {
    /// Whether [`create`](Self::create) would begin the directory.
    ///
    /// # Errors
    /// `target` exists and may not be replaced.
    pub fn check(target: &Path, force: bool) -> Result<()> {
        match fs::symlink_metadata(target) {
            Ok(_) => check_replaceable(target, force),
            Err(_) => Ok(()),
        }
    }

    /// Begins the directory `target`, whose parent is made if need be.
    ///
    /// With `force`, an existing empty directory or one made by this program is replaced at the end, not before.
    ///
    /// # Errors
    /// `target` exists and may not be replaced, or a directory cannot be made.
    pub fn create(target: &Path, force: bool) -> Result<Self> {
        let target = match target.file_name() {
            Some(_) => target.to_owned(),
            // `.` and `..` have no name to put the temporary one beside.
            None => {
                fs::canonicalize(target).map_err(|cause| Error::io("write to", target, &cause))?
            }
        };
        Self::check(&target, force)?;
        if let Some(parent) = target
            .parent()
            .filter(|parent| !parent.as_os_str().is_empty())
        {
            fs::create_dir_all(parent)
                .map_err(|cause| Error::io("make the directory", parent, &cause))?;
        }
        let partial = Partial::beside(&target);
        fs::create_dir(partial.path())
            .map_err(|cause| Error::io("make the directory", &target, &cause))?;
        Ok(Self {
            target,
            partial,
            files: Mutex::new(Vec::new()),
        })
    }

    /// Where the directory will be.
    #[must_use]
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Where a file of the directory is meanwhile.
    #[must_use]
    pub fn path(&self, name: &str) -> PathBuf {
        self.partial.path().join(name)
    }

    /// Writes the map `stem` (such as `intensity/I_1`), RING order, with the extension of its type; NaN becomes
    /// [`MISSING`](crate::kernels::healpix::missing::MISSING).
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn map(
        &self,
        stem: &str,
        quantity: &str,
        unit: &str,
        nside: u32,
        values: &[f64],
        dtype: Dtype,
    ) -> Result<()> {
        let mut map = self.begin_map(stem, quantity, unit, nside, dtype)?;
        map.append(values)?;
        map.finish()
    }

    /// Begins a map, as [`map`](Self::map), that comes piece by piece.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn begin_map(
        &self,
        stem: &str,
        quantity: &str,
        unit: &str,
        nside: u32,
        dtype: Dtype,
    ) -> Result<MapWriter<'_>> {
        let name = format!("{stem}.{}", dtype.name());
        Ok(MapWriter {
            dir: self,
            file: self.begin(&name)?,
            dtype,
            record: FileRecord {
                path: name,
                quantity: quantity.to_owned(),
                unit: Some(unit.to_owned()),
                nside: Some(nside),
                dtype: Some(dtype.name().to_owned()),
                blake3: String::new(),
            },
        })
    }

    /// Takes over files of a finished run: as further names of the same files where the system allows it, else copied.
    ///
    /// # Errors
    /// A file can be neither linked nor copied.
    pub fn adopt(&self, from: &Path, files: &[FileRecord]) -> Result<()> {
        for file in files {
            check_interrupt()?;
            let (source, to) = (from.join(&file.path), self.path(&file.path));
            make_parent(&to)?;
            if fs::hard_link(&source, &to).is_err() {
                fs::copy(&source, &to).map_err(|cause| Error::io("copy", &source, &cause))?;
            }
            self.record(file.clone())?;
        }
        Ok(())
    }

    /// The files written so far.
    #[must_use]
    pub fn records(&self) -> Vec<FileRecord> {
        self.files.lock().map(|f| f.clone()).unwrap_or_default()
    }

    /// Writes the coefficients `stem`.c128 in healpy's order.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn alm(
        &self,
        stem: &str,
        quantity: &str,
        unit: &str,
        values: &[Complex<f64>],
    ) -> Result<()> {
        let name = format!("{stem}.c128");
        let mut file = self.begin(&name)?;
        for chunk in values.chunks(CHUNK) {
            file.write(&c128::encode(chunk))?;
        }
        let record = FileRecord {
            path: name,
            quantity: quantity.to_owned(),
            unit: Some(unit.to_owned()),
            nside: None,
            dtype: Some("c128".to_owned()),
            blake3: file.finish()?,
        };
        self.record(record)
    }

    /// Writes any other file: a table, a picture.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn file(&self, name: &str, quantity: &str, bytes: &[u8]) -> Result<()> {
        let mut file = self.begin(name)?;
        file.write(bytes)?;
        let record = FileRecord {
            path: name.to_owned(),
            quantity: quantity.to_owned(),
            unit: None,
            nside: None,
            dtype: None,
            blake3: file.finish()?,
        };
        self.record(record)
    }

    /// Writes the manifest with every file so far, in order of their paths, and moves the directory to its place.
    ///
    /// # Errors
    /// The manifest cannot be written or the directory not moved; then nothing is left of it, and what was there
    /// before still is.
    pub fn finish(self, mut manifest: Manifest) -> Result<Manifest> {
        manifest.files = self
            .files
            .into_inner()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        manifest.files.sort_by(|a, b| a.path.cmp(&b.path));
        let path = self.partial.path().join(MANIFEST);
        fs::write(&path, manifest.to_json()).map_err(|cause| Error::io("write", &path, &cause))?;
        let failed = |cause| Error::io("write the directory", &self.target, &cause);
        if fs::symlink_metadata(&self.target).is_ok() {
            // Not a `Partial`: an interrupt between the two renames must not remove what the user had.
            let old = name_beside(&self.target);
            fs::rename(&self.target, &old).map_err(failed)?;
            if let Err(cause) = self.partial.rename(&self.target) {
                let _ = fs::rename(&old, &self.target);
                return Err(failed(cause));
            }
            remove(&old)
                .map_err(|cause| Error::io("remove the replaced directory", &old, &cause))?;
        } else {
            self.partial.rename(&self.target).map_err(failed)?;
        }
        Ok(manifest)
    }

    pub(super) fn begin(&self, name: &str) -> Result<Hashed> {
        check_interrupt()?;
        let path = self.path(name);
        make_parent(&path)?;
        Hashed::create(path, self.target.join(name))
    }

    pub(super) fn record(&self, record: FileRecord) -> Result<()> {
        if let Ok(mut files) = self.files.lock() {
            files.push(record);
        }
        Ok(())
    }
}

fn make_parent(path: &Path) -> Result<()> {
    match path.parent() {
        Some(parent) => fs::create_dir_all(parent)
            .map_err(|cause| Error::io("make the directory", parent, &cause)),
        None => Ok(()),
    }
}

/// A map of a run that is written piece by piece.
#[derive(Debug)]
pub struct MapWriter<'a> {
    dir: &'a RunDir,
    file: Hashed,
    dtype: Dtype,
    record: FileRecord,
}

impl MapWriter<'_> {
    /// Writes the next values.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn append(&mut self, values: &[f64]) -> Result<()> {
        // Encoding and hashing are on a par with the copy into the system's cache: the first is shared among threads.
        for batch in values.chunks(BATCH * CHUNK) {
            let encoded: Vec<Vec<u8>> = batch
                .par_chunks(CHUNK)
                .map(|chunk| encode_raw(chunk, self.dtype))
                .collect();
            for bytes in encoded {
                self.file.write(&bytes)?;
            }
        }
        Ok(())
    }

    /// Ends the file.
    ///
    /// # Errors
    /// None at present; the result is for those of closing.
    pub fn finish(self) -> Result<()> {
        let record = FileRecord {
            blake3: self.file.finish()?,
            ..self.record
        };
        self.dir.record(record)
    }
}

/// An existing directory is replaced only if asked for, and only if this program made it or it is empty: a slip of the
/// hand in `--out` must not cost the user anything.
fn check_replaceable(target: &Path, force: bool) -> Result<()> {
    let shown = target.display();
    if !force {
        return Err(Error::usage(format!(
            "`{shown}` exists already; choose another --out, or replace it with --force"
        )));
    }
    let is_empty = || fs::read_dir(target).is_ok_and(|mut entries| entries.next().is_none());
    if target.is_dir() && (is_empty() || made_by_us(target)) {
        return Ok(());
    }
    Err(Error::usage(format!(
        "`{shown}` exists and was not made by dust3d (it has no {MANIFEST} of this program); choose another --out, or remove it yourself"
    )))
}

fn made_by_us(dir: &Path) -> bool {
    fs::read(dir.join(MANIFEST))
        .ok()
        .and_then(|text| serde_json::from_slice::<serde_json::Value>(&text).ok())
        .is_some_and(|manifest| manifest["program"] == "dust3d")
}

/// Writes one file under its final name; nothing is left half-written. What is no regular file is written in place.
pub(crate) fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    write_streamed(path, |sink| sink(bytes))
}

/// As [`write_atomically`], the bytes given to a sink one after the other.
pub(super) fn write_streamed(
    path: &Path,
    write: impl FnOnce(&mut dyn FnMut(&[u8]) -> Result<()>) -> Result<()>,
) -> Result<()> {
    let failed = |cause| Error::io("write", path, &cause);
    let fill = |actual: &Path| {
        let mut file = BufWriter::new(File::create(actual).map_err(failed)?);
        write(&mut |bytes| file.write_all(bytes).map_err(failed))?;
        file.flush().map_err(failed)
    };
    if fs::metadata(path).is_ok_and(|meta| !meta.is_file()) {
        return fill(path);
    }
    let partial = Partial::beside(path);
    fill(partial.path())?;
    partial.rename(path).map_err(failed)
}

/// A file that is hashed as it is written.
#[derive(Debug)]
pub(super) struct Hashed {
    file: File,
    hasher: blake3::Hasher,
    /// The name under which errors speak of it.
    shown: PathBuf,
}

impl Hashed {
    fn create(path: PathBuf, shown: PathBuf) -> Result<Self> {
        let file = File::create(path).map_err(|cause| Error::io("write", &shown, &cause))?;
        Ok(Self {
            file,
            hasher: blake3::Hasher::new(),
            shown,
        })
    }

    /// Hashes and writes, side by side.
    pub(super) fn write(&mut self, bytes: &[u8]) -> Result<()> {
        let (file, hasher) = (&mut self.file, &mut self.hasher);
        let (written, _) = rayon::join(|| file.write_all(bytes), || hasher.update(bytes));
        written.map_err(|cause| Error::io("write", &self.shown, &cause))
    }

    pub(super) fn finish(self) -> Result<String> {
        Ok(self.hasher.finalize().to_hex().to_string())
    }
}
