//! Signals of a recording as an explanation compares them.

use anyhow::Result;
use ema_sim::model_file::MachineModel;
use fdi_core::{ComparedSignals, Recording};
use greybox::Record;

/// Signals of a recording that are compared, as `fdi explain` takes them.
pub(super) fn compared(recording: &Recording, machine: &MachineModel) -> Result<Record> {
    let signals = ComparedSignals::of_recording(recording, machine, None)?;
    Ok(Record {
        name: recording.name.clone(),
        rate_hz: signals.rate_hz,
        command: signals.command,
        kind: signals.kind,
        drive: signals.drive,
        position: signals.position,
        load: signals.load,
        filter_hz: signals.filter_hz,
        start_rad: signals.start_rad,
    })
}
