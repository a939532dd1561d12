//! Recordings with what the signal chain shows set right.

use super::{SignalChannel, SignalFault, view::shifted};
use crate::record::{Record, Recordings};

/// How a recording is set right.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Correction {
    /// A channel that is late, s.
    Earlier(f64),
    /// A channel that is a multiple of what it should be; −1 for a wrong sign.
    Divided(f64),
    /// Inputs behind the controller, in the unit of the drive at each sample: they leave the drive
    /// and push the machine as a load, by torque or force over the drive.
    Inputs { values: Vec<f64>, torque_per_drive: f64 },
}

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
