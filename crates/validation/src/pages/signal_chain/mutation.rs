//! Ways to change sets of recordings: those that leave the answer as it is, and those that spoil it.

use anyhow::{Context, Result};
use ema_sim::model_file::{MachineModel, parse_machine};
use greybox::{Record, Recordings, SignalCode};

use crate::pages::chance::Chance;

/// A model file with recordings.
#[derive(Clone, Debug)]
pub(crate) struct Set {
    pub(crate) model: MachineModel,
    pub(crate) recordings: Recordings,
}

/// Answer that a mutation asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Asked {
    /// The cause of the unmutated set.
    Same,
    /// This code, and no effect.
    Code(SignalCode),
}

/// A mutated set.
pub(super) struct Case {
    pub(super) name: String,
    pub(super) asked: Asked,
    /// True where it was run while the program was written.
    pub(super) is_development: bool,
    pub(super) set: Set,
}

/// Channel that is mutated.
#[derive(Clone, Copy, Debug)]
pub(super) enum Channel {
    Command,
    Position,
    Drive,
}

impl Channel {
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Command => "command",
            Self::Position => "position",
            Self::Drive => "drive",
        }
    }

    fn of(self, record: &mut Record) -> Option<&mut Vec<f64>> {
        match self {
            Self::Command => Some(&mut record.command),
            Self::Position => record.position.as_mut(),
            Self::Drive => Some(&mut record.drive),
        }
    }
}

impl Set {
    /// All recordings changed.
    pub(super) fn each(&self, change: impl Fn(&mut Record)) -> Self {
        let mut set = self.clone();
        let Recordings { train, holdout, repeat } = &mut set.recordings;
        train.iter_mut().chain(holdout).chain(repeat).for_each(change);
        set
    }

    /// A channel of all recordings changed.
    fn channel(&self, channel: Channel, change: impl Fn(&mut Vec<f64>)) -> Self {
        self.each(|record| {
            if let Some(signal) = channel.of(record) {
                change(signal);
            }
        })
    }

    /// A channel that comes later by a time, the rate being 1 kHz.
    pub(super) fn late(&self, channel: Channel, ms: usize) -> Self {
        self.channel(channel, |signal| {
            let before = signal.clone();
            for (n, value) in signal.iter_mut().enumerate() {
                *value = before[n.saturating_sub(ms)];
            }
        })
    }

    pub(super) fn times(&self, channel: Channel, factor: f64) -> Self {
        self.channel(channel, |signal| signal.iter_mut().for_each(|value| *value *= factor))
    }

    /// Drive signals cut at a share of the largest value of each.
    pub(super) fn cut(&self, share: f64) -> Self {
        self.channel(Channel::Drive, |signal| {
            let most = share * signal.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            for value in signal {
                *value = value.clamp(-most, most);
            }
        })
    }

    /// Drive signals through a converter of so many bits from minus to plus a range.
    pub(super) fn bits(&self, bits: i32, range: f64) -> Self {
        let step = 2.0 * range / 2.0_f64.powi(bits);
        self.channel(Channel::Drive, |signal| {
            for value in signal {
                *value = step * (*value / step).round();
            }
        })
    }

    /// Recordings whose samples of these places are missing, unseen in their times.
    pub(super) fn without(&self, samples: core::ops::Range<usize>) -> Self {
        self.each(|record| {
            for channel in channels(record) {
                channel.drain(samples.clone());
            }
        })
    }

    /// Recordings of these samples alone.
    pub(crate) fn part(&self, samples: core::ops::Range<usize>) -> Self {
        self.each(|record| {
            for channel in channels(record) {
                channel.truncate(samples.end);
                channel.drain(..samples.start.min(channel.len()));
            }
        })
    }

    /// Every so many samples alone.
    pub(super) fn every(&self, step: usize) -> Self {
        self.each(|record| {
            for channel in channels(record) {
                *channel = channel.iter().step_by(step).copied().collect();
            }
            record.rate_hz /= step as f64;
        })
    }

    /// Recordings logged at a rate of the logger's own: each sample the last of the recording before
    /// it, or on the straight line between its neighbours.
    pub(super) fn logged_at(&self, rate_hz: f64, is_held: bool) -> Self {
        self.each(|record| {
            let step = record.rate_hz / rate_hz;
            for channel in channels(record) {
                let last = channel.len() - 1;
                let at = |n: usize| {
                    let place = n as f64 * step;
                    let before = place as usize;
                    let share = if is_held { 0.0 } else { place.fract() };
                    let after = channel[(before + 1).min(last)];
                    (1.0 - share) * channel[before] + share * after
                };
                *channel = (0..=(last as f64 / step) as usize).map(at).collect();
            }
            record.rate_hz = rate_hz;
        })
    }

    /// Recordings turned round: what was positive is negative.
    pub(super) fn mirrored(&self) -> Self {
        self.each(|record| {
            for channel in channels(record) {
                for value in channel {
                    *value = -*value;
                }
            }
        })
    }

    /// Noise added to the drive signals.
    pub(super) fn noisy(&self, std: f64, seed: u64) -> Self {
        let mut set = self.clone();
        let mut chance = Chance::new(seed);
        let Recordings { train, holdout, .. } = &mut set.recordings;
        for record in train.iter_mut().chain(holdout) {
            record.drive.iter_mut().for_each(|value| *value += std * chance.normal());
        }
        set
    }

    /// The model file with numbers of its text replaced.
    pub(super) fn with(&self, changes: &[(&str, f64)]) -> Result<Self> {
        let mut text = self.model.kind().write();
        for (key, factor) in changes {
            text = scaled(&text, key, *factor)?;
        }
        Ok(Self { model: parse_machine(&text)?, recordings: self.recordings.clone() })
    }
}

/// A model file with the number of a key multiplied.
fn scaled(text: &str, key: &str, factor: f64) -> Result<String> {
    let is_of = |line: &&str| line.split('=').next().is_some_and(|name| name.trim() == key);
    let line = text.lines().find(is_of).with_context(|| format!("`{key}` of the model file"))?;
    let value: f64 = line.split('=').nth(1).context("a value")?.trim().parse()?;
    Ok(text.replacen(line, &format!("{key} = {:?}", factor * value), 1))
}

fn channels(record: &mut Record) -> impl Iterator<Item = &mut Vec<f64>> {
    let always = [&mut record.command, &mut record.drive];
    always.into_iter().chain(record.position.as_mut()).chain(record.load.as_mut())
}
