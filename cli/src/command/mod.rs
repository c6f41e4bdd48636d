//! The `dust3d` command: arguments, and one module per subcommand. All work is done by the rest of the library.

mod emit;
mod export;
mod fit;
mod layers;
mod manual;
mod map;
mod report;
mod run;
mod session;
mod summary;

use crate::config::{DEFAULT_TOML, Preset};
use crate::error::{Error, Result};
use clap::{CommandFactory, Parser, Subcommand};
use session::Session;
use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

/// Realisations of polarised Galactic dust in 3-D.
#[derive(Debug, Parser)]
#[command(
    name = "dust3d",
    version,
    about = "Realisations of polarised Galactic dust in 3-D (Martínez-Solaeche, Karakci & Delabrouille 2018)",
    after_help = "Examples:\n  dust3d run --out demo                 the whole pipeline on the built-in sky\n  dust3d config > my.toml               the default configuration, to be edited\n  dust3d map plot demo/templates/I_1.f64 --out I_1.png\n\nExit status: 0 success, 2 wrong usage or configuration, 3 a failed `report --check`, 1 any other failure."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// No progress and no remarks on stderr
    #[arg(long, short, global = true)]
    quiet: bool,
    /// Threads; 0 = all cores (no result depends on it)
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=4096))]
    threads: Option<u16>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the whole pipeline, from observations to frequency maps
    Run(run::Args),
    /// Print the complete default configuration, with a comment on every key
    #[command(
        after_help = "Examples:\n  dust3d config > my.toml && dust3d run my.toml --out demo\n  dust3d config --preset planck-gnilc > planck.toml"
    )]
    Config {
        /// Print the values of a preset in place of the defaults
        #[arg(long, value_name = "NAME", value_parser = run::preset())]
        preset: Option<Preset>,
    },
    /// Frequency maps from a finished run
    Emit(emit::Args),
    /// A run for other programs: templates and configuration for PySM
    Export(export::Args),
    /// Fit a modified blackbody (τ, T, β) in every pixel of intensity maps
    Fit(fit::Args),
    /// Every figure and table of the paper for a finished run, and a verdict
    Report(report::Args),
    /// Tools on single maps
    #[command(subcommand)]
    Map(map::Command),
    /// Completions of a shell, to be loaded by it
    Completions(manual::Completions),
    /// Manual pages, in roff
    Man(manual::Man),
}

/// Runs the command line `args` (the program's name first), and says on stderr what went wrong.
pub fn main(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let cli = match Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(error) => return usage(&error),
    };
    let outcome = crate::io::partial::on_interrupt().and_then(|()| execute(cli));
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // A closed stderr leaves only the exit status to tell.
            let _ = writeln!(std::io::stderr(), "dust3d: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

fn execute(cli: Cli) -> Result<()> {
    let session = Session::new(cli.quiet, cli.threads.map(usize::from))?;
    match cli.command {
        Command::Config { preset } => print(preset.map_or(DEFAULT_TOML, Preset::toml)),
        Command::Run(args) => run::execute(&args, &session),
        Command::Emit(args) => emit::execute(&args, &session),
        Command::Export(args) => export::execute(&args, &session),
        Command::Fit(args) => fit::execute(&args, &session),
        Command::Report(args) => report::execute(&args, &session),
        Command::Map(command) => map::execute(command, &session),
        Command::Completions(args) => manual::completions(&args, Cli::command()),
        Command::Man(args) => manual::man(&args, Cli::command()),
    }
}

/// Help and version as they are; a usage error as one sentence.
fn usage(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() {
        return match print(&error.render().to_string()) {
            Ok(()) => ExitCode::SUCCESS,
            Err(_) => ExitCode::FAILURE,
        };
    }
    let text = error.render().to_string();
    let sentence: Vec<&str> = text
        .lines()
        .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more information"))
        .map(str::trim)
        .filter(|line| !line.is_empty())
        .collect();
    let sentence = sentence.join(" ");
    let sentence = sentence.strip_prefix("error: ").unwrap_or(&sentence);
    let name = Cli::command().get_name().to_owned();
    let _ = writeln!(
        std::io::stderr(),
        "{name}: {sentence}; `{name} help` and `--help` after any command show what is possible"
    );
    ExitCode::from(2)
}

/// Prints to stdout. A reader who has seen enough (`| head`) is no failure.
fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(cause) if cause.kind() != std::io::ErrorKind::BrokenPipe => Err(Error::io(
            "write to",
            std::path::Path::new("standard output"),
            &cause,
        )),
        _ => Ok(()),
    }
}
