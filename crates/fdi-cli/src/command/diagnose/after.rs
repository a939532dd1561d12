//! Steps after a batch: the report, the trends beside it, and the command to run next.

use std::path::Path;

use anyhow::{Context, Result};
use clap::CommandFactory;
use fdi_core::{
    ChannelName, ComparedSignals, Experiment, Recording, read_model,
    report::{Fleet, RecordDiagnosis},
};
use fdi_report::DiagnosisPage;

use super::say_left;
use crate::{
    Cli, DiagnoseArgs, GlobalArgs, ResolvedSetting, Streams,
    answering::Batch,
    output::{TOOL, Tally},
    report_file::{self, put, trends_beside},
    shell::{file_word, quoted},
    stamp,
};

/// Writes the report, and says what to run next.
pub(super) fn batch(
    batch: &Batch<'_>,
    args: &DiagnoseArgs,
    global: &GlobalArgs,
    tally: &Tally,
    records: Option<&[RecordDiagnosis]>,
    streams: &mut Streams<'_>,
) -> Result<()> {
    let next = next_command(batch, &tally.unexplained, &args.map.words());
    if let (Some(next), false) = (&next, global.quiet) {
        streams.say(format_args!("\nhint: {next}"));
    }
    let Some(records) = records else { return Ok(()) };
    let older = args.report.report.as_deref().filter(|path| path.exists());
    if let (true, Some(older)) = (tally.is_empty(), older) {
        say_left(older, global, streams);
        return Ok(());
    }
    let fleet = Fleet::of(records, TOOL, args.fleet.warning_change);
    let made = global.stamp.then(stamp::now);
    let records = &batch.deciding.decided(records.iter().cloned());
    let known = batch.diagnoser.known().into_iter();
    let tests: Vec<_> = known.map(|one| (one.bundle_sha256, one.name)).collect();
    report_file::write(args.report.places(), || {
        let report = DiagnosisPage {
            records,
            tests: &tests,
            failures: &tally.failures,
            fleet: &fleet,
            tool: TOOL,
            bundle: batch.diagnoser.bundle_sha256(),
            seed: global.seed,
            stamp: made.as_deref(),
            next,
            settings: global
                .settings
                .iter()
                .filter(|one| one.is_set() && one.is_of_the_answer())
                .map(ResolvedSetting::row)
                .collect(),
        };
        report.page(|record| {
            if record.together.len() > 1 {
                // there is no one signal to draw
                return Ok(None);
            }
            let recording = Recording::read(Path::new(&record.recording), &batch.map)
                .with_context(|| record.recording.clone())?;
            batch.diagnoser.signals(&recording)
        })
    })?;
    if let Some(report) = &args.report.report
        && !fleet.actuators.is_empty()
    {
        let [json, csv] = trends_beside(report);
        put(&json, &(serde_json::to_string_pretty(&fleet)? + "\n"))?;
        put(&csv, &fleet.to_csv())?;
    }
    Ok(())
}

/// Recordings named in a command; a longer one is a script's work.
const NAMED: usize = 12;

/// Command to run when the model does not explain recordings.
fn next_command(batch: &Batch<'_>, unexplained: &[String], reading: &[String]) -> Option<String> {
    // a program without the command must not advise it
    Cli::command().find_subcommand("explain")?;
    let read = |name: &String| {
        let recording = Recording::read(Path::new(name), &batch.map).ok()?;
        let lacks = ComparedSignals::missing_column(&recording);
        let command = if ComparedSignals::says_its_command(&recording) {
            Asked::Told
        } else {
            let name = batch.diagnoser.command_name(&recording);
            let named = name.filter(|name| Experiment::named(name).is_some());
            named.map_or(Asked::Unknown, |name| Asked::Assumed(name.to_owned()))
        };
        Some(Unexplained { name: name.clone(), lacks, command })
    };
    let first: Vec<_> = unexplained.iter().filter_map(read).take(NAMED).collect();
    advice(&first, unexplained.len(), reading, batch.diagnoser.model_name())
}

/// A recording that the model does not explain.
struct Unexplained {
    name: String,
    /// A column without which there is no conclusion.
    lacks: Option<ChannelName>,
    command: Asked,
}

/// How it is known what a recording was asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Asked {
    Told,
    /// The diagnosis took it for the test of that name.
    Assumed(String),
    Unknown,
}

