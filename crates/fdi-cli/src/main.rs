//! The command `fdi`.

use std::{io::Write, process::ExitCode};

use fdi_cli::{LoadError, Streams, load, run};

fn main() -> ExitCode {
    let cli = match load(std::env::args_os()) {
        Ok(cli) => cli,
        Err(LoadError::Usage(error)) => error.exit(),
        Err(LoadError::File(error)) => {
            let _ = writeln!(std::io::stderr(), "error: {error:#}");
            return fdi_cli::ExitStatus::Failed.into();
        }
    };
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
