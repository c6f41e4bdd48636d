//! Tools on single maps.

mod convert;
mod degrade;
mod diff;
mod info;
mod plot;
mod statistics;

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
    /// How two maps differ
    Diff(diff::Args),
}

pub(super) fn execute(command: Command, session: &Session) -> Result<()> {
    session.on_threads(0, || match command {
        Command::Info(args) => info::execute(&args),
        Command::Plot(args) => plot::execute(&args),
        Command::Convert(args) => convert::execute(&args, session),
        Command::Degrade(args) => degrade::execute(&args, session.level),
        Command::Diff(args) => diff::execute(&args),
    })
}
