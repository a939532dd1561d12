//! A machine run on the command of a recording, and its controller run on the measured position.

use ema_sim::{
    Actuator, AxisInput, AxisScenario, AxisStart, AxisTrace, Command, ControlMode, Drive, Effect,
    EffectId, EnvelopeFilter, Load, LowFidelity, LowFidelityTrace, PhysicalFaults, Scenario,
    ServoAxis, ServoAxisSimulation, SimulationError,
    model_file::{AxisModel, MachineModel, Model},
};

use crate::{
    error::GreyboxError,
    follow::{follower, motion},
    machine::{Machine, Prediction, State},
    record::{CommandKind, Record},
};

impl Machine {
    /// What of the drive signal came about through the plant: the controller's answer to the
    /// measured position less that to the position predicted, at the recording's rate. What is
    /// left of a residual beside it entered after the controller, or in it.
    ///
    /// `None` for a recording without a position, or whose drive signal was filtered.
    pub(crate) fn through_plant(
        &self,
        state: &State,
        record: &Record,
        place: usize,
    ) -> Result<Option<Vec<f64>>, GreyboxError> {
        let (Some(position), None) = (&record.position, record.filter_hz) else {
            return Ok(None);
        };
        if record.kind == CommandKind::Motion {
            return Ok(None);
        }
        Ok(match self.prepare(state, record, place)? {
            Run::Actuator(run) => Some(run.through_plant(record, position)),
            Run::Axis(run) => Some(run.through_plant(record, position)),
            Run::None => None,
        })
    }

    pub(crate) fn prepare(
        &self,
        state: &State,
        record: &Record,
        place: usize,
    ) -> Result<Run, GreyboxError> {
        let effects = self.acting(state, place);
        let faults = PhysicalFaults::from(&state.faults);
        Ok(match self.with_rough(&state.rough) {
            MachineModel::Actuator(model) => {
                Run::Actuator(Box::new(of_actuator(&model, &faults, &effects, record)?))
            }
            MachineModel::ServoAxis(model) => {
                Run::Axis(Box::new(of_axis(&model, &faults, &effects, record)?))
            }
            _ => Run::None,
        })
    }

    /// An actuator as its file says, without effects, on the command of a recording; `None` for an
    /// axis, and where it cannot be run.
    pub(crate) fn actuator_test(&self, record: &Record) -> Option<LowFidelity> {
        match self.with_rough(&[]) {
            MachineModel::Actuator(model) => Some(actuator_test(&model, &[], record).ok()?.0),
            _ => None,
        }
    }

    /// The drive signal alone of a run on the command of a recording. An actuator does not keep
    /// what else it did, and takes command and load from its [`actuator_test`](Self::actuator_test)
    /// where there is one.
    pub(crate) fn drive(
        &self,
        state: &State,
        (record, test): (&Record, Option<&LowFidelity>),
        place: usize,
    ) -> Result<Vec<f64>, GreyboxError> {
        let MachineModel::Actuator(model) = self.with_rough(&state.rough) else {
            return Ok(self.simulate(state, record, place)?.drive);
        };
        let effects = self.acting(state, place);
        let (simulation, step) = match test {
            Some(test) => {
                let simulation = test
                    .on_actuator(&model.actuator)
                    .and_then(|test| test.with_effects(&effects))
                    .map_err(refused(record))?;
                (simulation, ticks_per_sample(record, model.actuator.controller.sample_hz)?)
            }
            None => actuator_test(&model, &effects, record)?,
        };
        let mut current_a = Vec::new();
        simulation.simulate_current(&PhysicalFaults::from(&state.faults), &mut current_a);
        finite(current_drive(&current_a, model.actuator.controller.sample_hz, step, record), record)
    }

    /// What is built in and what acts in a recording.
    fn acting(&self, state: &State, place: usize) -> Vec<Effect> {
        let mut effects = self.built_in.clone();
        effects.extend(state.in_record.get(place).unwrap_or(&state.effects).iter().cloned());
        effects
    }
}

