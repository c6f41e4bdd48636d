//! Files and directories in the making: under a temporary name beside the final one, gone if anything goes wrong.

use crate::error::{Error, Result};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// Everything that has to go when the user interrupts the program.
static IN_THE_MAKING: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Makes Ctrl-C (and SIGTERM, SIGHUP) remove whatever is half-made, say so, and end the program with status 1.
///
/// For the `dust3d` command; a program with signal handling of its own drops its [`RunDir`](super::RunDir) instead.
///
/// # Errors
/// The handler cannot be installed, for example because there is one already.
pub fn on_interrupt() -> Result<()> {
    ctrlc::set_handler(|| {
        INTERRUPTED.store(true, Ordering::SeqCst);
        let paths = IN_THE_MAKING
            .lock()
            .map(|mut list| std::mem::take(&mut *list))
            .unwrap_or_default();
        for path in &paths {
            // A file being written at this moment may reappear once; from now on `check_interrupt` lets no other begin.
            for _ in 0..10 {
                if remove(path).is_ok() {
                    break;
                }
            }
        }
        eprintln!("dust3d: {}", Error::interrupted());
        std::process::exit(i32::from(Error::interrupted().exit_code()));
    })
    .map_err(|cause| {
        Error::new(
            crate::ErrorKind::Io,
            format!("cannot handle Ctrl-C: {cause}"),
        )
    })
}

/// Stops work that would write a new file after an interrupt.
pub(super) fn check_interrupt() -> Result<()> {
    if INTERRUPTED.load(Ordering::SeqCst) {
        Err(Error::interrupted())
    } else {
        Ok(())
    }
}

/// A path that is removed when this is dropped, unless it was moved to its final place.
#[derive(Debug)]
pub(super) struct Partial {
    path: PathBuf,
}

impl Partial {
    /// Begins `.NAME.partial-<process>-<count>` beside `target`.
    pub(super) fn beside(target: &Path) -> Self {
        let path = name_beside(target);
        if let Ok(mut list) = IN_THE_MAKING.lock() {
            list.push(path.clone());
        }
        Self { path }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Gives it its final name; an existing file of that name is replaced.
    pub(super) fn rename(self, target: &Path) -> io::Result<()> {
        check_interrupt().map_err(io::Error::other)?;
        fs::rename(&self.path, target)
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        // After `rename` there is nothing to remove. An error cannot be reported from here, nor helped.
        let _ = remove(&self.path);
        if let Ok(mut list) = IN_THE_MAKING.lock() {
            list.retain(|path| *path != self.path);
        }
    }
}

/// A hidden name beside `target` that does not exist yet.
pub(super) fn name_beside(target: &Path) -> PathBuf {
    let name = target.file_name().unwrap_or_default().to_string_lossy();
    let process = std::process::id();
    (0..)
        .map(|count: u64| target.with_file_name(format!(".{name}.partial-{process}-{count}")))
        .find(|path| fs::symlink_metadata(path).is_err())
        .unwrap_or_default()
}

/// Removes a file or a directory, if it is there.
pub(super) fn remove(path: &Path) -> io::Result<()> {
    match fs::symlink_metadata(path) {
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(cause) => Err(cause),
        Ok(meta) if meta.is_dir() => fs::remove_dir_all(path),
        Ok(_) => fs::remove_file(path),
    }
}
