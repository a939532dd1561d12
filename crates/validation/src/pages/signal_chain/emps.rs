//! Mutations of the EMPS recordings.

use anyhow::{Context, Result, bail};
use ema_sim::{
    AxisInput, AxisScenario, AxisStart, Command, HealthState, Load, ServoAxisSimulation,
    model_file::MachineModel,
};
use fdi_core::{Channel as RecordedChannel, ChannelName, Metadata, Recording};
use greybox::{CommandKind, Record, Recordings, SignalCode, correct_signals};

use super::{
    JOBS,
    mutation::{Asked, Case, Channel, Set},
};
use crate::pages::{
    compared::compared,
    measured::{emps_model, emps_published, recording::columns},
};

const RATE_HZ: f64 = 1000.0;
/// Samples of the first two of four times there and back.
const HALF: usize = 12_464;
/// Noise of the voltage: what the controller's equation leaves, V (`docs/models/servo-axis.md`).
const NOISE_V: f64 = 3.7e-3;
/// Range of the drive's voltage, V.
const RANGE_V: f64 = 10.0;

/// The recordings as they are, and sound ones: the pulses of the test taken for a load.
pub(super) struct Emps {
    raw: Set,
    train: Vec<Vec<f64>>,
    pub(super) sound: Set,
}

fn record(name: &str, columns: &[Vec<f64>], samples: core::ops::Range<usize>) -> Record {
    let of = |place: usize| columns[place][samples.clone()].to_vec();
    Record {
        name: name.to_owned(),
        rate_hz: RATE_HZ,
        command: of(1),
        kind: CommandKind::Position,
        drive: of(3),
        position: Some(of(2)),
        load: None,
        filter_hz: None,
        start_rad: None,
    }
}

/// A recording as a file of it is read.
fn logged(record: &Record) -> Result<Recording> {
    let times_s: Vec<f64> = (0..record.command.len()).map(|n| n as f64 / record.rate_hz).collect();
    let position = record.position.as_ref().context("EMPS records its position")?;
    let channels = [
        (ChannelName::LinearCommand, &record.command),
        (ChannelName::Position, position),
        (ChannelName::Voltage, &record.drive),
    ];
    let channels =
        channels.map(|(name, values)| RecordedChannel::new(name, &times_s, values.clone()));
    let channels = channels.into_iter().collect::<Result<_, _>>()?;
    Ok(Recording::new(record.name.clone(), Metadata::default(), channels)?)
}

impl Emps {
    pub(super) fn read() -> Result<Self> {
        let (train, test) =
            (columns("emps/emps_train.csv.gz")?, columns("emps/emps_pulses_test.csv.gz")?);
        let recordings = Recordings {
            train: vec![record("training", &train, 0..HALF)],
            holdout: vec![record("pulses", &test, 0..HALF)],
            repeat: Vec::new(),
        };
        let raw = Set { model: MachineModel::ServoAxis(emps_model()?), recordings };
        let (recordings, finds) = correct_signals(&raw.model, &raw.recordings, JOBS)?;
        if let Some(find) = finds.iter().find(|find| !find.corrected) {
            bail!("the pulses are not set right: {}", find.sentence());
        }
        let sound = Set { recordings, ..raw.clone() };
        Ok(Self { raw, train, sound })
    }

    /// The recordings as they are with other model files that a user may set out from, and logged at
    /// rates that the controller's is no multiple of; what can be set right is.
    pub(super) fn set_out_elsewhere(&self) -> Result<Vec<(String, Set)>> {
        let zero = &self.raw;
        let published =
            Set { model: MachineModel::ServoAxis(emps_published()?), ..self.raw.clone() };
        let mut sets = Vec::new();
        for (offset, set) in [("offset as published", &published), ("offset zero", zero)] {
            for friction in [1.0, 0.7, 1.3] {
                let name = format!("{offset}, dry friction times {friction}");
                let dry = ["kinetic-friction-n", "static-friction-n"].map(|key| (key, friction));
                sets.push((name, set.with(&dry)?));
            }
        }
        for rate_hz in [640.0, 800.0, 2000.0] {
            for (how, is_held) in [("on straight lines", false), ("held", true)] {
                let mut set = zero.logged_at(rate_hz, is_held);
                let Recordings { train, holdout, .. } = &mut set.recordings;
                for record in train.iter_mut().chain(holdout) {
                    *record = compared(&logged(record)?, &set.model)?;
                }
                sets.push((format!("{rate_hz} Hz, {how}"), set));
            }
        }
        for (_, set) in &mut sets {
            set.recordings = correct_signals(&set.model, &set.recordings, JOBS)?.0;
        }
        Ok(sets)
    }

    /// Mutations that leave the machine and its recordings what they are.
    pub(super) fn equivalent(&self) -> Result<Vec<Case>> {
        let sound = &self.sound;
        let mut renamed = sound.clone();
        "a".clone_into(&mut renamed.recordings.train[0].name);
        "b".clone_into(&mut renamed.recordings.holdout[0].name);
        let length = sound
            .with(&[
                ("mass-kg", 1e-3),
                ("viscous-n-s-per-m", 1e-3),
                ("speed-gain-v-s-per-m", 1e-3),
                ("encoder-step-m", 1e3),
            ])?
            .times(Channel::Command, 1e3)
            .times(Channel::Position, 1e3);
        let volt = sound
            .with(&[
                ("force-constant-n-per-v", 1e-3),
                ("speed-gain-v-s-per-m", 1e3),
                ("output-limit-v", 1e3),
            ])?
            .times(Channel::Drive, 1e3);
        let all: Vec<(&str, Set)> = vec![
            ("mirrored, the offset too", sound.mirrored()),
            ("lengths in millimetres", length),
            ("voltage in millivolts", volt),
            ("500 Hz", sound.every(2)),
            ("250 Hz", sound.every(4)),
            ("200 Hz", sound.every(5)),
            ("125 Hz", sound.every(8)),
            ("begun 7 ms later", sound.part(7..HALF)),
            ("begun 0.5 s later", sound.part(500..HALF)),
            ("cut to 9.4 s", sound.part(0..9400)),
            ("renamed", renamed),
            ("voltage of 12 bits", sound.bits(12, RANGE_V)),
            ("noise of the voltage doubled", sound.noisy(3.0_f64.sqrt() * NOISE_V, 33)),
        ];
        let case = |(name, set): (&str, Set)| Case {
            name: name.to_owned(),
            asked: Asked::Same,
            is_development: false,
            set,
        };
        Ok(all.into_iter().map(case).collect())
    }

