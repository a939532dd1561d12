//! From the options and a recording to what a model is compared with.

use std::path::Path;

use anyhow::{Context, Result, bail};
use fdi_core::{
    ComparedSignals, ComparedSignalsError, GivenCommand, RecordError, Recording,
    ema_sim::model_file::MachineModel,
};
use greybox::Record;

use super::{Missing, signals};
use crate::experiment::recording_of;

/// The signals, or what the recording lacks for a conclusion; tells where they are at another rate than
/// the recording.
pub(super) fn compared(
    recording: &Recording,
    model: &MachineModel,
    given: Option<&GivenCommand>,
    told: &mut Vec<String>,
) -> Result<Result<Record, Missing>> {
    let signals = match ComparedSignals::of_recording(recording, model, given) {
        Ok(signals) => signals,
        Err(error @ ComparedSignalsError::NoCommand) => {
            return Ok(Err(Missing::signal(
                recording,
                &format!(
                    "{error}: what the controller was asked for is not known (`--command` names it; \
                 of a servo axis `--inverse-dynamics` does without it)"
                ),
            )));
        }
        Err(error) if error.lacks_a_signal() => {
            return Ok(Err(Missing::signal(recording, &error.to_string())));
        }
        Err(ComparedSignalsError::Record(error @ RecordError::OffGrid { channel, .. })) => {
            let gap = recording.channel(channel).and_then(|of| signals::gap(&recording.name, of));
            return gap.map(|gap| Err(Missing::Samples(Box::new(gap)))).ok_or(error.into());
        }
        Err(error) => return Err(error.into()),
    };
    if signals.rate_hz != signals.recorded_hz {
        told.push(format!(
            "{}: sampled at {} Hz, which the controller's {} Hz is no multiple of: compared at {} Hz",
            recording.name,
            signals.recorded_hz,
            model.kind().controller_hz(),
            signals.rate_hz
        ));
    }
    Ok(Ok(Record {
        name: recording.name.clone(),
        rate_hz: signals.rate_hz,
        command: signals.command,
        kind: signals.kind,
        drive: signals.drive,
        position: signals.position,
        load: signals.load,
        filter_hz: signals.filter_hz,
        start_rad: signals.start_rad,
    }))
}

/// Reads the value of `--command`: a name, or a recording.
pub(super) fn given_command(text: &str, model: &MachineModel) -> Result<GivenCommand> {
    if let Some(named) = GivenCommand::named(text) {
        if !matches!(model, MachineModel::Actuator(_)) {
            bail!("`--command {text}`: a test of actuators; give a recording of the command");
        }
        return Ok(named);
    }
    let (named, recording) = recording_of(Path::new(text))?;
    GivenCommand::of_recording(recording).context(named)
}
