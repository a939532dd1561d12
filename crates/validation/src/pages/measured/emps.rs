//! The EMPS rig: what its published structure without the offset leaves out.

use anyhow::{Result, bail};
use ema_sim::{
    AxisInput, AxisScenario, AxisStart, Command, Effect, HealthState, Load, ServoAxisSimulation,
    model_file::{AxisModel, MachineModel, parse_machine},
};
use greybox::{CommandKind, Explained, Options, Record, Recordings, Signals, explain, rms};

use super::{
    benchmark::{FORCE_PER_VOLT, Motion, Raw, Refit, Term, refit},
    forces::of_effects,
    recording::{columns, interpolated},
    setting::JOBS,
};

const RATE_HZ: f64 = 1000.0;
/// The recording moves there and back four times; here the second two begin.
pub(super) const HALF: usize = 12_464;
/// Left out of a simulation: the start of a recording that is under way.
const SETTLED: usize = 300;
/// A delay of the voltage, s: what the benchmark's residual would gain from, for comparison.
pub(super) const DELAY_S: f64 = 5e-4;

/// Mass, drag and friction.
pub(super) const STRUCTURE: [Term; 3] = [Term::Mass, Term::Viscous, Term::Dry];

/// The published structure.
pub(crate) fn published() -> Result<AxisModel> {
    let text = include_str!("../../../../../fixtures/models/emps.toml");
    match parse_machine(text)? {
        MachineModel::ServoAxis(model) => Ok(model),
        MachineModel::Actuator(_) => bail!("`emps.toml` is a servo axis"),
    }
}

/// The published structure without its offset.
pub(crate) fn model() -> Result<AxisModel> {
    let mut model = published()?;
    model.axis.offset = 0.0;
    Ok(model)
}

/// The two recordings, by columns.
pub(super) struct Data {
    train: Vec<Vec<f64>>,
    test: Vec<Vec<f64>>,
}

impl Data {
    pub(super) fn read() -> Result<Self> {
        Ok(Self {
            train: columns("emps/emps_train.csv.gz")?,
            test: columns("emps/emps_pulses_test.csv.gz")?,
        })
    }

    fn record(&self, name: &str, samples: core::ops::Range<usize>) -> Record {
        let of = |place: usize| self.train[place][samples.clone()].to_vec();
        let time_s = of(0);
        let last = time_s.len() - 1;
        Record {
            name: name.to_owned(),
            rate_hz: last as f64 / (time_s[last] - time_s[0]),
            command: of(1),
            kind: CommandKind::Position,
            drive: of(3),
            position: Some(of(2)),
            load: None,
            filter_hz: None,
            start_rad: None,
        }
    }

    /// The training recording alone: its first half fitted, its second held out.
    /// Each begins `later` samples on.
    fn halves(&self, later: usize) -> Recordings {
        Recordings {
            train: vec![self.record("first half", later..HALF)],
            holdout: vec![self.record("second half", HALF + later..self.train[0].len())],
            repeat: Vec::new(),
        }
    }

    /// The answer to the two halves.
    pub(super) fn explained(&self, later: usize) -> Result<Explained> {
        explained(model()?, &self.halves(later))
    }

    /// Rows of the benchmark's residual that need no explanation: the structure without and with
    /// the offset, and a drag that differs between the directions, without and with a delay.
    pub(super) fn known(&self) -> Result<Vec<(&'static str, Refit)>> {
        let with = |more: &[Term]| [&STRUCTURE[..], more].concat();
        let asymmetry = with(&[Term::ViscousAsymmetry]);
        Ok(vec![
            ("structure without offset", self.refit(&with(&[]), 0.0)?),
            ("with the offset", self.refit(&with(&[Term::Offset]), 0.0)?),
            ("with the viscous asymmetry", self.refit(&asymmetry, 0.0)?),
            ("with it and a delay of 0.5 ms", self.refit(&asymmetry, DELAY_S)?),
        ])
    }

    /// The structure with effects at the shapes in which they were found.
    pub(super) fn with_effects(&self, effects: &[&Effect]) -> Result<Refit> {
        self.refit(&of_effects(&STRUCTURE, effects)?, 0.0)
    }

    /// The training as it was recorded, its force in N.
    pub(super) fn raw_training(&self) -> Raw {
        Raw {
            rate_hz: RATE_HZ,
            position: self.train[2].clone(),
            force: self.train[3].iter().map(|volt| FORCE_PER_VOLT * volt).collect(),
            load: None,
        }
    }

    /// The answer to slower recordings of the training, straight between samples, from a model that
    /// has these effects already.
    pub(super) fn explained_at(&self, rate_hz: f64, effects: &[Effect]) -> Result<Explained> {
        let mut model = model()?;
        model.effects.extend(effects.iter().cloned().map(Into::into));
        let mut halves = self.halves(0);
        for record in halves.train.iter_mut().chain(&mut halves.holdout) {
            *record = at_rate(record, rate_hz);
        }
        explained(model, &halves)
    }

