//! Tools on single maps.

mod analyse;
mod convert;
mod degrade;
mod diff;
mod harmonics;
mod info;
pub(super) mod mask;
mod plot;
mod spectrum;
mod statistics;
mod synthesise;

use super::session::Session;
use crate::error::Result;
use clap::Subcommand;

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Resolution, range, mean and missing pixels of maps
    Info(info::Args),
    /// A picture: the whole sky, or a detail with --gnomonic
    Plot(plot::Args),
    /// Another element type, order or unit
    Convert(convert::Args),
    /// A coarser map, by area average
    Degrade(degrade::Args),
    /// Weights of the faintest part of the sky, with soft edges
    Mask(mask::Args),
    /// Angular power spectra of I, or of I, Q, U
    Spectrum(spectrum::Args),
    /// How two maps differ
    Diff(diff::Args),
    /// Spherical harmonic coefficients of I, or of I, Q, U
    Analyse(analyse::Args),
    /// Maps of spherical harmonic coefficients
    Synthesise(synthesise::Args),
}

pub(super) fn execute(command: Command, session: &Session) -> Result<()> {
    session.on_threads(0, || match command {
        Command::Info(args) => info::execute(&args),
        Command::Plot(args) => plot::execute(&args),
        Command::Convert(args) => convert::execute(&args, session),
        Command::Degrade(args) => degrade::execute(&args, session.level),
        Command::Mask(args) => mask::execute(&args, session.level),
        Command::Spectrum(args) => spectrum::execute(&args, session),
        Command::Diff(args) => diff::execute(&args),
        Command::Analyse(args) => analyse::execute(&args, session),
        Command::Synthesise(args) => synthesise::execute(&args, session),
    })
}