    /// Mutations that spoil the recordings or the model file.
    pub(super) fn harmful(&self) -> Result<Vec<Case>> {
        use Channel::{Command, Drive, Position};
        let sound = &self.sound;
        let mut cases = Vec::new();
        let mut add = |name: String, code: SignalCode, is_development: bool, set: Set| {
            cases.push(Case { name, asked: Asked::Code(code), is_development, set });
        };
        let delays =
            [(Drive, [2, 5, 10, 20]), (Position, [2, 5, 10, 20]), (Command, [2, 5, 10, 20])];
        for (channel, delays) in delays {
            for ms in delays {
                let is_development = ms == 5 && !matches!(channel, Command);
                let name = format!("{} {ms} ms late", channel.word());
                add(name, SignalCode::Late, is_development, sound.late(channel, ms));
            }
            let name = format!("sign of the {}", channel.word());
            let is_development = matches!(channel, Drive);
            add(name, SignalCode::Sign, is_development, sound.times(channel, -1.0));
        }
        for (channel, factor) in [(Drive, 2.0), (Drive, 0.5), (Position, 2.0)] {
            let name = format!("{} times {factor}", channel.word());
            let is_development = matches!(channel, Drive) && factor > 1.0;
            add(name, SignalCode::Gain, is_development, sound.times(channel, factor));
        }
        for share in [0.83, 0.6, 0.9] {
            let name = format!("voltage cut at {:.0} % of its peak", 100.0 * share);
            add(name, SignalCode::Saturated, share == 0.83, sound.cut(share));
        }
        for samples in [2000..2060, 5000..5200] {
            let name = format!("{} samples missing", samples.len());
            add(name, SignalCode::Gap, false, sound.without(samples));
        }
        for (range_v, is_development) in [(RANGE_V, true), (0.5 * RANGE_V, false)] {
            let name = format!("voltage of 8 bits to {range_v} V");
            add(name, SignalCode::Quantised, is_development, sound.bits(8, range_v));
        }
        let gains = [
            ("position-gain-per-s", 2.0, true),
            ("position-gain-per-s", 0.5, false),
            ("speed-gain-v-s-per-m", 2.0, false),
            ("speed-gain-v-s-per-m", 0.5, false),
        ];
        for (key, factor, is_development) in gains {
            let name = format!("`{key}` of the file times {factor}");
            add(name, SignalCode::Controller, is_development, sound.with(&[(key, factor)])?);
        }
        for (factor, is_development) in [(2.0, true), (0.5, false)] {
            let key = "force-constant-n-per-v";
            let name = format!("`{key}` of the file times {factor}");
            add(name, SignalCode::Constant, is_development, sound.with(&[(key, factor)])?);
        }
        for factor in [2.0, 0.5] {
            let name = format!("hold-out of a machine of {factor} times the mass (simulated)");
            add(name, SignalCode::OtherMachine, false, self.of_other_machine(factor)?);
        }
        let mut again = sound.clone();
        again.recordings.holdout = vec![record("again", &self.train, HALF..self.train[0].len())];
        add("the second half held out".to_owned(), SignalCode::SameMotion, false, again.clone());
        again.recordings.holdout =
            vec![record("again", &self.train, HALF + 1500..self.train[0].len() - 1500)];
        add("a part of the second half held out".to_owned(), SignalCode::SameMotion, false, again);
        add("pulses left in".to_owned(), SignalCode::Disturbed, true, self.raw.clone());
        Ok(cases)
    }

    /// The hold-out's command and load on an axis of another mass, by the model file.
    fn of_other_machine(&self, factor: f64) -> Result<Set> {
        let other = self.sound.with(&[("mass-kg", factor)])?;
        let MachineModel::ServoAxis(model) = &other.model else { bail!("EMPS is a servo axis") };
        let mut set = self.sound.clone();
        let held_out = &mut set.recordings.holdout[0];
        let scenario = AxisScenario {
            input: AxisInput::Position(Command::Recorded {
                values_rad: held_out.command.clone(),
                rate_hz: RATE_HZ,
            }),
            load: 0.0,
            duration_s: held_out.command.len() as f64 / RATE_HZ,
            start: AxisStart { position: held_out.command[0], ..AxisStart::default() },
        };
        let values_n_m = held_out.load.clone().unwrap_or_default();
        let trace = ServoAxisSimulation::new(&model.axis, &scenario)?
            .with_load(Load::Recorded { values_n_m, rate_hz: RATE_HZ })?
            .try_simulate(&(&HealthState::HEALTHY).into())?;
        held_out.drive = trace.output;
        held_out.position = Some(trace.position);
        let noisy = set.noisy(NOISE_V, 34);
        set.recordings.holdout = noisy.recordings.holdout;
        Ok(set)
    }
}
