//! `dust3d completions` and `dust3d man`: what shells and `man` know of the command, made from its arguments.

use super::print;
use crate::error::{Error, Result};
use crate::io::output::write_atomically;
use clap_complete::Shell;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  dust3d completions bash > ~/.local/share/bash-completion/completions/dust3d\n  dust3d completions zsh > ~/.zfunc/_dust3d\n  dust3d completions fish > ~/.config/fish/completions/dust3d.fish"
)]
pub(super) struct Completions {
    /// The shell
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

pub(super) fn completions(args: &Completions, mut command: clap::Command) -> Result<()> {
    let mut bytes = Vec::new();
    clap_complete::generate(args.shell, &mut command, "dust3d", &mut bytes);
    print(&String::from_utf8_lossy(&bytes))
}

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  dust3d man | man -l -\n  dust3d man map plot | man -l -\n  dust3d man --out ~/.local/share/man/man1     every page: dust3d.1, dust3d-run.1, ..."
)]
pub(super) struct Man {
    /// The command whose page is printed [default: dust3d itself]
    #[arg(value_name = "COMMAND", conflicts_with = "out")]
    command: Vec<String>,
    /// Write the pages of all commands to this directory
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace pages that are there
    #[arg(long, requires = "out")]
    force: bool,
}

pub(super) fn man(args: &Man, mut command: clap::Command) -> Result<()> {
    command.build();
    let Some(dir) = &args.out else {
        let mut found = &command;
        for name in &args.command {
            found = found.find_subcommand(name).ok_or_else(|| {
                Error::usage(format!(
                    "there is no command `{}`; `dust3d --help` lists all",
                    args.command.join(" ")
                ))
            })?;
        }
        return print(&String::from_utf8_lossy(&page(found)?.1));
    };
    let mut pages = Vec::new();
    collect(&command, &mut pages)?;
    std::fs::create_dir_all(dir).map_err(|cause| Error::io("make the directory", dir, &cause))?;
    if let Some((name, _)) = pages
        .iter()
        .find(|(name, _)| !args.force && dir.join(name).exists())
    {
        return Err(Error::usage(format!(
            "`{}` exists already; choose another --out, or replace it with --force",
            dir.join(name).display()
        )));
    }
    for (name, bytes) in &pages {
        write_atomically(&dir.join(name), bytes)?;
    }
    Ok(())
}

/// The pages of a command and all below it.
fn collect(command: &clap::Command, pages: &mut Vec<(String, Vec<u8>)>) -> Result<()> {
    pages.push(page(command)?);
    command
        .get_subcommands()
        .filter(|sub| sub.get_name() != "help")
        .try_for_each(|sub| collect(sub, pages))
}

/// The name of the file and the page.
fn page(command: &clap::Command) -> Result<(String, Vec<u8>)> {
    let name = command
        .get_display_name()
        .unwrap_or_else(|| command.get_name())
        .to_owned();
    let mut bytes = Vec::new();
    clap_mangen::Man::new(command.clone())
        .title(name.to_uppercase())
        .source(concat!("dust3d ", env!("CARGO_PKG_VERSION")))
        .manual("dust3d manual")
        .render(&mut bytes)
        .map_err(|cause| Error::usage(format!("no page can be made of {name}: {cause}")))?;
    Ok((format!("{name}.1"), bytes))
}
