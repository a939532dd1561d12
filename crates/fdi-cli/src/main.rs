//! The command `fdi`.

use std::{io::Write, process::ExitCode};

use clap::Parser;
use fdi_cli::{Cli, Streams, run};

fn main() -> ExitCode {
    let cli = Cli::parse();
    let choice = cli.global.color.choice();
    let mut stdout = anstream::AutoStream::new(std::io::stdout().lock(), choice);
    let mut stderr = anstream::AutoStream::new(std::io::stderr(), choice);
    let outcome = run(&cli, &mut Streams { out: &mut stdout, err: &mut stderr });
    match outcome {
        Ok(status) => status.into(),
        Err(error) => {
            // when even stderr is gone, the exit code is all that can be said
            let _ = writeln!(stderr, "error: {error:#}");
            fdi_cli::ExitStatus::Failed.into()
        }
    }
}
