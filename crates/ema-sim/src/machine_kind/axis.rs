//! Servo axes as a kind of machine.

use super::{
    CommandKind, DriveRun, DriveUnit, Electronics, LoopGains, MachineKind, MachineNumber,
    MachineRun, MachineSignals, MachineTest, MachineTestError, ModelFidelity, NumberTolerance,
    NumberValue, PreparedTest, USUAL_FRAC, USUAL_FRICTION_FRAC, add_tolerance,
    follow::{follower, motion},
    replay::{at_samples, at_ticks, rates},
    run::{BySteps, Departure, delayed, difference, every},
    static_friction,
};
use crate::{
    axis_parameter::AxisParameter,
    effect::{Effect, Geometry},
    fault::{FaultId, PhysicalFaults},
    model_file::{AxisModel, EffectBlock},
    scenario::Command,
    servo_axis::{AxisInput, AxisScenario, AxisStart, AxisTrace, ServoAxis, ServoAxisSimulation},
    servo_control::Drive,
};

/// Key of the constant in the balance of torques or forces, without its unit.
const OFFSET: &str = "axis.offset-";
/// Half-width of its tolerance over its value, where the file states none: it was found together with
/// friction, from recordings, and what the model lacks may have a part in it.
const OFFSET_FRAC: f64 = 1.0;

/// Numbers that scatter though a file states no tolerance, with the half-width over the value.
const USUAL: [(&str, f64); 7] = [
    ("axis.{inertia}", USUAL_FRAC),
    ("axis.viscous-{f}-s-per-{x}", USUAL_FRICTION_FRAC),
    ("axis.kinetic-friction-{f}", USUAL_FRICTION_FRAC),
    ("axis.static-friction-{f}", USUAL_FRICTION_FRAC),
    ("axis.backlash-{x}", USUAL_FRICTION_FRAC),
    ("drive.{force}-constant-{f}-per-{u}", USUAL_FRAC),
    ("drive.resistance-ohm", USUAL_FRAC),
];

impl MachineKind for AxisModel {
    fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    fn name_mut(&mut self) -> &mut Option<String> {
        &mut self.name
    }

    fn faults(&self) -> &[FaultId] {
        &self.faults
    }

    fn effects(&self) -> &[EffectBlock] {
        &self.effects
    }

    fn effects_mut(&mut self) -> &mut Vec<EffectBlock> {
        &mut self.effects
    }

    fn write(&self) -> String {
        Self::write(self)
    }

    fn geometry(&self) -> Geometry {
        self.axis.geometry
    }

    fn drive_unit(&self) -> DriveUnit {
        match self.axis.drive {
            Drive::Amplifier => DriveUnit::Volt,
            Drive::Current | Drive::Winding => DriveUnit::Ampere,
        }
    }

    fn controls_its_drive(&self) -> bool {
        self.axis.drive != Drive::Winding
    }

    fn torque_per_drive(&self) -> f64 {
        self.axis.force_constant
    }

    fn moved_inertia(&self) -> f64 {
        self.axis.inertia
    }

    fn pole_pairs(&self) -> Option<u32> {
        None
    }

    fn controller_hz(&self) -> f64 {
        self.axis.controller.sample_hz
    }

    fn loop_gains(&self) -> LoopGains {
        let controller = &self.axis.controller;
        LoopGains {
            position_per_s: controller.position_gain_per_s,
            speed: controller.speed_gain,
            speed_integral: controller.speed_integral,
        }
    }

    fn speed_limit(&self) -> Option<f64> {
        Some(self.axis.controller.speed_limit).filter(|limit| *limit < f64::MAX)
    }

    fn drive_limit(&self) -> f64 {
        self.axis.controller.output_limit
    }

    fn numbers(&self) -> Vec<MachineNumber> {
        let of = |parameter: &AxisParameter| {
            let (least, most) = parameter.bounds();
            let key = parameter.key(self.axis.geometry, self.axis.drive);
            MachineNumber { key, motion_term: parameter.motion_term(), least, most }
        };
        AxisParameter::ALL.iter().map(of).collect()
    }

    fn number(&self, place: usize) -> f64 {
        AxisParameter::ALL[place].get(&self.axis)
    }

    fn set_numbers(&mut self, values: &[NumberValue]) {
        let kinetic = self.axis.kinetic_friction;
        for NumberValue { place, value } in values {
            AxisParameter::ALL[*place].set(&mut self.axis, *value);
        }
        let new = &mut self.axis;
        new.static_friction = static_friction(new.static_friction, kinetic, new.kinetic_friction);
    }