/// The drive signal of a recording, given the current at each tick of the controller.
fn current_drive(current_a: &[f64], rate_hz: f64, step: usize, record: &Record) -> Vec<f64> {
    match record.filter_hz {
        Some(corner_hz) => {
            EnvelopeFilter { corner_hz, output_hz: record.rate_hz }.apply(current_a, rate_hz)
        }
        None => every(current_a, step, record.drive.len()),
    }
}

/// A drive signal that is a number throughout.
pub(crate) fn finite(drive: Vec<f64>, record: &Record) -> Result<Vec<f64>, GreyboxError> {
    if drive.iter().all(|x| x.is_finite()) {
        Ok(drive)
    } else {
        Err(GreyboxError::NotFinite { record: record.name.clone() })
    }
}

/// A machine on the command of a recording, with what it did.
pub(crate) enum Run {
    Actuator(Box<ActuatorRun>),
    Axis(Box<AxisRun>),
    None,
}

pub(crate) struct ActuatorRun {
    simulation: LowFidelity,
    trace: LowFidelityTrace,
    ticks_per_sample: usize,
    gear_ratio: f64,
}

pub(crate) struct AxisRun {
    simulation: ServoAxisSimulation,
    trace: AxisTrace,
    ticks_per_sample: usize,
    drive: Drive,
}

impl ActuatorRun {
    pub(crate) fn prediction(self, record: &Record) -> Prediction {
        let (trace, step, samples) = (self.trace, self.ticks_per_sample, record.drive.len());
        Prediction {
            drive: current_drive(&trace.current_a, trace.rate_hz, step, record),
            motor: every(&trace.motor_angle_rad, step, samples),
            speed: every(&trace.motor_speed_rad_per_s, step, samples),
            surface: every(&trace.surface_angle_rad, step, samples),
        }
    }

    fn through_plant(&self, record: &Record, position: &[f64]) -> Vec<f64> {
        let (step, samples) = (self.ticks_per_sample, record.drive.len());
        let predicted = every(&self.trace.motor_angle_rad, step, samples);
        let off = Departure::new(&predicted, position, step, 1.0 / self.trace.rate_hz);
        let mut seen = self.trace.clone();
        off.add_angle(&mut seen.motor_angle_rad, 1.0);
        off.add_angle(&mut seen.surface_angle_rad, 1.0 / self.gear_ratio);
        off.add_speed(&mut seen.motor_speed_rad_per_s);
        let difference = difference(
            &self.simulation.replayed_current_a(&seen),
            &self.simulation.replayed_current_a(&self.trace),
        );
        // asked for in one tick, the current is there in the next
        every(&delayed(difference), step, samples)
    }
}

impl AxisRun {
    fn shown(&self) -> &Vec<f64> {
        match self.drive {
            Drive::Amplifier => &self.trace.output,
            _ => &self.trace.current,
        }
    }

    pub(crate) fn prediction(self, record: &Record) -> Prediction {
        let (step, samples) = (self.ticks_per_sample, record.drive.len());
        Prediction {
            drive: every(self.shown(), step, samples),
            motor: every(&self.trace.position, step, samples),
            speed: every(&self.trace.speed, step, samples),
            surface: every(&self.trace.position, step, samples),
        }
    }

    fn through_plant(&self, record: &Record, position: &[f64]) -> Vec<f64> {
        let (step, samples) = (self.ticks_per_sample, record.drive.len());
        let predicted = every(&self.trace.position, step, samples);
        let off = Departure::new(&predicted, position, step, 1.0 / self.trace.rate_hz);
        let mut seen = self.trace.clone();
        off.add_angle(&mut seen.position, 1.0);
        off.add_speed(&mut seen.speed);
        // of its own trace the controller makes its own output
        let difference = difference(&self.simulation.replayed_output(&seen), &self.trace.output);
        let shown = if self.drive == Drive::Amplifier { difference } else { delayed(difference) };
        every(&shown, step, samples)
    }
}

/// Measured less predicted position, and its rate, at the ticks of the controller.
struct Departure {
    angle: Vec<f64>,
    speed: Vec<f64>,
}

