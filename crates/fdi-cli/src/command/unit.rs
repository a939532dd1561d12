//! `fdi unit`.

use std::{
    fmt::Write as _,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
use fdi_core::{
    Disagreement, LearntNumber, LearntNumbers, LearntUnit, Recording, UnitState,
    ema_sim::{
        EffectId,
        model_file::{MachineModel, Model},
    },
    report::{LearntFrom, UnitNumber, UnitSummary},
};

use super::explain::rounded;
use crate::{
    ExitStatus, GlobalArgs, OutputFormat, Streams,
    args::{LearnArgs, ResetArgs, ShowUnitArgs, UpdateArgs},
    diagnoser::{ToLearn, diagnoser_of_first, diagnoser_of_unit, learning_options},
    unit_file::{self, HeldUnit},
};

/// Learns a unit and writes its file.
pub(crate) fn learn(
    args: &LearnArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    let Some(path) = global.output.as_deref() else {
        bail!("`--output FILE` says where the unit goes");
    };
    let ToLearn { recordings, diagnoser } = diagnoser_of_first(&args.recordings, &args.reading)?;
    let unit = diagnoser.learn_unit(&recordings, &learning_options(global.root_seed()))?;
    for disagreement in diagnoser.disagreements(&unit)? {
        streams.say(format_args!("warning: {}", warning(&disagreement)));
    }
    if let Some(contradiction) = diagnoser.contradiction(&unit) {
        streams.say(format_args!(
            "warning: {}. `fdi diagnose` does not use such a unit",
            contradiction.in_words()
        ));
    }
    if let Some(warning) = unmodelled(&unit) {
        streams.say(format_args!("warning: {warning}"));
    }
    warn_of_voltages(&unit, &recordings, streams);
    streams.product(Some(path), |out| out.write_all(&unit.to_bytes()))?;
    if !global.quiet {
        streams.say(format_args!("{}", sentence(&unit)));
    }
    Ok(ExitStatus::Done)
}

/// Learns on from later recordings.
pub(crate) fn update(
    args: &UpdateArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    let held = HeldUnit::open(&args.unit)?;
    let ToLearn { recordings, diagnoser } = diagnoser_of_first(&args.recordings, &args.reading)?;
    let options = learning_options(global.root_seed());
    let (unit, left_out) = diagnoser.update_unit(&held.unit, &recordings, &options)?;
    for left in &left_out {
        streams.say(format_args!("left out: {}: {}", left.name, left.reason));
    }
    warn_of_voltages(&unit, &recordings, streams);
    written(held, &unit, global, streams)?;
    Ok(ExitStatus::Done)
}

/// Says of which recordings the motor's voltage is not used.
fn warn_of_voltages(unit: &LearntUnit, recordings: &[Recording], streams: &mut Streams<'_>) {
    for name in unit.without_voltage(recordings) {
        streams.say(format_args!(
            "warning: {name}: the motor's voltage is not used; `fdi diagnose` of the recording says why"
        ));
    }
}

/// Notes that a part was replaced.
pub(crate) fn reset(
    args: &ResetArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    let held = HeldUnit::open(&args.unit)?;
    let unit = held.unit.clone().with_replaced(args.replaced.into());
    written(held, &unit, global, streams)?;
    Ok(ExitStatus::Done)
}

/// Says what a unit was learnt from.
pub(crate) fn show_unit(
    args: &ShowUnitArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    let unit = unit_file::read(&args.unit)?;
    let diagnoser = diagnoser_of_unit(&unit, args.bundle.as_ref())?;
    let numbers = diagnoser.map(|diagnoser| diagnoser.unit_numbers(&unit)).transpose()?;
    let summary = summary(&unit, numbers.as_ref());
    let text = match global.output_format {
        OutputFormat::Human => describe(&summary),
        OutputFormat::Json => serde_json::to_string_pretty(&summary)? + "\n",
        OutputFormat::Jsonl => serde_json::to_string(&summary)? + "\n",
        _ => bail!("a unit has no CSV form or other table: `--output-format human|json|jsonl`"),
    };
    streams.product(global.output.as_deref(), |out| out.write_all(text.as_bytes()))?;
    Ok(ExitStatus::Done)
}

/// Writes the model file of a unit.
pub(crate) fn write_model(
    args: &ShowUnitArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    if global.output_format != OutputFormat::Human {
        bail!("the model file of a unit has no other form: leave `--output-format` out");
    }
    let machine = learnt_machine(&args.unit, args.bundle.as_ref())?;
    let written = MachineModel::Actuator(machine.model).write();
    streams.product(global.output.as_deref(), |out| out.write_all(written.as_bytes()))?;
    Ok(ExitStatus::Done)
}

/// A unit with the diagnosis of the bundle that it was learnt with, and its model.
pub(crate) struct LearntMachine {
    pub(crate) diagnoser: fdi_core::Diagnoser,
    pub(crate) unit: LearntUnit,
    pub(crate) model: Model,
}

/// Reads the unit in a file, learnt with a bundle.
pub(crate) fn learnt_machine(path: &Path, bundle: Option<&PathBuf>) -> Result<LearntMachine> {
    let unit = unit_file::read(path)?;
    let named = || path.display().to_string();
    let diagnoser = diagnoser_of_unit(&unit, bundle).with_context(named)?.with_context(|| {
        let path = named();
        format!(
            "{path}: no bundle at hand is the one that the unit was learnt with: `--bundle FILE` \
             names it"
        )
    })?;
    let model = diagnoser.unit_numbers(&unit).with_context(named)?.model;
    Ok(LearntMachine { diagnoser, unit, model })
}

/// Writes a unit where it was read, or where `--output` says.
fn written(
    held: HeldUnit,
    unit: &LearntUnit,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<()> {
    match global.output.as_deref() {
        Some(path) => streams.product(Some(path), |out| out.write_all(&unit.to_bytes()))?,
        None => held.write(unit)?,
    }
    if !global.quiet {
        streams.say(format_args!("{}", sentence(unit)));
    }
    Ok(())
}

/// Warning of a recording as new that disagrees.
pub(crate) fn warning(disagreement: &Disagreement) -> String {
    let Disagreement { name, findings, against_others } = disagreement;
    let against = if *against_others { "the other recordings" } else { "its type" };
    let what = findings.join(", ");
    format!("{name} disagrees with {against}: {what}. Is it of this unit, and as new?")
}

/// Warning of a unit whose recordings as new have the form of effects that the model file does not have.
fn unmodelled(unit: &LearntUnit) -> Option<String> {
    let recordings = unit.recordings().iter().filter(|one| !one.unmodelled().is_empty());
    let (mut count, mut effects) = (0, Vec::new());
    for recording in recordings {
        count += 1;
        let is_new = |id: &&EffectId| !effects.contains(*id);
        let new: Vec<EffectId> = recording.unmodelled().iter().filter(is_new).copied().collect();
        effects.extend(new);
    }
    let named: Vec<String> = effects.iter().map(|id| id.info().label()).collect();
    let of = unit.recordings().len();
    (count > 0).then(|| {
        format!(
            "{count} of {of} recordings have the form of {}, which the model file does not have; \
             `fdi explain` with them tells what it is",
            named.join(" or ")
        )
    })
}

fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

fn sentence(unit: &LearntUnit) -> String {
    let (references, sessions) = (unit.references(), unit.sessions());
    let later = unit.recordings().len() - references;
    let of = unit.actuator_id().map_or(String::new(), |id| format!(" of `{id}`"));
    let since = if later > 0 { format!(" and {later} later") } else { String::new() };
    format!(
        "learnt{of} from {references} recording{} as new{since}, {sessions} session{}",
        plural(references),
        plural(sessions)
    )
}

fn summary(unit: &LearntUnit, numbers: Option<&LearntNumbers>) -> UnitSummary {
    let number = |one: &LearntNumber| UnitNumber {
        key: one.key.clone(),
        nominal: one.nominal,
        value: one.value,
        std: one.std,
        interval_95: one.interval_95(),
        prior_std: one.prior_std,
        determined: one.is_determined(),
    };
    let all = |of: fn(&LearntNumbers) -> &[LearntNumber]| {
        numbers.map(|numbers| of(numbers).iter().map(number).collect()).unwrap_or_default()
    };
    let recording = |one: &fdi_core::UnitRecording| LearntFrom {
        name: one.name.clone(),
        session: one.session.clone(),
        as_new: one.state == UnitState::AsNew,
    };
    UnitSummary {
        actuator_id: unit.actuator_id().map(str::to_owned),
        model: unit.model_name().to_owned(),
        command: unit.command().to_owned(),
        recordings: unit.recordings().iter().map(recording).collect(),
        numbers: all(|numbers| &numbers.numbers),
        ratios: all(|numbers| &numbers.ratios),
    }
}

/// The summary in words.
fn describe(summary: &UnitSummary) -> String {
    let mut text = String::new();
    let mut line = |label: &str, content: &str| {
        let _ = writeln!(text, "{label:<10} {content}");
    };
    line("actuator", summary.actuator_id.as_deref().unwrap_or("not stated"));
    line("model", &summary.model);
    line("command", &summary.command);
    for recording in &summary.recordings {
        let label = if recording.as_new { "as new" } else { "since" };
        let session = recording.session.as_deref().unwrap_or("no session stated");
        line(label, &format!("{} ({session})", recording.name));
    }
    if summary.numbers.is_empty() {
        line("numbers", "not shown: no bundle at hand is the one that the unit was learnt with");
        return text;
    }
    let width = summary.numbers.iter().chain(&summary.ratios).map(|one| one.key.len());
    let width = width.max().unwrap_or(0);
    let _ = writeln!(text, "\n{:<width$} {:>11} {:>11}   95 %", "number", "data sheet", "unit");
    for number in summary.numbers.iter().chain(&summary.ratios) {
        let UnitNumber { key, nominal, value, .. } = number;
        let [from, to] = number.interval_95.map(rounded);
        let left = if number.determined { "" } else { "   not determined" };
        let (nominal, value) = (rounded(*nominal), rounded(*value));
        let _ = writeln!(text, "{key:<width$} {nominal:>11} {value:>11}   {from} to {to}{left}");
    }
    text
}
