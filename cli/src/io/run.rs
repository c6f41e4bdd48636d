//! A finished run, read back.

use super::manifest::{FileRecord, Manifest};
use super::map_file::{MapFile, MapSource};
use crate::error::{Error, Result};
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
        if map.blake3 != record.blake3 {
            return Err(Error::input(format!(
                "`{}` is not the file that the run wrote: its contents have changed; make the run again",
                path.display()
            )));
        }
        Ok(map)
    }
}
