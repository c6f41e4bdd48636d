//! A finished run, read back.

use super::manifest::{FileRecord, Manifest};
use super::map_file::{MapFile, MapSource};
use super::raw::RawReader;
use crate::error::{Error, Result};
use std::fs::File;
use std::path::{Path, PathBuf};

/// A finished run's directory.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// The directory.
    pub dir: PathBuf,
    /// Its manifest.
    pub manifest: Manifest,
}

impl Run {
    /// Opens the directory that `dust3d run --out` made.
    ///
    /// # Errors
    /// No finished run.
    pub fn open(dir: &Path) -> Result<Self> {
        let manifest = Manifest::read(dir)?;
        if manifest.command != "run" {
            return Err(Error::usage(format!(
                "`{}` was made by `dust3d {}`, not by `dust3d run`; give the directory of a run",
                dir.display(),
                manifest.command
            )));
        }
        Ok(Self {
            dir: dir.to_owned(),
            manifest,
        })
    }

    /// Number of layers.
    #[must_use]
    pub fn layers(&self) -> usize {
        self.manifest.layers.unwrap_or(0)
    }

    /// Whether the run holds the file called `stem`.
    #[must_use]
    pub fn holds(&self, stem: &str) -> bool {
        self.record(stem).is_ok()
    }

    /// What the manifest says of the file called `stem`, such as `templates/I_1`.
    ///
    /// # Errors
    /// The run does not hold it.
    pub fn record(&self, stem: &str) -> Result<&FileRecord> {
        let record = self.manifest.files.iter().find(|file| {
            file.path
                .rsplit_once('.')
                .is_some_and(|(name, _)| name == stem)
        });
        record.ok_or_else(|| {
            Error::input(format!(
                "the run `{}` does not hold {stem}; make it again (with --keep all for intermediate stages)",
                self.dir.display()
            ))
        })
    }

    /// Reads the map called `stem`.
    ///
    /// # Errors
    /// The run does not hold it, or it is not as it was when the run was made.
    pub fn map(&self, stem: &str) -> Result<MapFile> {
        let record = self.record(stem)?;
        let path = self.dir.join(&record.path);
        let map = MapSource::parse(&path)?.read()?;
        check_hash(&map.blake3, record, &path)?;
        Ok(map)
    }

    /// Opens the map called `stem` to be read piece by piece.
    ///
    /// # Errors
    /// The run does not hold it, or it has another length than the run's maps.
    pub fn stream(&self, stem: &str) -> Result<MapStream> {
        let record = self.record(stem)?;
        let path = self.dir.join(&record.path);
        let dtype = match MapSource::parse(&path)? {
            MapSource::Raw { dtype, .. } => dtype,
            _ => return Err(Error::input(format!("`{}` is no raw map", path.display()))),
        };
        let failed = |cause| Error::io("read the map", &path, &cause);
        let file = File::open(&path).map_err(failed)?;
        let len = file.metadata().map_err(failed)?.len();
        let npix = 12 * u64::from(self.manifest.nside).pow(2);
        if len != npix * dtype.size() as u64 {
            return Err(changed(&path));
        }
        Ok(MapStream {
            reader: RawReader::new(file, dtype, &path),
            record: record.clone(),
            path,
        })
    }
}

/// A map of a run that is read piece by piece, from its first pixel to its last.
#[derive(Debug)]
pub struct MapStream {
    reader: RawReader<File>,
    record: FileRecord,
    path: PathBuf,
}

impl MapStream {
    /// The next `count` values.
    ///
    /// # Errors
    /// They cannot be read.
    pub fn next(&mut self, count: usize) -> Result<Vec<f64>> {
        let mut values = Vec::with_capacity(count);
        self.reader
            .read(count, &mut values)
            .map_err(|error| error.within(self.path.display()))?;
        Ok(values)
    }

    /// Checks that what was read, all of the map, is what the run wrote.
    ///
    /// # Errors
    /// It is not.
    pub fn finish(self) -> Result<()> {
        check_hash(&self.reader.finish(), &self.record, &self.path)
    }
}

fn check_hash(hash: &str, record: &FileRecord, path: &Path) -> Result<()> {
    if hash == record.blake3 {
        Ok(())
    } else {
        Err(changed(path))
    }
}

fn changed(path: &Path) -> Error {
    Error::input(format!(
        "`{}` is not the file that the run wrote: its contents have changed; make the run again",
        path.display()
    ))
}
