//! Hidden machines that are set up as a user would, and diagnosed afterwards.
//!
//! Every machine has numbers off by their tolerances and sensors with errors of their own. Its phases are
//! connected in any order and sense, and its logger runs before the command. Other machines cannot be
//! set up at all.

use std::sync::Arc;

use fdi_core::{
    Channel, ChannelName, CommandSource, DiagnoseOptions, Diagnoser, Experiment, Metadata, Purpose,
    Recording, RootSeed, Setup, SetupError, SetupOptions, ToleranceUse,
    ema_sim::{Command, Converter, FaultCoordinates, Knot, PhaseSensors},
    in_parallel,
    report::{ActionLevels, FaultId, SetupRefusalCode, Verdict},
};

use super::{
    hidden::{HiddenDamage, electronics_seed, sensor_seed},
    learnt::{Day, Owned},
};
use crate::{
    answers::SENSORS,
    as_recorded::{ORDERS, Wiring},
    chance::Chance,
    request::EvaluationError,
};

/// Longest time that a logger runs before the command, s.
const MOST_BEFORE_S: f64 = 2.0;
/// Bits of the converters.
const BITS: u32 = 12;
const PHASES: [ChannelName; 3] =
    [ChannelName::PhaseACurrent, ChannelName::PhaseBCurrent, ChannelName::PhaseCCurrent];

/// One line of the study: machines of one bundle.
#[derive(Clone, Debug)]
pub struct SetupsLine {
    /// Machines.
    pub machines: usize,
    /// Recordings as new that each is set up with, each of a day of its own.
    pub references: usize,
    /// Later recordings of each without damage.
    pub sound: usize,
    /// Damage of one later recording each.
    pub damage: Vec<(FaultId, f64)>,
    /// Simulated tests of a setup without damage, and as many with.
    pub tests: usize,
}

impl SetupsLine {
    /// Settings of each setup.
    fn options(&self) -> SetupOptions {
        let levels = ActionLevels::default();
        SetupOptions { diagnosis: learning(), levels, tests: self.tests, jobs: 1 }
    }
}

/// Scores of a line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SetupsResult {
    /// Machines.
    pub machines: usize,
    /// Machines that were accepted.
    pub accepted: usize,
    /// Codes of the others.
    pub refusals: Vec<SetupRefusalCode>,
    /// Machines whose wiring was found as it is.
    pub wired: usize,
    /// Later recordings without damage of accepted machines.
    pub sound: usize,
    /// Later recordings without damage that are called healthy.
    pub healthy: usize,
    /// Later recordings without damage on which some is found.
    pub false_alarms: usize,
    /// Later recordings with damage, in the order of the line: found, of all.
    pub found: Vec<(usize, usize)>,
    /// Intervals of k1 to k6 that hold the truth, and all of them.
    pub held: (usize, usize),
    /// Simulated tests of the setups: false alarms of all without damage, found of all with it, held of
    /// all intervals.
    pub predicted: [(usize, usize); 3],
}

/// A way in which a machine cannot be set up, and the code that is expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unfit {
    /// The command goes one way.
    NoReversal,
    /// The gear has a ratio 10 % higher than the model file says.
    WrongGear,
    /// The recordings are of a machine with 1.6 times the inertia and half the torque constant.
    OtherMachine,
    /// The noise on each phase sample is as large as the current.
    Noise,
    /// The logger cuts the phases at 60 % of their peak.
    Saturated,
    /// The recordings end after 60 % of the test.
    TooShort,
}

impl Unfit {
    /// Every way.
    pub const ALL: [Self; 6] = [
        Self::NoReversal,
        Self::WrongGear,
        Self::OtherMachine,
        Self::Noise,
        Self::Saturated,
        Self::TooShort,
    ];

    /// Code that says so.
    pub fn code(self) -> SetupRefusalCode {
        match self {
            Self::NoReversal => SetupRefusalCode::NoReversal,
            Self::WrongGear => SetupRefusalCode::WrongGear,
            Self::OtherMachine => SetupRefusalCode::OtherMachine,
            Self::Noise => SetupRefusalCode::Noise,
            Self::Saturated => SetupRefusalCode::Saturated,
            Self::TooShort => SetupRefusalCode::TooShort,
        }
    }
}

