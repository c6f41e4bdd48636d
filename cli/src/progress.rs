//! Progress of a run, reported through a trait so that library users choose who listens.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Listens to a run. Every method may be called from any thread.
pub trait Progress: Sync {
    /// A stage of `steps` steps begins; it ends when the next one begins or at [`finish`](Self::finish).
    fn stage(&self, name: &'static str, steps: u64);
    /// `steps` more steps of the current stage are done.
    fn advance(&self, steps: u64);
    /// Something worth a line.
    fn note(&self, text: &str);
    /// The run is over.
    fn finish(&self);
}

/// Hears nothing: for library users and `--quiet`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn stage(&self, _name: &'static str, _steps: u64) {}
    fn advance(&self, _steps: u64) {}
    fn note(&self, _text: &str) {}
    fn finish(&self) {}
}

/// Progress on stderr: a bar per stage on a terminal, otherwise one plain line as each stage ends.
#[derive(Debug)]
pub struct Stderr {
    current: Mutex<Option<Stage>>,
    bars: bool,
}

#[derive(Debug)]
struct Stage {
    name: &'static str,
    start: Instant,
    bar: Option<ProgressBar>,
}

impl Stderr {
    /// Bars if stderr is a terminal, plain lines if not.
    #[must_use]
    pub fn new() -> Self {
        Self {
            current: Mutex::new(None),
            bars: std::io::stderr().is_terminal(),
        }
    }

    /// Ends the stage under way, if any, and puts `next` in its place.
    fn turn(&self, next: Option<Stage>) {
        let Ok(mut current) = self.current.lock() else {
            return;
        };
        if let Some(stage) = std::mem::replace(&mut *current, next) {
            if let Some(bar) = &stage.bar {
                bar.finish_and_clear();
            }
            // A closed stderr is no reason to stop a run.
            let _ = writeln!(
                std::io::stderr(),
                "  {:<40} {:>8.2} s",
                stage.name,
                stage.start.elapsed().as_secs_f64()
            );
        }
    }
}

impl Default for Stderr {
    fn default() -> Self {
        Self::new()
    }
}

impl Progress for Stderr {
    fn stage(&self, name: &'static str, steps: u64) {
        let bar = self.bars.then(|| {
            let bar =
                ProgressBar::with_draw_target(Some(steps.max(1)), ProgressDrawTarget::stderr());
            if let Ok(style) =
                ProgressStyle::with_template("  {msg:<40} {bar:32} {percent:>3}% {elapsed}")
            {
                bar.set_style(style);
            }
            bar.set_message(name);
            bar.enable_steady_tick(Duration::from_millis(200));
            bar
        });
        self.turn(Some(Stage {
            name,
            start: Instant::now(),
            bar,
        }));
    }

    fn advance(&self, steps: u64) {
        if let Ok(current) = self.current.lock()
            && let Some(Stage { bar: Some(bar), .. }) = &*current
        {
            bar.inc(steps);
        }
    }

    fn note(&self, text: &str) {
        if let Ok(current) = self.current.lock() {
            match &*current {
                Some(Stage { bar: Some(bar), .. }) => bar.suspend(|| eprintln!("  {text}")),
                _ => {
                    let _ = writeln!(std::io::stderr(), "  {text}");
                }
            }
        }
    }

    fn finish(&self) {
        self.turn(None);
    }
}

/// Passes everything on to another listener and measures how long each stage takes, for the manifest.
pub struct Stopwatch<'a> {
    inner: &'a dyn Progress,
    stages: Mutex<Times>,
}

/// Stages that are over, and the one under way.
type Times = (Vec<StageTime>, Option<(&'static str, Instant)>);

/// A stage and its wall-clock time.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct StageTime {
    /// The name given to [`Progress::stage`].
    pub name: String,
    /// Wall-clock seconds until the next stage began.
    pub seconds: f64,
}

impl<'a> Stopwatch<'a> {
    /// Listens in front of `inner`.
    #[must_use]
    pub fn new(inner: &'a dyn Progress) -> Self {
        Self {
            inner,
            stages: Mutex::new((Vec::new(), None)),
        }
    }

    /// The stages so far, the one under way with its time until now.
    #[must_use]
    pub fn stages(&self) -> Vec<StageTime> {
        self.stages.lock().map_or_else(
            |_| Vec::new(),
            |guard| {
                let (done, current) = &*guard;
                let mut stages = done.clone();
                stages.extend(current.map(stage_time));
                stages
            },
        )
    }

    fn turn(&self, next: Option<&'static str>) {
        if let Ok(mut guard) = self.stages.lock() {
            let (done, current) = &mut *guard;
            done.extend(current.take().map(stage_time));
            *current = next.map(|name| (name, Instant::now()));
        }
    }
}

fn stage_time((name, start): (&'static str, Instant)) -> StageTime {
    StageTime {
        name: name.to_owned(),
        seconds: start.elapsed().as_secs_f64(),
    }
}

impl Progress for Stopwatch<'_> {
    fn stage(&self, name: &'static str, steps: u64) {
        self.turn(Some(name));
        self.inner.stage(name, steps);
    }
    fn advance(&self, steps: u64) {
        self.inner.advance(steps);
    }
    fn note(&self, text: &str) {
        self.inner.note(text);
    }
    fn finish(&self) {
        self.turn(None);
        self.inner.finish();
    }
}