/// The command that finds what the simulation of these recordings gets wrong, or what they lack for it.
fn advice(
    unexplained: &[Unexplained],
    count: usize,
    reading: &[String],
    model: Option<&str>,
) -> Option<String> {
    let first = unexplained.first()?;
    let what = match count {
        1 => "1 recording".to_owned(),
        count => format!("{count} recordings"),
    };
    let whole: Vec<_> = unexplained.iter().filter(|one| one.lacks.is_none()).collect();
    if let (true, Some(column)) = (whole.is_empty(), first.lacks) {
        return Some(format!(
            "the model does not explain {what}; `fdi explain` could tell what it gets wrong from \
             recordings with the column `{column}` (`--map {column}=COLUMN` names it)"
        ));
    }
    // one command is for all that do not say theirs
    let assumed = whole.iter().find_map(|one| match &one.command {
        Asked::Assumed(name) => Some(name.clone()),
        _ => None,
    });
    let fits = |one: &&&Unexplained| match &one.command {
        Asked::Told => true,
        Asked::Assumed(name) => Some(name) == assumed.as_ref(),
        Asked::Unknown => assumed.is_none(),
    };
    let chosen: Vec<_> = whole.iter().filter(fits).collect();
    let mut words = vec!["fdi explain".to_owned()];
    let mut given = Vec::new();
    // a model that is neither a preset nor a file here is a file that the user knows
    words.extend(model.map(|name| {
        if read_model(name).is_ok() {
            return format!("--model {}", quoted(name));
        }
        let file = format!("{name}.toml");
        if !Path::new(&file).exists() {
            given.push(format!("`{file}` is the model file of this machine"));
        }
        format!("--model {}", file_word(&file))
    }));
    words.extend(reading.iter().cloned());
    if let Some(name) = assumed {
        words.push(format!("--command {name}"));
    } else if chosen.iter().any(|one| one.command == Asked::Unknown) {
        words.push("--command COMMAND.csv".to_owned());
        given.push("`COMMAND.csv` is a recording of the command, with `command_rad`".to_owned());
    }
    words.push("--train".to_owned());
    words.extend(chosen.iter().map(|one| file_word(&one.name)));
    if chosen.len() == 1 {
        words.push("--holdout SECOND.csv".to_owned());
        given.push("`SECOND.csv` is a second recording of the same machine".to_owned());
    }
    let command = words.join(" ");
    let part =
        if count > chosen.len() { format!(" ({} of them)", chosen.len()) } else { String::new() };
    let given =
        if given.is_empty() { String::new() } else { format!(", where {}", given.join(" and ")) };
    Some(format!(
        "the model does not explain {what}; to learn what it gets wrong{part}, run `{command}`{given}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(names: &[&str], command: &Asked) -> Vec<Unexplained> {
        let one = |name: &&str| Unexplained {
            name: (*name).to_owned(),
            lacks: None,
            command: command.clone(),
        };
        names.iter().map(one).collect()
    }

    #[test]
    fn the_command_names_the_recordings() {
        let two = of(&["a.csv", "my bench/b's.csv"], &Asked::Told);
        let reading = ["--map 'current_a=I*0.001'".to_owned()];
        assert_eq!(
            advice(&two, 2, &reading, Some("ema-48")).unwrap(),
            "the model does not explain 2 recordings; to learn what it gets wrong, run `fdi \
             explain --model ema-48 --map 'current_a=I*0.001' --train a.csv \
             'my bench/b'\\''s.csv'`"
        );
        let chirps = of(&["a.csv", "b.csv"], &Asked::Assumed("chirp".to_owned()));
        let text = advice(&chirps, 2, &[], Some("ema-48")).unwrap();
        assert!(text.ends_with("--model ema-48 --command chirp --train a.csv b.csv`"), "{text}");
        assert_eq!(advice(&[], 0, &[], None), None);
        // a name that looks like an option
        let dash = of(&["-a.csv", "--b.csv"], &Asked::Told);
        let text = advice(&dash, 2, &[], None).unwrap();
        assert!(text.ends_with("--train ./-a.csv ./--b.csv`"), "{text}");
    }

    #[test]
    fn what_is_missing_is_named() {
        let one = of(&["a.csv"], &Asked::Unknown);
        assert_eq!(
            advice(&one, 1, &[], Some("ema-270")).unwrap(),
            "the model does not explain 1 recording; to learn what it gets wrong, run `fdi explain \
             --model ema-270.toml --command COMMAND.csv --train a.csv --holdout SECOND.csv`, where \
             `ema-270.toml` is the model file of this machine and `COMMAND.csv` is a recording of \
             the command, with `command_rad` and `SECOND.csv` is a second recording of the same \
             machine"
        );
        let mut some = of(&["a.csv", "b.csv", "c.csv"], &Asked::Told);
        some[1].lacks = Some(ChannelName::MotorAngle);
        let text = advice(&some, 3, &[], None).unwrap();
        assert!(text.ends_with("(2 of them), run `fdi explain --train a.csv c.csv`"), "{text}");
        let text = advice(&some[1..2], 1, &[], None).unwrap();
        assert!(text.contains("recordings with the column `motor_angle_rad`"), "{text}");
    }
}