/// How a bench records one machine.
#[derive(Clone, Copy, Debug)]
struct Bench {
    wiring: Wiring,
    before_s: f64,
    sensors: PhaseSensors,
}

impl Bench {
    fn drawn(experiment: &Experiment, chance: &mut Chance) -> Self {
        let phases = ORDERS[(6.0 * chance.uniform()) as usize];
        let wiring = Wiring { phases, is_reversed: chance.uniform() < 0.5 };
        let converter = Converter::of_drive(BITS, None, &experiment.actuator.controller);
        let sensors = PhaseSensors { converter: Some(converter), ..SENSORS };
        Self { wiring, before_s: MOST_BEFORE_S * chance.uniform(), sensors }
    }

    fn is_found_by(&self, setup: &Setup) -> bool {
        if self.wiring == Wiring::STATED {
            return setup.wiring.is_empty();
        }
        let is_right = |column: usize| {
            setup.wiring.iter().any(|one| {
                one.phase == PHASES[self.wiring.phases[column]]
                    && one.column == PHASES[column]
                    && (one.factor < 0.0) == self.wiring.is_reversed
            })
        };
        (0..3).all(is_right)
    }

    /// A recording of a unit on a day as this bench makes it.
    fn recorded(&self, experiment: &Experiment, day: &Day) -> Result<Recording, EvaluationError> {
        let electronics = electronics_seed(day.seed);
        let (phases_a, angle_rad) = day.hidden.phases(&experiment.scenario, electronics)?;
        let rate_hz = experiment.actuator.controller.sample_hz;
        let rest = (self.before_s * rate_hz).round() as usize;
        let with_rest = |signal: &[f64], before: f64| -> Vec<f64> {
            std::iter::repeat_n(before, rest).chain(signal.iter().copied()).collect()
        };
        let whole = [0, 1, 2].map(|phase| with_rest(&phases_a[phase], day.hidden.offsets_a[phase]));
        let columns = self.wiring.connected(&whole);
        let [a, b, c] = columns.each_ref().map(Vec::as_slice);
        let [a, b, c] = self.sensors.measure([a, b, c], sensor_seed(day.seed));
        let command = &experiment.scenario.command;
        let at = |n: usize| command.at((n as f64 - rest as f64).max(0.0) / rate_hz);
        let command_rad: Vec<f64> = (0..a.len()).map(at).collect();
        let channels = [
            (PHASES[0], a),
            (PHASES[1], b),
            (PHASES[2], c),
            (ChannelName::MotorAngle, with_rest(&angle_rad, angle_rad[0])),
            (ChannelName::Command, command_rad),
        ];
        let channels = channels
            .into_iter()
            .map(|(name, values)| Channel::uniform(name, 0.0, rate_hz, values))
            .collect::<Result<Vec<_>, _>>()?;
        let metadata = Metadata {
            command: Some(CommandSource::Recorded),
            rate_hz: Some(rate_hz),
            session: day.label.session.clone(),
            winding_temperature_k: day.hidden.read_temperature_k(&day.label),
            ..Metadata::default()
        };
        Ok(Recording::new("hidden", metadata, channels)?)
    }
}

