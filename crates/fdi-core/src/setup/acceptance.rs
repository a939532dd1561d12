//! Simulated tests of a unit that was learnt: does the diagnosis of this very machine find damage, raise no
//! alarm without it, and hold the truth in its intervals?
//!
//! ```text
//! machine   numbers as built, most probable by the recordings as new, and the scatter of a day of its own
//! damage    none; or one fault at the level from which it is to be watched
//! recording high fidelity, noise, rate, columns and start of the recordings as new
//! ```
//!
//! The tests share the model file with the diagnosis. They show what test, noise and unit can tell; physics
//! that the file does not have they do not show.

use std::{f64::consts::TAU, sync::Arc};

use ema_sim::{FaultCoordinates, HighFidelity, PhaseSensors};
use recordings::{Channel, ChannelName, Current, RecordError, Recording};

use super::recorded::Seen;
use crate::{
    diagnose::Diagnoser,
    online::options::DiagnoseOptions,
    report::{
        Acceptance, ActionLevels, FaultId, FaultTests, RecordDiagnosis, SetupRefusalCode,
        ToleranceUse, Verdict,
    },
    seed::{Draws, Purpose, RootSeed},
    setup::{error::SetupError, options::SetupOptions},
    simulation::simulated::{RecordedContent, SimulatedRecording},
    statistics::parallel::in_parallel,
    unit::{
        design::built,
        layout::{Acts, Layout},
        learnt_unit::LearntUnit,
    },
};

/// Share of the tests without damage that may be called faulty.
const MOST_FALSE_ALARMS: f64 = 0.05;
/// Share of the intervals that have to hold the truth: of 95 %, less what so few tests scatter by.
const LEAST_HELD: f64 = 0.85;
/// Share of the tests of some fault that have to be found, for one fault at least.
const LEAST_FOUND: f64 = 0.5;
/// Share of the tests that may be left without an answer.
const MOST_UNANSWERED: f64 = 0.1;
/// Standard deviations beyond which no day is drawn.
const FARTHEST: f64 = 2.5;
/// Faults that are tested, of shorts one.
const KINDS: [FaultId; 4] = [FaultId::K1, FaultId::K2, FaultId::K3, FaultId::K6];

const PHASES: [ChannelName; 3] =
    [ChannelName::PhaseACurrent, ChannelName::PhaseBCurrent, ChannelName::PhaseCCurrent];

/// Channels that a voltage of the motor comes in.
const VOLTAGES: [ChannelName; 3] =
    [ChannelName::MotorVoltage, ChannelName::QAxisVoltage, ChannelName::Duty];

/// Simulated tests of a unit.
pub(super) struct Tests<'a> {
    diagnoser: &'a Diagnoser,
    unit: &'a Arc<LearntUnit>,
    /// A recording whose columns the tests have.
    like: &'a Recording,
    seen: &'a [Seen],
    levels: &'a ActionLevels,
    layout: Layout,
    /// Numbers of the machine as built.
    built: Vec<f64>,
    noise_a: f64,
}

/// A test and its answer.
struct Answered {
    damage: FaultCoordinates,
    fault: Option<FaultId>,
    answer: Option<RecordDiagnosis>,
}

impl<'a> Tests<'a> {
    /// Tests of a unit that was learnt from such recordings; `None` where they do not determine it.
    pub(super) fn of(
        diagnoser: &'a Diagnoser,
        unit: &'a Arc<LearntUnit>,
        like: &'a Recording,
        seen: &'a [Seen],
        levels: &'a ActionLevels,
    ) -> Option<Self> {
        let quantities = diagnoser.learnt.quantities();
        let fit = unit.as_built(&quantities)?;
        let layout = quantities.layout().clone();
        let mut built = vec![0.0; layout.numbers.len()];
        for (&place, &value) in fit.numbers.iter().zip(&fit.estimate) {
            built[place] = value;
        }
        let squares: f64 = seen.iter().map(|one| one.noise_a * one.noise_a).sum();
        let noise_a = (squares / seen.len() as f64).sqrt();
        Some(Self { diagnoser, unit, like, seen, levels, layout, built, noise_a })
    }

    /// Level of a fault in the tests.
    fn level(&self, fault: FaultId) -> f64 {
        self.levels.watch[fault as usize]
    }

    /// Runs the tests and judges the diagnosis by them.
    pub(super) fn acceptance(&self, options: &SetupOptions) -> Result<Acceptance, SetupError> {
        let sought = |id: &FaultId| self.layout.sought.contains(&(*id as usize));
        let kinds: Vec<FaultId> = KINDS.into_iter().filter(sought).collect();
        let cases: Vec<Option<FaultId>> = (0..options.tests)
            .map(|_| None)
            .chain((0..options.tests).map(|n| kinds.get(n % kinds.len().max(1)).copied()))
            .collect();
        let answered = in_parallel(&cases, options.jobs, |index, fault| {
            self.answered(index as u64, *fault, &options.diagnosis)
        })?;
        Ok(self.judged(&answered, &kinds))
    }

