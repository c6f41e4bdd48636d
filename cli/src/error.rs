//! The one error type of the std layer: a kind, which fixes the exit status, and one sentence for the user.

use std::fmt;
use std::io;
use std::path::Path;

/// What went wrong, in the sense of what has to change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The command line or the configuration asks for something impossible.
    Usage,
    /// A file holds something it may not hold.
    Input,
    /// A file or the machine failed: unreadable, disk full.
    Io,
    /// A kernel refused its arguments.
    Kernel,
    /// The user interrupted the run.
    Interrupted,
    /// A finished run is not as it should be.
    Verdict,
}

/// An error of the std layer: one sentence that says what is wrong, where, and what to do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Error {
    kind: ErrorKind,
    message: String,
}

/// Results of the std layer.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// An error of the given kind. Line breaks, which a message may quote from the user, become spaces.
    pub fn new(kind: ErrorKind, message: impl Into<String>) -> Self {
        let message = message.into();
        let message = if message.contains(char::is_control) {
            message.replace(char::is_control, " ")
        } else {
            message
        };
        Self { kind, message }
    }

    /// The command line or the configuration is wrong.
    pub fn usage(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Usage, message)
    }

    /// The contents of an input are wrong.
    pub fn input(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Input, message)
    }

    /// An operation on a file failed; `action` completes "cannot …", for example `read` or `write`.
    pub fn io(action: &str, path: &Path, cause: &io::Error) -> Self {
        let path = path.display();
        let message = match cause.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => format!(
                "cannot {action} `{path}`: the disk is full; free some space or choose another directory"
            ),
            io::ErrorKind::NotFound => {
                format!(
                    "cannot {action} `{path}`: there is no such file or directory; check the path"
                )
            }
            io::ErrorKind::PermissionDenied => {
                format!("cannot {action} `{path}`: permission denied; check the rights of the path")
            }
            _ => format!("cannot {action} `{path}`: {cause}"),
        };
        Self::new(ErrorKind::Io, message)
    }

    /// The same error, taken as one of usage or configuration.
    #[must_use]
    pub fn as_usage(mut self) -> Self {
        self.kind = ErrorKind::Usage;
        self
    }

    /// The run was stopped by the user.
    #[must_use]
    pub fn interrupted() -> Self {
        Self::new(
            ErrorKind::Interrupted,
            "interrupted; nothing was left behind",
        )
    }

    /// What has to change.
    #[must_use]
    pub const fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// The exit status: 2 for an error of usage or configuration, 3 for a failed verdict, 1 for any other.
    #[must_use]
    pub const fn exit_code(&self) -> u8 {
        match self.kind {
            ErrorKind::Usage => 2,
            ErrorKind::Verdict => 3,
            _ => 1,
        }
    }

    /// The same error with one more thing to do at the end of its sentence.
    #[must_use]
    pub fn with_remedy(self, remedy: impl fmt::Display) -> Self {
        Self::new(self.kind, format!("{}; {remedy}", self.message))
    }

    /// The same error with `context: ` before its sentence.
    #[must_use]
    pub fn within(self, context: impl fmt::Display) -> Self {
        Self::new(self.kind, format!("{context}: {}", self.message))
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Error {}

impl From<dust3d_kernels::Error> for Error {
    fn from(cause: dust3d_kernels::Error) -> Self {
        Self::new(ErrorKind::Kernel, cause.to_string())
    }
}
