//! What follows a batch: the report, the trends beside it, and what to run next.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::CommandFactory;
use fdi_core::{
    Recording, read_model,
    report::{Fleet, RecordDiagnosis},
};

use super::Batch;
use crate::{
    Cli, DiagnoseArgs, GlobalArgs, Streams,
    html_report::{self, DiagnosisReport, put},
    output::{TOOL, Tally},
    stamp,
};

/// Whether the answers have to be kept until the batch has ended.
pub(super) fn wanted(args: &DiagnoseArgs) -> bool {
    args.report.report.is_some() || args.report.figures.is_some()
}

/// Writes the report, and says what to run next.
pub(super) fn batch(
    batch: &Batch<'_>,
    args: &DiagnoseArgs,
    global: &GlobalArgs,
    tally: &Tally,
    records: Option<&[RecordDiagnosis]>,
    streams: &mut Streams<'_>,
) -> Result<()> {
    let next = next_command(&tally.unexplained, args, batch.diagnoser.model_name());
    if let (Some(next), false) = (&next, global.quiet) {
        streams.say(format_args!("\nhint: {next}"));
    }
    let Some(records) = records else { return Ok(()) };
    let older = args.report.report.as_deref().filter(|path| path.exists());
    if let (true, Some(older)) = (tally.is_empty(), older) {
        let name = older.display();
        streams.say(format_args!("`{name}` is left as it was: no recording could be diagnosed"));
        return Ok(());
    }
    let fleet = Fleet::of(records, TOOL, args.fleet.warning_change);
    let made = global.stamp.then(stamp::now);
    html_report::write(&args.report, || {
        let report = DiagnosisReport {
            records,
            failures: &tally.failures,
            fleet: &fleet,
            bundle: batch.diagnoser.bundle_sha256(),
            seed: global.seed,
            stamp: made.as_deref(),
            next,
            settings: global.settings.iter().filter(|one| one.is_set()).cloned().collect(),
            signals: &|record| {
                let recording = Recording::read(Path::new(&record.recording), &batch.map)
                    .with_context(|| record.recording.clone())?;
                batch.diagnoser.signals(&recording)
            },
        };
        report.page()
    })?;
    if let Some(report) = &args.report.report
        && !fleet.actuators.is_empty()
    {
        put(&beside(report, "json"), &(serde_json::to_string_pretty(&fleet)? + "\n"))?;
        put(&beside(report, "csv"), &fleet.to_csv())?;
    }
    Ok(())
}

/// The file of the trends beside a report: `report.html`, `report-fleet.json`.
fn beside(report: &Path, extension: &str) -> PathBuf {
    let stem = report.file_stem().unwrap_or_default().to_string_lossy();
    report.with_file_name(format!("{stem}-fleet.{extension}"))
}

/// Recordings named in a command; a longer one is a script's work.
const NAMED: usize = 12;

/// What to run when the model does not explain recordings.
fn next_command(
    unexplained: &[String],
    args: &DiagnoseArgs,
    model: Option<&str>,
) -> Option<String> {
    // a program without the command must not advise it
    Cli::command().find_subcommand("explain")?;
    explain(unexplained, &args.map.map, model)
}

/// The command that finds what the simulation of these recordings gets wrong.
fn explain(unexplained: &[String], maps: &[String], model: Option<&str>) -> Option<String> {
    if unexplained.is_empty() {
        return None;
    }
    let mut words = vec!["fdi explain".to_owned()];
    // a model that is neither a preset nor a file here is a file that the user knows
    words.extend(model.map(|name| match read_model(name) {
        Ok(_) => format!("--model {}", quoted(name)),
        Err(_) => format!("--model {}", quoted(&format!("{name}.toml"))),
    }));
    words.extend(maps.iter().map(|map| format!("--map {}", quoted(map))));
    words.push("--train".to_owned());
    words.extend(unexplained.iter().take(NAMED).map(|name| quoted(name)));
    let command = words.join(" ");
    let what = match unexplained.len() {
        1 => "1 recording".to_owned(),
        count => format!("{count} recordings"),
    };
    let first =
        if unexplained.len() > NAMED { format!(" (the first {NAMED})") } else { String::new() };
    Some(format!(
        "the model does not explain {what}; to learn what it gets wrong{first}, run `{command}`"
    ))
}

/// A word as a POSIX shell reads it.
fn quoted(word: &str) -> String {
    let plain = |letter: char| letter.is_alphanumeric() || "-_./=:,+@%".contains(letter);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_names_the_recordings() {
        let names = ["a.csv".to_owned(), "my bench/b's.csv".to_owned()];
        let maps = ["current_a=I*0.001".to_owned()];
        assert_eq!(
            explain(&names, &maps, Some("ema-48")).unwrap(),
            "the model does not explain 2 recordings; to learn what it gets wrong, run `fdi \
             explain --model ema-48 --map 'current_a=I*0.001' --train a.csv \
             'my bench/b'\\''s.csv'`"
        );
        let one = explain(&names[..1], &[], Some("ema-270")).unwrap();
        assert!(one.ends_with("1 recording; to learn what it gets wrong, run `fdi explain --model ema-270.toml --train a.csv`"), "{one}");
        assert_eq!(explain(&[], &[], None), None);
    }

    #[test]
    fn long_lists_are_cut_and_it_is_said() {
        let names: Vec<String> = (0..40).map(|i| format!("r{i}.csv")).collect();
        let text = explain(&names, &[], None).unwrap();
        assert!(text.contains("40 recordings; to learn what it gets wrong (the first 12)"));
        assert!(text.ends_with("r11.csv`"), "{text}");
    }

    #[test]
    fn trends_stand_beside_the_report() {
        assert_eq!(beside(Path::new("out/x.html"), "csv"), Path::new("out/x-fleet.csv"));
    }
}