    /// Simulates a test and diagnoses it.
    fn answered(
        &self,
        index: u64,
        fault: Option<FaultId>,
        options: &DiagnoseOptions,
    ) -> Result<Answered, SetupError> {
        let own = RootSeed(RootSeed(options.seed).derive(Purpose::Acceptance, index));
        let mut random = Draws::new(own.derive(Purpose::Units, 0));
        let damage = fault.map_or(FaultCoordinates([0.0; 7]), |fault| {
            let level = self.level(fault);
            let (phase, angle_rad) = (random.uniform(), TAU * random.uniform());
            let mut damage = FaultCoordinates([0.0; 7]);
            match fault {
                FaultId::K3 => damage.0[2 + (3.0 * phase) as usize] = level,
                FaultId::K6 => {
                    damage.0[5] = level * angle_rad.cos();
                    damage.0[6] = level * angle_rad.sin();
                }
                _ => damage.0[fault as usize] = level,
            }
            damage
        });
        let recording = self.recording(&damage, &mut random, own, index)?;
        let options = DiagnoseOptions {
            unit: Some(Arc::clone(self.unit)),
            tolerance: ToleranceUse::Model,
            ..options.clone()
        };
        let answer = self.diagnoser.diagnose(&recording, &options).ok();
        Ok(Answered { damage, fault, answer })
    }

    /// The machine with its damage on a day of its own, recorded as the recordings as new are.
    fn recording(
        &self,
        damage: &FaultCoordinates,
        random: &mut Draws,
        own: RootSeed,
        index: u64,
    ) -> Result<Recording, SetupError> {
        let experiment = &self.diagnoser.bundle().experiment;
        let point = self.point(damage, random);
        let machine = built(experiment, &self.layout, &point);
        let seen = &self.seen[index as usize % self.seen.len()];
        let start_angle_rad = seen.start_angle_rad.unwrap_or(experiment.scenario.start_angle_rad);
        let scenario = machine.scenario.turned_to(start_angle_rad);
        let scenario = scenario.with_real_electronics(own.derive(Purpose::ControllerNoise, 0));
        let model = HighFidelity::new(&machine.actuator, &scenario)?;
        let model = model.with_effects(&experiment.effects)?;
        let content = match self.like.require_current()? {
            Current::Phases(_) => RecordedContent::Phases,
            Current::Quadrature(_) => RecordedContent::Quadrature,
            Current::Envelope(_) if seen.start_angle_rad.is_some() => RecordedContent::Envelope,
            Current::Envelope(_) => RecordedContent::EnvelopeWithoutAngle,
        };
        let recorded = SimulatedRecording {
            start_angle_rad,
            sensors: PhaseSensors { noise_a: self.noise_a, converter: None },
            phase_rate_hz: Some(seen.phase_rate_hz),
            sensor_seed: own.derive(Purpose::SensorNoise, 0),
            content,
            has_voltage: VOLTAGES.iter().any(|&name| self.like.channel(name).is_some()),
            // the model has these
            faults: *damage,
            imperfections: scenario.imperfections,
            controller_seed: scenario.seed,
        };
        let (mut trace, _) = recorded.sampled(&model, &machine.faults, experiment)?;
        for (number, value) in self.layout.at(&point) {
            match number.acts {
                Acts::PhaseGain(phase) => {
                    trace.phase_currents_a[phase].iter_mut().for_each(|x| *x *= 1.0 + value);
                }
                Acts::PhaseOffset(phase) => {
                    trace.phase_currents_a[phase].iter_mut().for_each(|x| *x += value);
                }
                Acts::VoltageGain => {
                    trace.motor_voltage_v.iter_mut().for_each(|x| *x *= 1.0 + value);
                }
                _ => {}
            }
        }
        let whole = recorded.of_trace(trace, experiment, "acceptance")?;
        Ok(self.with_columns_alike(&whole)?)
    }

    /// The unknowns of the machine on a day.
    fn point(&self, damage: &FaultCoordinates, random: &mut Draws) -> Vec<f64> {
        let of_day = self.layout.numbers.iter().map(|number| {
            let scatter = number.scatter.session.hypot(number.scatter.recording);
            scatter * random.normal_within(FARTHEST)
        });
        let numbers = self.built.iter().zip(of_day).map(|(built, day)| built + day);
        self.layout.sought.iter().map(|&index| damage.0[index]).chain(numbers).collect()
    }