    /// Training and test as the benchmark's procedure sees them.
    pub(super) fn motions(&self) -> [Motion; 2] {
        [Motion::of(&self.train), Motion::of(&self.test)]
    }

    fn refit(&self, terms: &[Term], delay_s: f64) -> Result<Refit> {
        let [train, test] = self.motions();
        refit((&[train], &[test]), terms, delay_s)
    }

    /// Root mean square of measured less simulated voltage in closed loop, V, training and test.
    pub(super) fn closed_loop(&self, model: &AxisModel) -> Result<[f64; 2]> {
        Ok([closed_loop(model, &self.train)?, closed_loop(model, &self.test)?])
    }
}

fn explained(model: AxisModel, recordings: &Recordings) -> Result<Explained> {
    // both halves are of the one motion that there is
    let options = Options { jobs: JOBS, signals: Signals::Trusted, ..Options::default() };
    Ok(explain(&MachineModel::ServoAxis(model), recordings, &options)?)
}

/// A recording at a lower rate, straight between its samples.
fn at_rate(record: &Record, rate_hz: f64) -> Record {
    if rate_hz >= RATE_HZ {
        return record.clone();
    }
    let times: Vec<f64> = (0..record.drive.len()).map(|n| n as f64 / record.rate_hz).collect();
    let samples = (record.duration_s() * rate_hz) as usize;
    let slower = |channel: &Vec<f64>| {
        (0..samples).map(|n| interpolated(&times, channel, n as f64 / rate_hz)).collect()
    };
    Record {
        rate_hz,
        command: slower(&record.command),
        drive: slower(&record.drive),
        position: record.position.as_ref().map(slower),
        ..record.clone()
    }
}

/// A model whose friction is raised by what was fitted as wear.
pub(super) fn worn(explained: &Explained, extended: &AxisModel) -> AxisModel {
    let mut model = extended.clone();
    for fault in explained.faults.iter().filter(|fault| fault.key == "k1") {
        let worn = 1.0 + 2.0 * fault.after.value;
        model.axis.kinetic_friction *= worn;
        model.axis.static_friction *= worn;
    }
    model
}

/// The rig's reference through its own controller, from its first position and speed. The voltage
/// of the test recording has pulses added behind the controller: they push the simulated carriage
/// and are in the voltage compared.
fn closed_loop(model: &AxisModel, columns: &[Vec<f64>]) -> Result<f64> {
    let (reference, position, voltage) = (&columns[1], &columns[2], &columns[3]);
    let pulses = columns.get(4).map(|flag| pulses(model, columns, flag));
    let scenario = AxisScenario {
        input: AxisInput::Position(Command::Recorded {
            values_rad: reference.clone(),
            rate_hz: RATE_HZ,
        }),
        load: 0.0,
        duration_s: reference.len() as f64 / RATE_HZ,
        start: AxisStart {
            position: position[0],
            speed: (position[10] - position[0]) * RATE_HZ / 10.0,
            ..AxisStart::default()
        },
    };
    let effects: Vec<Effect> = model.effects.iter().map(|block| block.effect.clone()).collect();
    let mut simulation =
        ServoAxisSimulation::new(&model.axis, &scenario)?.with_effects(&effects)?;
    if let Some(pulses) = &pulses {
        let values_n_m = pulses.iter().map(|u| -model.axis.force_constant * u).collect();
        simulation = simulation.with_load(Load::Recorded { values_n_m, rate_hz: RATE_HZ })?;
    }
    let trace = simulation.try_simulate(&(&HealthState::HEALTHY).into())?;
    let added = |n: usize| pulses.as_ref().map_or(0.0, |pulses| pulses[n]);
    let left = |n: usize| voltage[n] - trace.output[n] - added(n);
    Ok(rms(&(SETTLED..voltage.len()).map(left).collect::<Vec<f64>>()))
}

/// The pulses: recorded voltage less what the controller makes of reference and position, its
/// median over the samples whose flag is set.
fn pulses(model: &AxisModel, columns: &[Vec<f64>], flag: &[f64]) -> Vec<f64> {
    let (reference, position, voltage) = (&columns[1], &columns[2], &columns[3]);
    let controller = &model.axis.controller;
    let (kp, kv) = (controller.position_gain_per_s, controller.speed_gain);
    let added = |n: usize| {
        let speed = 0.5 * RATE_HZ * (position[n] - position[n - 2]);
        voltage[n] - kv * (kp * (reference[n] - position[n]) - speed)
    };
    let mut all: Vec<f64> = (2..flag.len()).filter(|n| flag[*n] != 0.0).map(added).collect();
    all.sort_by(f64::total_cmp);
    let size = all.get(all.len() / 2).copied().unwrap_or(0.0);
    flag.iter().map(|flag| if *flag == 0.0 { 0.0 } else { size }).collect()
}
