//! The command `fdi`.

use std::{
    io::{IsTerminal, Write},
    process::ExitCode,
};

use fdi_cli::{LoadError, Streams, load, run};

/// A simulation gives its megabytes back and asks for them again thousands of times in an
/// explanation: a seventh of its time with the allocator of the C library.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    keep_decoders_quiet();
    let cli = match load(std::env::args_os()) {
        Ok(cli) => cli,
        Err(LoadError::Usage(error)) => error.exit(),
        Err(LoadError::Settings(error)) => {
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
    let is_terminal = std::io::stderr().is_terminal();
    let outcome = run(&cli, &mut Streams { out: &mut stdout, err: &mut stderr, is_terminal });
    match outcome {
        Ok(status) => status.into(),
        Err(error) => {
            // when even stderr is gone, the exit code is all that can be said
            let _ = writeln!(stderr, "error: {error:#}");
            fdi_cli::ExitStatus::Failed.into()
        }
    }
}

/// A decoder that panics on a damaged file is that file's error and needs no message of its own.
fn keep_decoders_quiet() {
    let told = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if !fdi_core::is_decoding() {
            told(panic);
        }
    }));
}