    /// A recording with the columns that the recordings as new have: without the angle where they have
    /// neither it nor Hall sensors, a phase computed of the two others where theirs is.
    fn with_columns_alike(&self, whole: &Recording) -> Result<Recording, RecordError> {
        let shows = |name| self.like.channel(name).is_some();
        let has_angle = shows(ChannelName::MotorAngle) || shows(ChannelName::HallState);
        let is_kept = |channel: &&Channel| has_angle || channel.name() != ChannelName::MotorAngle;
        let mut channels: Vec<Channel> = whole.channels().iter().filter(is_kept).cloned().collect();
        if let Some(name) = self.like.computed_phase()
            && let [Some(a), Some(b), Some(c)] = PHASES.map(|phase| whole.channel(phase))
        {
            let all = a.values().iter().zip(b.values()).zip(c.values());
            let own = whole.channel(name).map_or(&[][..], Channel::values);
            let computed = all.zip(own).map(|(((a, b), c), own)| own - (a + b + c)).collect();
            let rate_hz = a.sampling()?.rate_hz;
            channels.retain(|channel| channel.name() != name);
            channels.push(Channel::uniform(name, 0.0, rate_hz, computed)?);
        }
        Recording::new(whole.name.clone(), whole.metadata.clone(), channels)
    }

    fn judged(&self, answered: &[Answered], kinds: &[FaultId]) -> Acceptance {
        let is = |one: &Answered, verdict| {
            one.answer.as_ref().is_some_and(|answer| answer.verdict == verdict)
        };
        let count = |is_sound: bool, verdict| {
            answered
                .iter()
                .filter(|one| one.fault.is_none() == is_sound && is(one, verdict))
                .count()
        };
        let (intervals, held) = held(answered);
        let sound = answered.iter().filter(|one| one.fault.is_none()).count();
        let inadequate = [true, false].map(|is_sound| count(is_sound, Verdict::ModelInadequate));
        let faults = kinds.iter().map(|&id| {
            let of = answered.iter().filter(|one| one.fault == Some(id));
            let found = of.clone().filter(|one| is(one, Verdict::Faulty)).count();
            let stds = answered.iter().filter(|one| one.fault.is_none()).filter_map(|one| {
                one.answer.as_ref()?.faults.iter().find(|fault| fault.id == id)?.std
            });
            let mut stds: Vec<f64> = stds.collect();
            stds.sort_by(f64::total_cmp);
            let std = stds.get(stds.len() / 2).copied();
            FaultTests { id, level: self.level(id), tests: of.count(), found, std }
        });
        Acceptance {
            noise_a: self.noise_a,
            sound,
            healthy: count(true, Verdict::Healthy),
            false_alarms: count(true, Verdict::Faulty),
            unanswered: answered.iter().filter(|one| one.answer.is_none()).count()
                + inadequate.into_iter().sum::<usize>(),
            intervals,
            held,
            faults: faults.collect(),
        }
    }
}

/// Intervals of determined levels, and those that hold the truth.
fn held(answered: &[Answered]) -> (usize, usize) {
    let (mut intervals, mut held) = (0, 0);
    for Answered { damage, answer, .. } in answered {
        let levels = damage.levels();
        let faults = answer.iter().flat_map(|answer| &answer.faults);
        for fault in faults.filter(|fault| fault.id != FaultId::K7) {
            let Some([from, to]) = fault.interval_95 else { continue };
            intervals += 1;
            held += usize::from((from..=to).contains(&levels[fault.id as usize]));
        }
    }
    (intervals, held)
}

/// Reason against relying on the diagnosis, by its tests; `None` where there is none.
pub(super) fn objection(tests: &Acceptance) -> Option<(SetupRefusalCode, String)> {
    let all = tests.sound + tests.faults.iter().map(|fault| fault.tests).sum::<usize>();
    let share = |part: usize, of: usize| part as f64 / of.max(1) as f64;
    if share(tests.unanswered, all) > MOST_UNANSWERED {
        let reason = format!(
            "{} of {all} simulated tests of this unit are left without an answer",
            tests.unanswered
        );
        return Some((SetupRefusalCode::NotCalibrated, reason));
    }
    if share(tests.false_alarms, tests.sound) > MOST_FALSE_ALARMS {
        let reason = format!(
            "{} of {} simulated tests of this unit without damage are called faulty, at most {:.0} % \
             may be",
            tests.false_alarms,
            tests.sound,
            100.0 * MOST_FALSE_ALARMS
        );
        return Some((SetupRefusalCode::NotCalibrated, reason));
    }
    if share(tests.held, tests.intervals) < LEAST_HELD {
        let reason = format!(
            "{} of {} intervals of 95 % in simulated tests of this unit hold the truth, expected {:.0} % \
             at least",
            tests.held,
            tests.intervals,
            100.0 * LEAST_HELD
        );
        return Some((SetupRefusalCode::NotCalibrated, reason));
    }
    let is_found = |fault: &FaultTests| share(fault.found, fault.tests) >= LEAST_FOUND;
    if !tests.faults.iter().any(is_found) {
        let reason = format!(
            "no fault at the level from which it is to be watched is found in half of the simulated \
             tests, with the {:.3} A of noise that the recordings have on each phase sample",
            tests.noise_a
        );
        return Some((SetupRefusalCode::Noise, reason));
    }
    None
}