    fn rough(&self) -> Vec<NumberTolerance> {
        let (geometry, drive) = (self.axis.geometry, self.axis.drive);
        let mut tolerances = Vec::new();
        let place =
            |key: &str| AxisParameter::ALL.iter().position(|p| p.key(geometry, drive) == key);
        for tolerance in self.tolerance.iter().filter(|t| t.level.is_of_machine()) {
            if let Some(place) = place(&tolerance.parameter.key(geometry, drive)) {
                let half_width_frac = tolerance.spread.half_width();
                add_tolerance(&mut tolerances, NumberTolerance { place, half_width_frac });
            }
        }
        let is_offset = |key: &str| key.starts_with(OFFSET);
        let is_stated = self.tolerance.iter().any(|t| is_offset(&t.parameter.key(geometry, drive)));
        let offset = AxisParameter::ALL.iter().position(|p| is_offset(&p.key(geometry, drive)));
        if self.axis.offset != 0.0 && !is_stated {
            let of = |place| NumberTolerance { place, half_width_frac: OFFSET_FRAC };
            tolerances.extend(offset.map(of));
        }
        tolerances.sort_by_key(|one| one.place);
        tolerances
    }

    fn usual_tolerances(&self) -> Vec<NumberTolerance> {
        let is_stated =
            |parameter| self.tolerance.iter().any(|tolerance| tolerance.parameter == parameter);
        let sticks = self.axis.static_friction > self.axis.kinetic_friction;
        let of = |(place, parameter): (usize, &'static AxisParameter)| {
            let (_, half_width_frac) =
                USUAL.iter().find(|(pattern, _)| parameter.has_pattern(pattern))?;
            let is_there = parameter.applies(self.axis.drive)
                && parameter.get(&self.axis) != 0.0
                && (sticks || !parameter.defaults_to_kinetic());
            let has_one = is_there && !is_stated(parameter);
            has_one.then_some(NumberTolerance { place, half_width_frac: *half_width_frac })
        };
        AxisParameter::ALL.iter().enumerate().filter_map(of).collect()
    }

    fn can_follow_motion(&self) -> bool {
        self.axis.drive != Drive::Winding
    }

    fn electronics(&self) -> &'static [ModelFidelity] {
        &[]
    }

    fn run_with_electronics(
        &self,
        _electronics: Electronics,
        _test: &MachineTest<'_>,
        _faults: &PhysicalFaults,
        _effects: &[Effect],
    ) -> Result<MachineSignals, MachineTestError> {
        Err(MachineTestError::NoElectronics)
    }

    fn run(
        &self,
        test: &MachineTest<'_>,
        faults: &PhysicalFaults,
        effects: &[Effect],
    ) -> Result<Box<dyn MachineRun>, MachineTestError> {
        let (simulation, ticks_per_sample) = simulation(self, test, effects)?;
        let (trace, samples) = (simulation.simulate(faults), test.command.len());
        let drive = self.axis.drive;
        Ok(Box::new(AxisRun { simulation, trace, ticks_per_sample, samples, drive }))
    }

    fn replayed(
        &self,
        test: &MachineTest<'_>,
        position: &[f64],
        effects: &[Effect],
    ) -> Result<Option<Vec<f64>>, MachineTestError> {
        let asks = match test.asks_for {
            CommandKind::Position => AxisInput::Position,
            CommandKind::Speed => AxisInput::Speed,
            CommandKind::Motion => return Ok(None),
        };
        if self.axis.drive == Drive::Winding || position.is_empty() {
            return Ok(None);
        }
        let tick_hz = self.axis.controller.sample_hz;
        let seen = at_ticks(position, test.rate_hz, tick_hz);
        let speed = rates(&seen, tick_hz);
        let values_rad = at_ticks(test.command, test.rate_hz, tick_hz);
        let scenario = AxisScenario {
            input: asks(Command::Recorded { values_rad, rate_hz: tick_hz }),
            load: 0.0,
            duration_s: seen.len() as f64 / tick_hz,
            start: AxisStart { position: seen[0], speed: speed[0], ..AxisStart::default() },
        };
        let simulation = ServoAxisSimulation::new(&self.axis, &scenario)?.with_effects(effects)?;
        let trace = AxisTrace { rate_hz: tick_hz, position: seen, speed, ..AxisTrace::default() };
        let output = simulation.replayed_output(&trace);
        // a current is seen a tick after it was asked for
        let shown = if self.axis.drive == Drive::Amplifier { output } else { delayed(output) };
        Ok(Some(at_samples(&shown, tick_hz, test.rate_hz, position.len())))
    }

    /// Nothing: an axis has no test that costs more than its run.
    fn prepare(&self, _: &MachineTest<'_>) -> PreparedTest {
        PreparedTest::default()
    }

    fn drive(
        &self,
        test: &MachineTest<'_>,
        _: &PreparedTest,
        faults: &PhysicalFaults,
        effects: &[Effect],
    ) -> Result<Vec<f64>, MachineTestError> {
        Ok(self.run(test, faults, effects)?.signals().drive)
    }

    fn drives(&self, runs: &[DriveRun<'_>]) -> Vec<Result<Vec<f64>, MachineTestError>> {
        let mut drives: Vec<Result<Vec<f64>, MachineTestError>> = Vec::new();
        let mut by_step: BySteps<ServoAxisSimulation> = BySteps::new();
        for (place, run) in runs.iter().enumerate() {
            let mut model = self.clone();
            model.set_numbers(run.numbers);
            match simulation(&model, run.test, run.effects) {
                Ok((simulation, step)) => {
                    by_step.entry(step).or_default().push((place, simulation));
                    drives.push(Ok(Vec::new()));
                }
                Err(refused) => drives.push(Err(refused)),
            }
        }
        for (step, simulations) in by_step {
            let tests: Vec<(&ServoAxisSimulation, &PhysicalFaults)> =
                simulations.iter().map(|(place, of)| (of, runs[*place].faults)).collect();
            let signals = ServoAxisSimulation::drives_every(step, &tests);
            for ((place, _), signal) in simulations.iter().zip(signals) {
                drives[*place] = Ok(every(&signal, 1, runs[*place].test.command.len()));
            }
        }
        drives
    }
}

