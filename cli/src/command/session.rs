//! What all commands share: who listens, how many threads, which vector instructions.

use crate::error::{Error, ErrorKind, Result};
use crate::kernels::simd::Level;
use crate::progress::{Progress, Silent, Stderr};

/// What all commands share.
pub(super) struct Session {
    quiet: bool,
    threads: Option<usize>,
    pub(super) level: Level,
}

impl Session {
    pub(super) fn new(quiet: bool, threads: Option<usize>) -> Result<Self> {
        #[expect(clippy::disallowed_methods, reason = "the one variable there is")]
        let simd = std::env::var("DUST3D_SIMD").ok();
        Ok(Self {
            quiet,
            threads,
            level: level_from(simd.as_deref())?,
        })
    }

    /// Bars, lines, or nothing.
    pub(super) fn progress(&self) -> Box<dyn Progress> {
        if self.quiet {
            Box::new(Silent)
        } else {
            Box::new(Stderr::new())
        }
    }

    pub(super) const fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// A remark on stderr.
    pub(super) fn note(&self, text: &str) {
        if !self.quiet {
            eprintln!("{text}");
        }
    }

    /// Runs `work` on as many threads as `--threads`, or else `configured`, says; 0 = all cores.
    pub(super) fn on_threads<T: Send>(
        &self,
        configured: usize,
        work: impl FnOnce() -> Result<T> + Send,
    ) -> Result<T> {
        let threads = self.threads.unwrap_or(configured);
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|cause| {
                Error::new(
                    ErrorKind::Io,
                    format!("cannot start {threads} threads: {cause}"),
                )
            })?
            .install(work)
    }
}

/// The level that `DUST3D_SIMD` forces, or the best one of this CPU.
fn level_from(forced: Option<&str>) -> Result<Level> {
    let Some(name) = forced.filter(|name| !name.is_empty()) else {
        return Ok(Level::detect());
    };
    Level::by_name(name).ok_or_else(|| {
        let known: Vec<&str> = Level::available().map(Level::name).collect();
        Error::usage(format!(
            "DUST3D_SIMD={name} is not possible: this CPU has {}; choose one of them or unset the variable",
            known.join(", ")
        ))
    })
}
