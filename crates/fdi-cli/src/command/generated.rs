//! `fdi completions` and `fdi man`: from the tree that parses the command line.

use anyhow::Result;
use clap::CommandFactory;

use crate::{Cli, ExitStatus, GlobalArgs, Streams, args::CompletionsArgs};

/// Writes the completions of a shell.
pub(crate) fn completions(
    args: &CompletionsArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "fdi", &mut text);
    streams.product(global.output.as_deref(), |out| out.write_all(&text))?;
    Ok(ExitStatus::Done)
}

/// Writes the manual page, its sections for all commands one after another.
pub(crate) fn man(global: &GlobalArgs, streams: &mut Streams<'_>) -> Result<ExitStatus> {
    let mut text = Vec::new();
    clap_mangen::Man::new(Cli::command()).render(&mut text)?;
    streams.product(global.output.as_deref(), |out| out.write_all(&text))?;
    Ok(ExitStatus::Done)
}