/// Sets the machines of a line up and diagnoses them later.
///
/// # Errors
///
/// [`EvaluationError`] when a machine cannot be simulated.
pub fn evaluate_setups(
    diagnoser: &Diagnoser,
    line: &SetupsLine,
    seed: u64,
    jobs: usize,
) -> Result<SetupsResult, EvaluationError> {
    let experiment = &diagnoser.bundle().experiment;
    let indices: Vec<u64> = (0..line.machines as u64).collect();
    let all = in_parallel(&indices, jobs, |_, &index| -> Result<_, EvaluationError> {
        let own = RootSeed(seed).derive(Purpose::Units, index);
        let mut unit = Owned::usual(experiment, own);
        let bench = Bench::drawn(experiment, &mut unit.chance);
        let mut result = SetupsResult { machines: 1, ..SetupsResult::default() };
        let healthy = FaultCoordinates([0.0; 7]);
        let references = (0..line.references)
            .map(|_| bench.recorded(experiment, &unit.day(healthy)))
            .collect::<Result<Vec<_>, _>>()?;
        let setup = match diagnoser.set_up(&references, &line.options(), &|_, _| ()) {
            Ok(setup) => setup,
            Err(SetupError::Refused(refused)) => {
                result.refusals.push(refused.code);
                return Ok(result);
            }
            Err(error) => return Err(EvaluationError::Search { reason: error.to_string() }),
        };
        result.wired = usize::from(bench.is_found_by(&setup));
        result.predict(&setup);
        if let Some(refused) = &setup.refusal {
            result.refusals.push(refused.code);
            return Ok(result);
        }
        result.accepted = 1;
        let options = DiagnoseOptions { unit: Some(Arc::clone(&setup.unit)), ..learning() };
        for _ in 0..line.sound {
            let recording = bench.recorded(experiment, &unit.day(healthy))?;
            result.sound += 1;
            let Ok(answer) = diagnoser.diagnose(&recording, &options) else { continue };
            result.healthy += usize::from(answer.verdict == Verdict::Healthy);
            result.false_alarms += usize::from(answer.verdict == Verdict::Faulty);
            result.hold(&answer, &healthy);
        }
        for &(fault, level) in &line.damage {
            let damage = HiddenDamage::Alone(fault, level).draw(&mut unit.chance);
            let recording = bench.recorded(experiment, &unit.day(damage))?;
            let answer = diagnoser.diagnose(&recording, &options).ok();
            let is_found = answer.as_ref().is_some_and(|one| one.verdict == Verdict::Faulty);
            result.found.push((usize::from(is_found), 1));
            if let Some(answer) = &answer {
                result.hold(answer, &damage);
            }
        }
        Ok(result)
    })?;
    let mut sum =
        SetupsResult { found: vec![(0, 0); line.damage.len()], ..SetupsResult::default() };
    for one in all {
        sum.add(one);
    }
    Ok(sum)
}

/// Codes with which one machine is refused that is unfit in some way, in the order of the ways; `None`
/// where it is accepted.
///
/// # Errors
///
/// [`EvaluationError`] when a machine cannot be simulated.
pub fn evaluate_unfit(
    diagnoser: &Diagnoser,
    line: &SetupsLine,
    seed: u64,
) -> Result<Vec<Option<SetupRefusalCode>>, EvaluationError> {
    let one = |way: &Unfit| -> Result<_, EvaluationError> {
        let experiment = &diagnoser.bundle().experiment;
        if *way == Unfit::NoReversal {
            let mut one_way = experiment.clone();
            let command = &experiment.scenario.command;
            let end_s = experiment.scenario.duration_s;
            let at = |n: u32| command.at(end_s * f64::from(n) / 100.0);
            let most_rad = (0..100).map(at).fold(0.0, f64::max);
            let knots = [(0.0, 0.0), (end_s, most_rad)];
            let knots = knots.map(|(time_s, value_rad)| Knot { time_s, value_rad });
            one_way.scenario.command = Command::Ramps(knots.to_vec());
            let refused = fdi_core::check_test(&one_way).err();
            return Ok(refused.as_ref().and_then(code));
        }
        let own = RootSeed(seed).derive(Purpose::Units, *way as u64);
        let mut unit = Owned::usual(experiment, own);
        let mut bench = Bench::drawn(experiment, &mut unit.chance);
        let actuator = &mut unit.hidden.actuator;
        match way {
            Unfit::WrongGear => actuator.transmission.gear_ratio *= 1.1,
            Unfit::OtherMachine => {
                actuator.motor.inertia_kg_m2 *= 1.6;
                actuator.motor.back_emf_v_s_per_rad *= 0.5;
            }
            Unfit::Noise => {
                let peak_a = peak_a(experiment, &mut unit)?;
                bench.sensors = PhaseSensors { noise_a: peak_a, converter: None };
            }
            _ => {}
        }
        let limit_a =
            (*way == Unfit::Saturated).then(|| peak_a(experiment, &mut unit)).transpose()?;
        let healthy = FaultCoordinates([0.0; 7]);
        let mut references = Vec::new();
        for _ in 0..line.references {
            let recording = bench.recorded(experiment, &unit.day(healthy))?;
            references.push(match (way, limit_a) {
                (Unfit::Saturated, Some(peak_a)) => cut(&recording, 0.6 * peak_a)?,
                (Unfit::TooShort, _) => {
                    shortened(&recording, 0.6 * experiment.scenario.duration_s)?
                }
                _ => recording,
            });
        }
        match diagnoser.set_up(&references, &line.options(), &|_, _| ()) {
            Ok(setup) => Ok(setup.refusal.map(|refused| refused.code)),
            Err(error) => Ok(code(&error)),
        }
    };
    Unfit::ALL.iter().map(one).collect()
}

