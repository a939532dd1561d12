//! `fdi calibrate`.

use std::{collections::BTreeMap, fmt::Write, path::PathBuf, time::Instant};

use anyhow::{Context, Result, bail};
use fdi_core::{
    DiagnoseError, LearntNumber, LearntNumbers, Recording, UnitLearningError,
    ema_sim::model_file::{MachineModel, Model},
    read_machine,
    report::{CalibratedParameter, Calibration, SCHEMA_VERSION},
};
use greybox::{Calibrated, CalibratedNumber};

use super::{
    explain::{holdout, in_form, rounded, sound, stage, whole_recordings},
    unit::warning,
};
use crate::{
    ExitStatus, GlobalArgs, Streams,
    args::CalibrateArgs,
    diagnoser::{diagnoser_of_model, learning_options},
    progress::watched,
    stamp,
};

/// Finds the numbers of a machine from healthy recordings, and writes the model with them.
#[expect(clippy::disallowed_methods, reason = "the time taken is part of the answer")]
pub(crate) fn calibrate(
    args: &CalibrateArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    let start = Instant::now();
    let model = read_machine(&args.model)?;
    match &model {
        MachineModel::Actuator(actuator) => {
            if let Some(learnt) = of_actuator(args, actuator, global, streams)? {
                let elapsed_s = (!global.stable).then(|| start.elapsed().as_secs_f64());
                let answer = document_of_actuator(&learnt, &model, global, elapsed_s);
                let calibrated = MachineModel::Actuator(learnt.model);
                return written(&answer, &calibrated, Kept::MostProbable, global, streams);
            }
        }
        MachineModel::ServoAxis(_) if args.bundle.is_some() => {
            bail!("`--bundle`: {} is a servo axis, bundles are of actuators", args.model);
        }
        MachineModel::ServoAxis(_) => {}
    }
    let recordings = whole_recordings(&args.records, &model, global, streams)?;
    let recordings = sound(recordings, &args.records, &model, global, streams)?;
    let what = stage("fitting", &recordings);
    let calibrated = watched(streams, global.quiet, &what, || {
        greybox::calibrate(&model, &recordings, global.threads())
    })?;
    let elapsed_s = (!global.stable).then(|| start.elapsed().as_secs_f64());
    let answer = document(&calibrated, &model, global, elapsed_s);
    written(&answer, &calibrated.model, Kept::Nominal, global, streams)
}

/// Value of a number that is not determined, in the model that is written.
#[derive(Clone, Copy, Debug)]
enum Kept {
    /// Value of the data sheet.
    Nominal,
    /// Most probable value beside the other numbers.
    MostProbable,
}

/// Prints the answer, and writes the model where one is asked for.
fn written(
    answer: &Calibration,
    model: &MachineModel,
    kept: Kept,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    let text = in_form(global.output_format, answer, |answer| human(answer, kept))?;
    streams.product(None, |out| out.write_all(text.as_bytes()))?;
    if let Some(path) = &global.output {
        streams.product(Some(path), |out| out.write_all(model.write().as_bytes()))?;
    }
    Ok(ExitStatus::Done)
}

