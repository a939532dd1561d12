//! `fdi simulate`.

use anyhow::Result;

use crate::{
    ExitStatus, GlobalArgs, Streams,
    args::SimulateArgs,
    simulator::{self, Simulated},
};

/// Simulates a recording and writes it; compressed if the file ends in `.csv.gz`.
pub(crate) fn simulate(
    args: &SimulateArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    let Simulated { recording, format, notices } = simulator::simulate(args, global.root_seed())?;
    if !global.quiet {
        for notice in notices {
            streams.say(format_args!("notice: {notice}"));
        }
    }
    if let Some(path) = &global.output {
        recording.write(path, format)?;
        return Ok(ExitStatus::Done);
    }
    let text = recording.to_csv(format)?;
    streams.product(None, |out| out.write_all(text.as_bytes()))?;
    Ok(ExitStatus::Done)
}
