//! `fdi inspect`.

use std::fmt::Write;

use anyhow::{Context, Result, bail};
use fdi_core::{Channel, ColumnMap, Current, Recording};

use crate::{ExitStatus, GlobalArgs, OutputFormat, Streams, args::InspectArgs, output::table};

/// Says what a recording holds.
pub(crate) fn inspect(
    args: &InspectArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    if global.output_format != OutputFormat::Human {
        bail!("`inspect` speaks to people only: `--output-format human`");
    }
    let map = ColumnMap::new(&args.map.map)?;
    let file = args.file.display().to_string();
    let recording = Recording::read(&args.file, &map).with_context(|| file)?;
    let text = describe(&recording)?;
    streams.product(global.output.as_deref(), |out| out.write_all(text.as_bytes()))?;
    Ok(ExitStatus::Done)
}

fn describe(recording: &Recording) -> Result<String> {
    let mut text = String::new();
    let header =
        ["channel", "unit", "samples", "from s", "to s", "rate Hz", "even", "least", "greatest"];
    let rows: Vec<_> = recording.channels().iter().map(row).collect();
    table(&mut text, &header.map(str::to_owned), &rows)?;
    let metadata = recording.metadata.to_toml();
    if !metadata.is_empty() {
        write!(text, "\n{metadata}")?;
    }
    for column in recording.other_columns() {
        let (name, cells) = (column.name(), column.times_s().len());
        writeln!(text, "\ncolumn `{name}` ({cells} cells) is no channel and is ignored")?;
    }
    text.push('\n');
    let current = match recording.require_current() {
        Ok(Current::Phases(_)) => "from the three phases".to_owned(),
        Ok(Current::Envelope(_)) => "from the envelope `current_a`".to_owned(),
        Err(error) => error.to_string(),
    };
    writeln!(text, "current: {current}")?;
    Ok(text)
}

fn row(channel: &Channel) -> Vec<String> {
    let (times_s, values) = (channel.times_s(), channel.values());
    let (rate, even) = channel.sampling().map_or_else(
        |_| ("-".to_owned(), "-"),
        |sampling| (sampling.rate_hz.to_string(), if sampling.is_uniform() { "yes" } else { "no" }),
    );
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    vec![
        channel.name().to_string(),
        channel.name().unit().to_owned(),
        values.len().to_string(),
        times_s[0].to_string(),
        times_s[times_s.len() - 1].to_string(),
        rate,
        even.to_owned(),
        least.to_string(),
        greatest.to_string(),
    ]
}