/// An axis in a test, under the controller that it has or one that follows the motion; with the
/// ticks in a sample.
fn simulation(
    model: &AxisModel,
    test: &MachineTest<'_>,
    effects: &[Effect],
) -> Result<(ServoAxisSimulation, usize), MachineTestError> {
    let is_followed = test.asks_for == CommandKind::Motion;
    if is_followed && !model.can_follow_motion() {
        return Err(MachineTestError::Motion);
    }
    let axis = if is_followed {
        ServoAxis { controller: follower(&model.axis, test.rate_hz), ..model.axis }
    } else {
        model.axis
    };
    let ticks_per_sample = test.ticks_per_sample(axis.controller.sample_hz)?;
    let simulation = ServoAxisSimulation::new(&axis, &scenario(test, effects))?
        .with_effects(effects)?
        .with_load(test.recorded_load())?;
    Ok((simulation, ticks_per_sample))
}

/// The scenario of a test, begun where the first sample shows the axis.
fn scenario(test: &MachineTest<'_>, effects: &[Effect]) -> AxisScenario {
    let recorded =
        || Command::Recorded { values_rad: test.command.to_vec(), rate_hz: test.rate_hz };
    let shown = test.shown_start.unwrap_or(test.command[0]);
    AxisScenario {
        input: match test.asks_for {
            CommandKind::Position => AxisInput::Position(recorded()),
            CommandKind::Motion => AxisInput::Position(motion(test.command, test.rate_hz)),
            CommandKind::Speed => AxisInput::Speed(recorded()),
        },
        load: 0.0,
        duration_s: test.duration_s(),
        start: AxisStart { position: stands_at(shown, effects), ..AxisStart::default() },
    }
}

/// Where an axis is whose sensor, with the errors that it has, shows a position.
fn stands_at(shown: f64, effects: &[Effect]) -> f64 {
    let error = |position: f64| {
        let errors = effects.iter().map(|effect| effect.error_of_position(position));
        errors.sum::<f64>()
    };
    // an error changes over turns that are long against itself
    (0..STAND_STEPS).fold(shown, |position, _| shown - error(position))
}

/// Steps to where a small error is accounted for.
const STAND_STEPS: usize = 4;

/// A servo axis in a test, with all that it did.
struct AxisRun {
    simulation: ServoAxisSimulation,
    trace: AxisTrace,
    ticks_per_sample: usize,
    samples: usize,
    drive: Drive,
}

impl AxisRun {
    fn shown(&self) -> &[f64] {
        match self.drive {
            Drive::Amplifier => &self.trace.output,
            Drive::Current | Drive::Winding => &self.trace.current,
        }
    }
}

impl MachineRun for AxisRun {
    fn signals(&self) -> MachineSignals {
        let (step, samples) = (self.ticks_per_sample, self.samples);
        MachineSignals {
            drive: every(self.shown(), step, samples),
            motor: every(&self.trace.position, step, samples),
            speed: every(&self.trace.speed, step, samples),
            surface: every(&self.trace.position, step, samples),
        }
    }

    fn replayed_drive_change(&self, position: &[f64]) -> Vec<f64> {
        let (step, samples) = (self.ticks_per_sample, self.samples);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::EffectId;
    use approx::assert_abs_diff_eq;

    #[test]
    fn an_axis_stands_where_its_errors_show_the_position() {
        let rotary = |id, sizes: &[(&str, f64)]| {
            let plain = Effect::new(id, Geometry::Rotary);
            sizes.iter().fold(plain, |effect, &(key, value)| effect.with(key, value).unwrap())
        };
        let sensor = [("eccentricity_sin_rad", 2e-3), ("eccentricity_cos_rad", -1e-3)];
        let effects = [
            rotary(EffectId::PositionSensor, &sensor),
            rotary(EffectId::TransmissionError, &[("error_sin_rad", 1e-3), ("order", 3.0)]),
            rotary(EffectId::Cogging, &[("cogging_sin_n_m", 0.1)]),
        ];
        for shown in [-1.3, 0.0, 0.7] {
            let position = stands_at(shown, &effects);
            let error =
                2e-3 * position.sin() - 1e-3 * position.cos() + 1e-3 * (3.0 * position).sin();
            // each step leaves at most the slope of the error, 6e-3, of what was left: 6e-3^4·4e-3
            assert_abs_diff_eq!(position + error, shown, epsilon = 1e-11);
            assert!(position != shown);
        }
        assert_eq!(stands_at(0.7, &effects[2..]), 0.7);
    }
}