impl Departure {
    fn new(predicted: &[f64], measured: &[f64], ticks_per_sample: usize, tick_s: f64) -> Self {
        let off = difference(measured, predicted);
        let last = off.len().saturating_sub(1);
        let sample_s = tick_s * ticks_per_sample as f64;
        let rate = |n: usize| {
            let (before, after) = (n.saturating_sub(1), (n + 1).min(last));
            (off[after] - off[before]) / ((after - before).max(1) as f64 * sample_s)
        };
        let rates: Vec<f64> = (0..off.len()).map(rate).collect();
        let at_ticks = |values: &[f64]| -> Vec<f64> {
            (0..values.len() * ticks_per_sample)
                .map(|tick| {
                    let (n, part) = (tick / ticks_per_sample, tick % ticks_per_sample);
                    let next = values[(n + 1).min(last)];
                    values[n] + (next - values[n]) * part as f64 / ticks_per_sample as f64
                })
                .collect()
        };
        Self { angle: at_ticks(&off), speed: at_ticks(&rates) }
    }

    fn add_angle(&self, to: &mut [f64], share: f64) {
        for (x, off) in to.iter_mut().zip(&self.angle) {
            *x += share * off;
        }
    }

    fn add_speed(&self, to: &mut [f64]) {
        for (x, off) in to.iter_mut().zip(&self.speed) {
            *x += off;
        }
    }
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// One tick later.
fn delayed(mut values: Vec<f64>) -> Vec<f64> {
    values.pop();
    values.insert(0, 0.0);
    values
}

fn not_followed(record: &Record) -> GreyboxError {
    let reason = "its motion can be followed on a servo axis whose current or amplifier is \
                  recorded, on no other machine";
    GreyboxError::Record { record: record.name.clone(), reason: reason.to_owned() }
}

/// Ticks of the controller for a sample of the recording.
fn ticks_per_sample(record: &Record, sample_hz: f64) -> Result<usize, GreyboxError> {
    let ratio = sample_hz / record.rate_hz;
    let whole = libm::round(ratio);
    if whole >= 1.0 && (ratio - whole).abs() < 1e-4 * whole {
        return Ok(whole as usize);
    }
    let (name, rate_hz) = (record.name.clone(), record.rate_hz);
    Err(GreyboxError::Rate { record: name, rate_hz, sample_hz })
}

fn recorded_load(record: &Record) -> Load {
    match &record.load {
        Some(values) => Load::Recorded { values_n_m: values.clone(), rate_hz: record.rate_hz },
        None => Load::None,
    }
}

fn refused(record: &Record) -> impl Fn(SimulationError) -> GreyboxError {
    |reason| GreyboxError::Simulation { record: record.name.clone(), reason }
}

fn every(values: &[f64], step: usize, samples: usize) -> Vec<f64> {
    values.iter().step_by(step).take(samples).copied().collect()
}

/// An actuator on the command of a recording, and its ticks for a sample.
fn actuator_test(
    model: &Model,
    effects: &[Effect],
    record: &Record,
) -> Result<(LowFidelity, usize), GreyboxError> {
    let actuator: &Actuator = &model.actuator;
    let ticks_per_sample = ticks_per_sample(record, actuator.controller.sample_hz)?;
    let shown = record.position.as_ref().map(|angle| angle[0]);
    let start_angle_rad = record.start_rad.or(shown).unwrap_or(0.0);
    let scenario = Scenario {
        command: Command::Recorded { values_rad: record.command.clone(), rate_hz: record.rate_hz },
        mode: match record.kind {
            CommandKind::Position => ControlMode::Position,
            CommandKind::Speed => ControlMode::Speed,
            CommandKind::Motion => return Err(not_followed(record)),
        },
        load_n_m: 0.0,
        duration_s: record.duration_s(),
        start_angle_rad,
        ..Scenario::chirp()
    };
    let simulation = LowFidelity::new(actuator, &scenario)
        .and_then(|model| model.with_effects(effects))
        .and_then(|model| model.with_load(recorded_load(record)))
        .map_err(refused(record))?;
    Ok((simulation, ticks_per_sample))
}

fn of_actuator(
    model: &Model,
    faults: &PhysicalFaults,
    effects: &[Effect],
    record: &Record,
) -> Result<ActuatorRun, GreyboxError> {
    let (simulation, ticks_per_sample) = actuator_test(model, effects, record)?;
    let trace = simulation.simulate(faults);
    let gear_ratio = model.actuator.transmission.gear_ratio;
    Ok(ActuatorRun { simulation, trace, ticks_per_sample, gear_ratio })
}

/// Where an axis is whose sensor, with the errors that it has, shows a position.
fn stands_at(shown: f64, effects: &[Effect]) -> f64 {
    let wave = |effect: &Effect, position: f64| match (effect.id(), effect.values()) {
        (EffectId::TransmissionError, &[a, b, order, ..]) => {
            let (sin, cos) = libm::sincos(order * position);
            a * sin + b * cos
        }
        (EffectId::PositionSensor, &[_, a, b, ..]) => {
            let (sin, cos) = libm::sincos(position);
            a * sin + b * cos
        }
        _ => 0.0,
    };
    let error = |position: f64| effects.iter().map(|effect| wave(effect, position)).sum::<f64>();
    // an error changes over turns that are long against itself
    (0..STAND_STEPS).fold(shown, |position, _| shown - error(position))
}

/// Steps to where a small error is accounted for.
const STAND_STEPS: usize = 4;

fn of_axis(
    model: &AxisModel,
    faults: &PhysicalFaults,
    effects: &[Effect],
    record: &Record,
) -> Result<AxisRun, GreyboxError> {
    let axis = &match record.kind {
        CommandKind::Motion if model.axis.drive == Drive::Winding => {
            return Err(not_followed(record));
        }
        CommandKind::Motion => {
            ServoAxis { controller: follower(&model.axis, record.rate_hz), ..model.axis }
        }
        _ => model.axis,
    };
    let ticks_per_sample = ticks_per_sample(record, axis.controller.sample_hz)?;
    let command = match record.kind {
        CommandKind::Motion => motion(&record.command, record.rate_hz),
        _ => Command::Recorded { values_rad: record.command.clone(), rate_hz: record.rate_hz },
    };
    let shown = record.position.as_ref().map_or(record.command[0], |position| position[0]);
    let scenario = AxisScenario {
        input: match record.kind {
            CommandKind::Position | CommandKind::Motion => AxisInput::Position(command),
            CommandKind::Speed => AxisInput::Speed(command),
        },
        load: 0.0,
        duration_s: record.duration_s(),
        start: AxisStart { position: stands_at(shown, effects), ..AxisStart::default() },
    };
    let simulation = ServoAxisSimulation::new(axis, &scenario)
        .and_then(|axis| axis.with_effects(effects))
        .and_then(|axis| axis.with_load(recorded_load(record)))
        .map_err(refused(record))?;
    let trace = simulation.simulate(faults);
    Ok(AxisRun { simulation, trace, ticks_per_sample, drive: axis.drive })
}

#[cfg(test)]
mod tests {
    use ema_sim::Geometry;

    use super::*;
    use crate::structure::Structure;

    #[test]
    fn a_wave_of_what_is_shown_holds_no_axis_off_a_command_that_has_not_begun() {
        let machine = Machine::bench_top();
        let nominal = Structure::nominal(&machine);
        let healthy: Vec<f64> = nominal.free.iter().map(|free| free.start).collect();
        let mut state = nominal.state(&machine, &healthy);
        let wave = Effect::new(EffectId::TransmissionError, Geometry::Rotary)
            .with("order", 24.0)
            .and_then(|wave| wave.with("error_cos_rad", 1e-3));
        state.add(&wave.expect("numbers of the effect"));
        let at_rest = Record {
            name: "proposed".to_owned(),
            rate_hz: 1000.0,
            command: vec![0.7; 1000],
            kind: CommandKind::Position,
            drive: vec![0.0; 1000],
            position: None,
            load: None,
            filter_hz: None,
            start_rad: None,
        };
        let drive = machine.simulate(&state, &at_rest, 0).expect("a machine at rest").drive;
        assert!(drive.iter().all(|ampere| ampere.abs() < 1e-6), "{:?}", drive.last());
    }
}
