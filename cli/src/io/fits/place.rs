//! Where in a file something is wrong: the beginning of every sentence about it.

use crate::error::{Error, Result};
use std::fmt;

/// An HDU of a file.
#[derive(Debug, Clone)]
pub(super) struct Place {
    pub(super) file: String,
    pub(super) hdu: usize,
    /// EXTNAME, if there is one.
    pub(super) name: Option<String>,
}

impl Place {
    pub(super) fn new(file: &str, hdu: usize) -> Self {
        Self {
            file: file.to_owned(),
            hdu,
            name: None,
        }
    }

    /// Something is wrong with the HDU: what, and what to do.
    pub(super) fn error(&self, sentence: impl fmt::Display) -> Error {
        Error::input(format!("{self}: {sentence}"))
    }

    /// Something is wrong with one keyword.
    pub(super) fn keyword(&self, key: &str, sentence: impl fmt::Display) -> Error {
        Error::input(format!("{self}, {key}: {sentence}"))
    }

    /// As [`keyword`](Self::keyword), where a value is expected.
    pub(super) fn refuse<T>(&self, key: &str, sentence: impl fmt::Display) -> Result<T> {
        Err(self.keyword(key, sentence))
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}`, HDU {}", self.file, self.hdu)?;
        match &self.name {
            Some(name) => write!(f, " ({name})"),
            None => Ok(()),
        }
    }
}