fn code(error: &SetupError) -> Option<SetupRefusalCode> {
    match error {
        SetupError::Refused(refused) => Some(refused.code),
        _ => None,
    }
}

fn learning() -> DiagnoseOptions {
    DiagnoseOptions { tolerance: ToleranceUse::Model, ..DiagnoseOptions::default() }
}

/// Largest phase current of a unit, A.
fn peak_a(experiment: &Experiment, unit: &mut Owned<'_>) -> Result<f64, EvaluationError> {
    let day = unit.day(FaultCoordinates([0.0; 7]));
    let (phases_a, _) = day.hidden.phases(&experiment.scenario, electronics_seed(day.seed))?;
    Ok(phases_a.iter().flatten().fold(0.0, |most: f64, i| most.max(i.abs())))
}

fn cut(recording: &Recording, limit_a: f64) -> Result<Recording, EvaluationError> {
    let channels = recording.channels().iter().map(|channel| {
        let (name, rate_hz) = (channel.name(), channel.sampling()?.rate_hz);
        let is_phase = PHASES.contains(&name);
        let clamp = |x: &f64| if is_phase { x.clamp(-limit_a, limit_a) } else { *x };
        Channel::uniform(name, 0.0, rate_hz, channel.values().iter().map(clamp).collect())
    });
    let channels = channels.collect::<Result<Vec<_>, _>>()?;
    Ok(Recording::new("hidden", recording.metadata.clone(), channels)?)
}

fn shortened(recording: &Recording, to_s: f64) -> Result<Recording, EvaluationError> {
    let moves = |channel: &Channel| {
        let values = channel.values();
        values.iter().position(|x| *x != values[0]).unwrap_or(0)
    };
    let begins = recording.channel(ChannelName::Command).map_or(0, moves);
    let channels = recording.channels().iter().map(|channel| {
        let rate_hz = channel.sampling()?.rate_hz;
        let kept = (begins + (to_s * rate_hz) as usize).min(channel.values().len());
        Channel::uniform(channel.name(), 0.0, rate_hz, channel.values()[..kept].to_vec())
    });
    let channels = channels.collect::<Result<Vec<_>, _>>()?;
    Ok(Recording::new("hidden", recording.metadata.clone(), channels)?)
}

impl SetupsResult {
    fn add(&mut self, one: Self) {
        self.machines += one.machines;
        self.accepted += one.accepted;
        self.refusals.extend(one.refusals);
        self.wired += one.wired;
        self.sound += one.sound;
        self.healthy += one.healthy;
        self.false_alarms += one.false_alarms;
        for (sum, found) in self.found.iter_mut().zip(one.found) {
            *sum = (sum.0 + found.0, sum.1 + found.1);
        }
        self.held = (self.held.0 + one.held.0, self.held.1 + one.held.1);
        for (sum, part) in self.predicted.iter_mut().zip(one.predicted) {
            *sum = (sum.0 + part.0, sum.1 + part.1);
        }
    }

    /// Counts what the setup itself says of its machine.
    fn predict(&mut self, setup: &Setup) {
        let tests = &setup.acceptance;
        let of =
            |pick: fn(&fdi_core::report::FaultTests) -> usize| tests.faults.iter().map(pick).sum();
        self.predicted = [
            (tests.false_alarms, tests.sound),
            (of(|fault| fault.found), of(|fault| fault.tests)),
            (tests.held, tests.intervals),
        ];
    }

    fn hold(&mut self, answer: &fdi_core::report::RecordDiagnosis, damage: &FaultCoordinates) {
        let levels = damage.levels();
        for fault in answer.faults.iter().filter(|fault| fault.id != FaultId::K7) {
            let Some([from, to]) = fault.interval_95 else { continue };
            self.held.1 += 1;
            self.held.0 += usize::from((from..=to).contains(&levels[fault.id as usize]));
        }
    }
}
