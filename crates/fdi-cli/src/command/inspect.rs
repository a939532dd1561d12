//! `fdi inspect`.

use std::{
    fmt::Write,
    io::{self, Read},
    path::Path,
};

use anyhow::{Context, Result, anyhow, bail};
use fdi_core::{Channel, Current, FileFormat, Recording};
use fdi_report::SettingRow;

use crate::{
    ExitStatus, GlobalArgs, OutputFormat, Streams, answering::STANDARD_INPUT, args::InspectArgs,
    config::every_setting, output::table, reading_options::ReadingOptions, shell::file_word,
};

/// Says what a recording holds.
pub(crate) fn inspect(
    args: &InspectArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    if global.output_format != OutputFormat::Human {
        bail!("`inspect` speaks to people only: `--output-format human`");
    }
    if args.file == Path::new("config") {
        let text = settings(global)?;
        streams.product(global.output.as_deref(), |out| out.write_all(text.as_bytes()))?;
        return Ok(ExitStatus::Done);
    }
    let map = args.map.column_map()?;
    let file = args.file.display().to_string();
    if args.file.as_os_str() == STANDARD_INPUT {
        let mut bytes = Vec::new();
        io::stdin().read_to_end(&mut bytes).context("standard input")?;
        let format = FileFormat::of_bytes(&bytes);
        let recording = Recording::from_bytes(file, format, bytes, &map)?;
        let text = describe(&recording)?;
        streams.product(global.output.as_deref(), |out| out.write_all(text.as_bytes()))?;
        return Ok(ExitStatus::Done);
    }
    let hint = || advice(args).map(|hint| format!("\nhint: {hint}\n")).unwrap_or_default();
    let recording = Recording::read(&args.file, &map).map_err(|error| {
        let told = format!("{file}: {error}\n{}", hint());
        anyhow!("{}", told.trim_end())
    })?;
    let text = describe(&recording)? + &hint();
    streams.product(global.output.as_deref(), |out| out.write_all(text.as_bytes()))?;
    Ok(ExitStatus::Done)
}

fn words(setting: SettingRow) -> Vec<String> {
    vec![setting.name, setting.value, setting.origin]
}

/// Every setting of every command, with what it is and where that is from.
fn settings(global: &GlobalArgs) -> Result<String> {
    let mut text = String::new();
    let rows: Vec<Vec<String>> =
        every_setting(global)?.iter().map(|setting| words(setting.row())).collect();
    table(&mut text, &["setting", "value", "from"].map(str::to_owned), &rows)?;
    Ok(text)
}

/// The command that reads the file as its columns seem to be meant, if any does.
fn advice(args: &InspectArgs) -> Option<String> {
    let options = ReadingOptions::of(&args.file, &args.map)?;
    let file = file_word(&args.file.display().to_string());
    let (condition, words) = (options.condition(), options.words());
    Some(format!("{condition}`fdi inspect {words} {file}`"))
}

fn describe(recording: &Recording) -> Result<String> {
    let mut text = String::new();
    let header =
        ["channel", "unit", "samples", "from s", "to s", "rate Hz", "even", "least", "greatest"];
    let rows: Vec<_> = recording.channels().iter().map(|channel| row(recording, channel)).collect();
    if rows.is_empty() {
        writeln!(text, "no channel but time")?;
    } else {
        table(&mut text, &header.map(str::to_owned), &rows)?;
    }
    if let Some(dialect) = recording.dialect() {
        writeln!(text, "\n{dialect}")?;
    }
    for note in recording.clock_notes() {
        writeln!(text, "\n{note}")?;
    }
    if let Some(phase) = recording.computed_phase() {
        writeln!(text, "\n`{phase}` is not recorded: it is minus the sum of the other phases")?;
    }
    let metadata = recording.metadata.to_toml();
    if !metadata.is_empty() {
        write!(text, "\n{metadata}")?;
    }
    for (index, column) in recording.other_columns().iter().enumerate() {
        let gap = if index == 0 { "\n" } else { "" };
        let (name, cells) = (column.name(), column.samples());
        writeln!(text, "{gap}column `{name}` ({cells} cells) is no channel and is ignored")?;
    }
    for (index, stated) in recording.stated_units().iter().enumerate() {
        let gap = if index == 0 { "\n" } else { "" };
        let by = if stated.is_mapped { " as `--map` says" } else { "" };
        let (column, unit, factor) = (&stated.column, &stated.unit, stated.factor);
        let and_added = match stated.offset {
            0.0 => String::new(),
            offset => format!(", with {offset} added"),
        };
        writeln!(
            text,
            "{gap}column `{column}` is in `{unit}` as the file says and multiplied by {factor}{and_added}{by}"
        )?;
    }
    text.push('\n');
    let current = match recording.require_current() {
        Ok(Current::Phases(_)) => "from the three phases".to_owned(),
        Ok(Current::Quadrature(_)) => "from `q_axis_current_a`".to_owned(),
        Ok(Current::Envelope(_)) => "from the envelope `current_a`".to_owned(),
        Err(error) => error.to_string(),
    };
    writeln!(text, "current: {current}")?;
    Ok(text)
}

fn row(recording: &Recording, channel: &Channel) -> Vec<String> {
    let (times_s, values) = (channel.times_s(), channel.values());
    let (rate, even) = channel.sampling().map_or_else(
        |_| ("-".to_owned(), "-"),
        |sampling| {
            let is_even = sampling.is_uniform() && recording.require_no_gap(channel).is_ok();
            (sampling.rate_hz.to_string(), if is_even { "yes" } else { "no" })
        },
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
