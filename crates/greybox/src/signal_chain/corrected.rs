//! Recordings with the lacks of their signal chain set right.

use super::{
    correction::Correction,
    fault::{SignalChannel, SignalFault},
    view::shifted,
};
use crate::record::{Record, Recordings};

/// Recordings with faults set right, each in its recording, and the faults marked so; what cannot be
/// set right stays as it is.
pub(crate) fn corrected(recordings: &Recordings, faults: &mut [SignalFault]) -> Recordings {
    let mut recordings = recordings.clone();
    for fault in faults {
        let Some(correction) = &fault.correction else { continue };
        let Recordings { train, holdout, repeat } = &mut recordings;
        let all = train.iter_mut().chain(holdout).chain(repeat);
        for record in all.filter(|record| record.name == fault.record) {
            set_right(record, fault.channel, correction);
        }
        fault.corrected = true;
    }
    recordings
}

fn set_right(record: &mut Record, channel: Option<SignalChannel>, correction: &Correction) {
    let rate_hz = record.rate_hz;
    if let Correction::Inputs { values, torque_per_drive } = correction {
        let before = record.load.take().unwrap_or_else(|| vec![0.0; values.len()]);
        let load = before.iter().zip(values).map(|(load, input)| load - torque_per_drive * input);
        record.load = Some(load.collect());
        record.drive.iter_mut().zip(values).for_each(|(drive, input)| *drive -= input);
        return;
    }
    let signal = match channel {
        Some(SignalChannel::Drive) => Some(&mut record.drive),
        Some(SignalChannel::Command) => Some(&mut record.command),
        Some(SignalChannel::Position) => record.position.as_mut(),
        None => None,
    };
    let Some(signal) = signal else { return };
    match correction {
        Correction::Earlier(late_s) => *signal = shifted(signal, rate_hz, -late_s),
        Correction::Divided(by) => signal.iter_mut().for_each(|x| *x /= by),
        Correction::Inputs { .. } => {}
    }
}
