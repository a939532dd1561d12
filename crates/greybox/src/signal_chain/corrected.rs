//! Recordings with finds of their signal chain set right.

use super::{
    correction::Correction,
    find::{SignalChannel, SignalFind},
    shift::shifted,
};
use crate::record::{Record, Recordings};

/// Recordings with all finds set right that can be, each in its recording; those are marked so.
pub(crate) fn corrected(recordings: &Recordings, finds: &mut [SignalFind]) -> Recordings {
    let mut recordings = recordings.clone();
    for find in finds {
        let Some(correction) = &find.correction else { continue };
        let Recordings { train, holdout, repeat } = &mut recordings;
        let all = train.iter_mut().chain(holdout).chain(repeat);
        for record in all.filter(|record| record.name == find.record) {
            set_right(record, find.channel, correction);
        }
        find.corrected = true;
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
    let of_channel = match channel {
        Some(SignalChannel::Command) => Some(&mut record.command),
        Some(SignalChannel::Position) => record.position.as_mut(),
        Some(SignalChannel::Drive) => Some(&mut record.drive),
        None => None,
    };
    let Some(signal) = of_channel else { return };
    match correction {
        Correction::Earlier(late_s) => {
            *signal = shifted(signal, rate_hz, -late_s);
            let lost = libm::ceil(late_s.abs() * rate_hz) as usize;
            cut(record, lost, *late_s > 0.0);
        }
        Correction::Divided(factor) => signal.iter_mut().for_each(|value| *value /= factor),
        Correction::Inputs { .. } => {}
    }
}

/// Takes samples off the end of all channels, or off their beginning.
fn cut(record: &mut Record, samples: usize, at_end: bool) {
    let kept = record.drive.len().saturating_sub(samples);
    let channels = [Some(&mut record.command), Some(&mut record.drive)];
    let more = [record.position.as_mut(), record.load.as_mut()];
    for channel in channels.into_iter().chain(more).flatten() {
        if at_end {
            channel.truncate(kept);
        } else {
            channel.drain(..channel.len() - kept);
        }
    }
}
