//! `fdi simulate`.

use anyhow::{Result, bail};
use fdi_core::{
    FileFormat,
    ema_sim::{Converter, PhaseSensors},
};

use crate::{
    ExitStatus, GlobalArgs, Streams,
    args::SimulateArgs,
    simulator::{self, Simulated},
};

/// Refuses sensors that nobody has.
fn check_sensors(args: &SimulateArgs) -> Result<()> {
    // without a range of its own the converter has the model's, which is checked with the model
    let range_a = args.adc_range_a.unwrap_or(Converter::DEFAULT.range_a);
    let converter = args.adc_bits.map(|bits| Converter { bits: u32::from(bits), range_a });
    let sensors = PhaseSensors { noise_a: args.noise_a, converter };
    Ok(sensors.check()?)
}

/// Simulates a recording and writes it; compressed if the file ends in `.csv.gz`.
pub(crate) fn simulate(
    args: &SimulateArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    check_sensors(args)?;
    let Simulated { recording, format, notices } = simulator::simulate(args, global.root_seed())?;
    if !global.quiet {
        for notice in notices {
            streams.say(format_args!("notice: {notice}"));
        }
    }
    if let Some(path) = &global.output {
        let bytes = match FileFormat::of(path) {
            Some(FileFormat::Csv) => recording.to_csv(format)?.into_bytes(),
            Some(FileFormat::CsvGz) => recording.to_csv_gz(format)?,
            _ => bail!("`{}` does not end in `.csv` or `.csv.gz`", path.display()),
        };
        streams.product(Some(path), |out| out.write_all(&bytes))?;
        return Ok(ExitStatus::Done);
    }
    let text = recording.to_csv(format)?;
    streams.product(None, |out| out.write_all(text.as_bytes()))?;
    Ok(ExitStatus::Done)
}
