//! The command `fdi`.

use std::{
    io::{IsTerminal, Write},
    process::ExitCode,
};

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
    let binary = cli.global.output_format.is_binary();
    // what is no text must pass as it is
    let choice = if binary { anstream::ColorChoice::AlwaysAnsi } else { cli.global.color.choice() };
    let mut stdout = anstream::AutoStream::new(std::io::stdout().lock(), choice);
    let mut stderr = anstream::AutoStream::new(std::io::stderr(), cli.global.color.choice());
    if binary && cli.global.output.is_none() && std::io::stdout().is_terminal() {
        let _ =
            writeln!(stderr, "error: this form is not for a terminal: `--output FILE` or a pipe");
        return fdi_cli::ExitStatus::Failed.into();
    }
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
