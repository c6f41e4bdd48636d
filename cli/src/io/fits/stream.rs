//! The bytes of a file from front to back, uncompressed on the way and hashed as they are on the disk.
//!
//! Nothing is trusted about lengths: what a header announces is compared with [`Stream::remaining`] before any memory is
//! asked for. DEFLATE makes at most 1032 bytes of one, so that a small compressed file cannot announce much either.

use crate::error::{Error, Result};
use flate2::bufread::MultiGzDecoder;
use std::cell::RefCell;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::rc::Rc;

/// Bytes read at a time.
const CHUNK: usize = 1 << 16;
/// The most bytes that one byte of DEFLATE stands for.
const DEFLATE_RATIO: u64 = 1032;

/// A file being read.
pub(super) struct Stream<'a> {
    input: Input<'a>,
    hasher: Rc<RefCell<blake3::Hasher>>,
    position: u64,
    /// No position is beyond this.
    limit: u64,
    /// What errors call the file.
    pub(super) file: String,
}

enum Input<'a> {
    Plain(BufReader<Tee<'a>>),
    Gzip(BufReader<MultiGzDecoder<BufReader<Tee<'a>>>>),
}

/// Hashes what passes.
struct Tee<'a> {
    inner: Box<dyn Read + 'a>,
    hasher: Rc<RefCell<blake3::Hasher>>,
}

impl Read for Tee<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(buffer)?;
        self.hasher.borrow_mut().update(&buffer[..count]);
        Ok(count)
    }
}

impl<'a> Stream<'a> {
    pub(super) fn open(path: &Path) -> Result<Self> {
        let failed = |cause: io::Error| Error::io("read the map", path, &cause);
        let file = File::open(path).map_err(failed)?;
        let meta = file.metadata().map_err(failed)?;
        if meta.is_dir() {
            return Err(failed(io::ErrorKind::IsADirectory.into()));
        }
        // A pipe does not tell its length.
        let len = if meta.is_file() { meta.len() } else { u64::MAX };
        Self::new(file, len, &path.display().to_string())
    }

    /// Reads from `input`, which gives at most `len` bytes.
    pub(super) fn new(input: impl Read + 'a, len: u64, file: &str) -> Result<Self> {
        let hasher = Rc::new(RefCell::new(blake3::Hasher::new()));
        let mut raw = BufReader::with_capacity(
            CHUNK,
            Tee {
                inner: Box::new(input),
                hasher: Rc::clone(&hasher),
            },
        );
        let gzip = raw
            .fill_buf()
            .map_err(|cause| Error::io("read the map", Path::new(file), &cause))?
            .starts_with(&[0x1f, 0x8b]);
        let (input, limit) = if gzip {
            let decoder = BufReader::with_capacity(CHUNK, MultiGzDecoder::new(raw));
            (Input::Gzip(decoder), len.saturating_mul(DEFLATE_RATIO))
        } else {
            (Input::Plain(raw), len)
        };
        Ok(Self {
            input,
            hasher,
            position: 0,
            limit,
            file: file.to_owned(),
        })
    }

    /// No more bytes than this can follow.
    pub(super) const fn remaining(&self) -> u64 {
        self.limit.saturating_sub(self.position)
    }

    fn reader(&mut self) -> &mut dyn BufRead {
        match &mut self.input {
            Input::Plain(reader) => reader,
            Input::Gzip(reader) => reader,
        }
    }

    /// Whether the file ends here.
    pub(super) fn is_at_end(&mut self) -> Result<bool> {
        match self.reader().fill_buf() {
            Ok(bytes) => Ok(bytes.is_empty()),
            Err(cause) => Err(self.failure(&cause)),
        }
    }

    /// Fills `buffer`.
    pub(super) fn fill(&mut self, buffer: &mut [u8]) -> Result<()> {
        match self.reader().read_exact(buffer) {
            Ok(()) => {
                self.position += buffer.len() as u64;
                Ok(())
            }
            Err(cause) => Err(self.failure(&cause)),
        }
    }

    /// Passes over `count` bytes.
    pub(super) fn skip(&mut self, count: u64) -> Result<()> {
        let mut left = count;
        while left > 0 {
            let reader = self.reader();
            let step = match reader.fill_buf() {
                Ok(bytes) => left.min(bytes.len() as u64),
                Err(cause) => return Err(self.failure(&cause)),
            };
            if step == 0 {
                return Err(self.failure(&io::ErrorKind::UnexpectedEof.into()));
            }
            // No buffer is longer than usize says.
            reader.consume(step as usize);
            self.position += step;
            left -= step;
        }
        Ok(())
    }

    /// Reads what is left and returns the BLAKE3 hash of the whole file; of a compressed one, this checks its own sums.
    pub(super) fn finish(mut self) -> Result<String> {
        let drained = match &mut self.input {
            Input::Plain(reader) => io::copy(reader, &mut io::sink()),
            Input::Gzip(reader) => io::copy(reader, &mut io::sink())
                .and_then(|_| io::copy(reader.get_mut().get_mut(), &mut io::sink())),
        };
        drained.map_err(|cause| self.failure(&cause))?;
        let hash = self.hasher.borrow().finalize();
        Ok(hash.to_hex().to_string())
    }

    fn failure(&self, cause: &io::Error) -> Error {
        let (file, position) = (&self.file, self.position);
        match (cause.kind(), &self.input) {
            (io::ErrorKind::UnexpectedEof, _) => Error::input(format!(
                "`{file}` is cut short: it ends before what its headers announce is complete (after byte {position}); copy or download it again"
            )),
            (io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData, Input::Gzip(_)) => {
                Error::input(format!(
                    "`{file}` is damaged: its gzip stream breaks after byte {position} of the contents ({cause}); copy or download it again"
                ))
            }
            _ => Error::io("read the map", Path::new(file), cause),
        }
    }
}