/// Numbers of the unit that recordings of an actuator are of; `None`, and told, where no bundle at
/// hand has learnt machines of this model within its tolerances in this test.
fn of_actuator(
    args: &CalibrateArgs,
    model: &Model,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<Option<LearntNumbers>> {
    let records = &args.records;
    let map = records.map.column_map()?;
    let read =
        |path: &PathBuf| Recording::read(path, &map).with_context(|| path.display().to_string());
    let recordings = records.train.iter().map(read).collect::<Result<Vec<_>>>()?;
    let Some(first) = recordings.first() else { return Ok(None) };
    let command = records.command.as_deref();
    let mut unknown = |why: &str| {
        streams.say(format_args!(
            "{why}: the low-fidelity model's own error is not known, and intervals may be too narrow"
        ));
    };
    let Some(diagnoser) = diagnoser_of_model(model, command, first, args.bundle.as_ref())? else {
        unknown("no bundle of this model and test has learnt machines within tolerances");
        return Ok(None);
    };
    let unit = match diagnoser.learn_unit(&recordings, &learning_options(global.root_seed())) {
        Ok(unit) => unit,
        // of another test than that of the embedded bundle
        Err(UnitLearningError::Recording { name, reason })
            if args.bundle.is_none() && matches!(*reason, DiagnoseError::Observation(_)) =>
        {
            unknown(&format!("{name} is not of the embedded bundle's test ({reason})"));
            return Ok(None);
        }
        Err(error) => return Err(error.into()),
    };
    for disagreement in diagnoser.disagreements(&unit)? {
        streams.say(format_args!("warning: {}", warning(&disagreement)));
    }
    if records.holdout.len() + records.repeat.len() > 0 {
        streams.say(format_args!(
            "`--holdout` and `--repeat` are not used with a bundle: `fdi diagnose --unit` tells \
             whether another recording agrees"
        ));
    }
    let mut learnt = diagnoser.unit_numbers(&unit)?;
    learnt.model.name.clone_from(&model.name);
    learnt.model.faults.clone_from(&model.faults);
    Ok(Some(learnt))
}

fn document_of_actuator(
    learnt: &LearntNumbers,
    model: &MachineModel,
    global: &GlobalArgs,
    elapsed_s: Option<f64>,
) -> Calibration {
    let parameter = |number: &LearntNumber| {
        let parameter = CalibratedParameter {
            nominal: number.nominal,
            value: number.value,
            std: number.std,
            interval_95: number.interval_95(),
            determined: number.is_determined(),
            tied_to: None,
        };
        (number.key.clone(), parameter)
    };
    Calibration {
        parameters: learnt.numbers.iter().map(parameter).collect(),
        ratios: learnt.ratios.iter().map(parameter).collect(),
        ..nothing_found(model, global, elapsed_s)
    }
}

fn document(
    calibrated: &Calibrated,
    model: &MachineModel,
    global: &GlobalArgs,
    elapsed_s: Option<f64>,
) -> Calibration {
    let parameter = |number: &CalibratedNumber| {
        let parameter = CalibratedParameter {
            nominal: number.nominal,
            value: number.value,
            std: number.std,
            interval_95: number.interval_95(),
            determined: number.determined,
            tied_to: number.tied_to.as_ref().map(|tie| tie.key.clone()),
        };
        (number.key.clone(), parameter)
    };
    let judged = |rms| holdout(rms, &calibrated.noise_floor, calibrated.drive_unit);
    Calibration {
        parameters: calibrated.numbers.iter().map(parameter).collect(),
        holdout: calibrated.holdout_rms.map(judged),
        ..nothing_found(model, global, elapsed_s)
    }
}

/// A calibration of a model without any number.
fn nothing_found(model: &MachineModel, global: &GlobalArgs, elapsed_s: Option<f64>) -> Calibration {
    Calibration {
        schema_version: SCHEMA_VERSION,
        tool: format!("fdi {}", env!("CARGO_PKG_VERSION")),
        stamp: global.stamp.then(stamp::now),
        model: model.name().unwrap_or("unnamed").to_owned(),
        parameters: BTreeMap::new(),
        ratios: BTreeMap::new(),
        holdout: None,
        elapsed_s,
    }
}

fn human(answer: &Calibration, kept: Kept) -> String {
    let all = answer.parameters.iter().chain(&answer.ratios);
    let width = all.clone().map(|(key, _)| key.len()).fold(44, usize::max);
    let mut text =
        format!("{:<width$} {:>12} {:>12}   95 %\n", "number", "data sheet", "recordings");
    for (key, p) in all {
        let [from, to] = p.interval_95.map(rounded);
        let _ = write!(
            text,
            "{key:<width$} {:>12} {:>12}   {from} to {to}",
            rounded(p.nominal),
            rounded(p.value)
        );
        if !p.determined {
            let tied = p.tied_to.as_ref().map_or_else(String::new, |key| format!(" from {key}"));
            let kept = match kept {
                Kept::Nominal => ": the data sheet's is kept",
                Kept::MostProbable => "",
            };
            let _ = write!(text, "   not determined{tied}{kept}");
        }
        text.push('\n');
    }
    if let Some(holdout) = &answer.holdout {
        let unit = holdout.unit.to_uppercase();
        let _ = writeln!(
            text,
            "on recordings not fitted the residual goes from {} to {} {unit} (noise {} {unit})",
            rounded(holdout.rms_before),
            rounded(holdout.rms_after),
            rounded(holdout.noise_floor)
        );
    }
    text
}
