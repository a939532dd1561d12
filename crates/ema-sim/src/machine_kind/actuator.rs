//! Actuators with three phases as a kind of machine.

use super::{
    CommandKind, DriveRun, DriveUnit, Electronics, LoopGains, MachineKind, MachineNumber,
    MachineRun, MachineSignals, MachineTest, MachineTestError, ModelFidelity, NumberTolerance,
    NumberValue, PreparedTest, USUAL_FRAC, USUAL_FRICTION_FRAC, add_tolerance,
    run::{BySteps, Departure, delayed, difference, every},
    static_friction,
};
use crate::{
    effect::{Effect, Geometry},
    envelope::EnvelopeFilter,
    fault::{FaultId, PhysicalFaults},
    high_fidelity::HighFidelity,
    low_fidelity::LowFidelity,
    model_file::{self, EffectBlock, Model},
    parameter::Parameter,
    scenario::{Command, ControlMode, Scenario},
    tolerance::UncertainNumber,
    trace::LowFidelityTrace,
};

/// Numbers that scatter though a file states no tolerance, with the half-width over the value.
const USUAL: [(Parameter, f64); 12] = [
    (Parameter::RESISTANCE, USUAL_FRAC),
    (Parameter::INDUCTANCE, USUAL_FRAC),
    (Parameter::BACK_EMF, USUAL_FRAC),
    (Parameter::MOTOR_INERTIA, USUAL_FRAC),
    (Parameter::VISCOUS, USUAL_FRICTION_FRAC),
    (Parameter::BUS_VOLTAGE, USUAL_FRAC),
    (Parameter::SURFACE_INERTIA, USUAL_FRAC),
    (Parameter::BACKLASH, USUAL_FRICTION_FRAC),
    (Parameter::KINETIC_FRICTION, USUAL_FRICTION_FRAC),
    (Parameter::STATIC_FRICTION, USUAL_FRICTION_FRAC),
    (Parameter::SURFACE_FRICTION, USUAL_FRICTION_FRAC),
    (Parameter::EFFICIENCY, USUAL_FRAC),
];

impl MachineKind for Model {
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
        model_file::write(self)
    }

    fn geometry(&self) -> Geometry {
        Geometry::Rotary
    }

    fn drive_unit(&self) -> DriveUnit {
        DriveUnit::Ampere
    }

    fn controls_its_drive(&self) -> bool {
        true
    }

    fn torque_per_drive(&self) -> f64 {
        // two phases conduct
        2.0 * self.actuator.motor.back_emf_v_s_per_rad
    }

    fn moved_inertia(&self) -> f64 {
        self.actuator.total_inertia_kg_m2()
    }

    fn pole_pairs(&self) -> Option<u32> {
        Some(self.actuator.motor.pole_pairs)
    }

    fn controller_hz(&self) -> f64 {
        self.actuator.controller.sample_hz
    }

    fn loop_gains(&self) -> LoopGains {
        let controller = &self.actuator.controller;
        LoopGains {
            position_per_s: controller.position_gain_per_s,
            speed: controller.speed_gain_a_s_per_rad,
            speed_integral: controller.speed_integral_a_per_rad,
        }
    }

    fn speed_limit(&self) -> Option<f64> {
        let limit_rad_per_s = self.actuator.controller.speed_limit_rad_per_s;
        Some(limit_rad_per_s / self.actuator.transmission.gear_ratio)
    }

    fn drive_limit(&self) -> f64 {
        self.actuator.controller.current_limit_a
    }

    fn numbers(&self) -> Vec<MachineNumber> {
        let of = |parameter: &Parameter| {
            let (least, most) = parameter.bounds();
            let key = parameter.key().to_owned();
            MachineNumber { key, motion_term: parameter.motion_term(), least, most }
        };
        Parameter::ALL.iter().map(of).collect()
    }

    fn number(&self, place: usize) -> f64 {
        Parameter::ALL[place].get(&self.actuator)
    }

    fn set_numbers(&mut self, values: &[NumberValue]) {
        let kinetic = self.actuator.transmission.kinetic_friction_n_m;
        for NumberValue { place, value } in values {
            Parameter::ALL[*place].set(&mut self.actuator, *value);
        }
        let new = &mut self.actuator.transmission;
        new.static_friction_n_m =
            static_friction(new.static_friction_n_m, kinetic, new.kinetic_friction_n_m);
    }

    fn rough(&self) -> Vec<NumberTolerance> {
        let place = |key| Parameter::ALL.iter().position(|parameter| parameter.key() == key);
        let mut tolerances = Vec::new();
        for tolerance in self.tolerance.iter().filter(|t| t.level.is_of_machine()) {
            if let UncertainNumber::Parameter(parameter) = tolerance.number
                && let Some(place) = place(parameter.key())
            {
                let half_width_frac = tolerance.spread.half_width();
                add_tolerance(&mut tolerances, NumberTolerance { place, half_width_frac });
            }
        }
        tolerances
    }

    fn usual_tolerances(&self) -> Vec<NumberTolerance> {
        let is_stated = |parameter: &Parameter| {
            self.tolerance.iter().any(|tolerance| tolerance.key() == parameter.key())
        };
        let gear = &self.actuator.transmission;
        let sticks = gear.static_friction_n_m > gear.kinetic_friction_n_m;
        let of = |(place, parameter): (usize, &Parameter)| {
            let (_, half_width_frac) = USUAL.iter().find(|(usual, _)| usual == parameter)?;
            let is_there = parameter.get(&self.actuator) != 0.0
                && (sticks || *parameter != Parameter::STATIC_FRICTION);
            let has_one = is_there && !is_stated(parameter);
            has_one.then_some(NumberTolerance { place, half_width_frac: *half_width_frac })
        };
        Parameter::ALL.iter().enumerate().filter_map(of).collect()
    }

    fn can_follow_motion(&self) -> bool {
        false
    }

    fn run(
        &self,
        test: &MachineTest<'_>,
        faults: &PhysicalFaults,
        effects: &[Effect],
    ) -> Result<Box<dyn MachineRun>, MachineTestError> {
        let ticks_per_sample = test.ticks_per_sample(self.actuator.controller.sample_hz)?;
        let simulation = ideal(self, effects, test)?;
        let trace = simulation.simulate(faults);
        Ok(Box::new(ActuatorRun {
            trace,
            simulation,
            ticks_per_sample,
            samples: test.command.len(),
            gear_ratio: self.actuator.transmission.gear_ratio,
            filter: filter(test),
        }))
    }

    fn electronics(&self) -> &'static [ModelFidelity] {
        &[ModelFidelity::Low, ModelFidelity::High]
    }

    fn replayed(
        &self,
        _test: &MachineTest<'_>,
        _position: &[f64],
        _effects: &[Effect],
    ) -> Result<Option<Vec<f64>>, MachineTestError> {
        Ok(None)
    }

    fn run_with_electronics(
        &self,
        electronics: Electronics,
        test: &MachineTest<'_>,
        faults: &PhysicalFaults,
        effects: &[Effect],
    ) -> Result<MachineSignals, MachineTestError> {
        let step = test.ticks_per_sample(self.actuator.controller.sample_hz)?;
        let scenario = scenario(test)?.with_real_electronics(electronics.noise_seed);
        let shown = Shown { step, samples: test.command.len(), filter: filter(test) };
        Ok(match electronics.fidelity {
            ModelFidelity::Low => {
                let trace = low_fidelity(self, effects, test, &scenario)?.try_simulate(faults)?;
                shown.signals(&AtTicks::from(&trace))
            }
            ModelFidelity::High => {
                let model = HighFidelity::new(&self.actuator, &scenario)?.with_effects(effects)?;
                let trace = model.with_load(test.recorded_load())?.try_simulate(faults)?;
                let envelope = self.actuator.inverter.commutation.envelope();
                shown.signals(&AtTicks {
                    rate_hz: trace.rate_hz,
                    current_a: &trace.envelope_a(envelope, self.actuator.motor.pole_pairs),
                    motor_angle_rad: &trace.motor_angle_rad,
                    motor_speed_rad_per_s: &trace.motor_speed_rad_per_s,
                    surface_angle_rad: &trace.surface_angle_rad,
                })
            }
        })
    }

    fn prepare(&self, test: &MachineTest<'_>) -> PreparedTest {
        let is_run = test.ticks_per_sample(self.actuator.controller.sample_hz).is_ok();
        PreparedTest { low_fidelity: is_run.then(|| ideal(self, &[], test).ok()).flatten() }
    }

    fn drive(
        &self,
        test: &MachineTest<'_>,
        prepared: &PreparedTest,
        faults: &PhysicalFaults,
        effects: &[Effect],
    ) -> Result<Vec<f64>, MachineTestError> {
        let simulation = ready(self, test, prepared, effects)?;
        let sample_hz = self.actuator.controller.sample_hz;
        let step = test.ticks_per_sample(sample_hz)?;
        let mut current_a = Vec::new();
        simulation.simulate_current(faults, &mut current_a);
        Ok(shown(&current_a, sample_hz, step, test.command.len(), filter(test)))
    }

    fn drives(&self, runs: &[DriveRun<'_>]) -> Vec<Result<Vec<f64>, MachineTestError>> {
        let mut drives: Vec<Result<Vec<f64>, MachineTestError>> = Vec::new();
        let mut by_step: BySteps<LowFidelity> = BySteps::new();
        for (place, run) in runs.iter().enumerate() {
            let mut model = self.clone();
            model.set_numbers(run.numbers);
            let step = run.test.ticks_per_sample(model.actuator.controller.sample_hz);
            let simulation = ready(&model, run.test, run.prepared, run.effects);
            match step.and_then(|step| Ok((step, simulation?))) {
                Ok((step, simulation)) => {
                    // a filter sees every tick
                    let step = if filter(run.test).is_some() { 1 } else { step };
                    by_step.entry(step).or_default().push((place, simulation));
                    drives.push(Ok(Vec::new()));
                }
                Err(refused) => drives.push(Err(refused)),
            }
        }
        for (step, simulations) in by_step {
            let tests: Vec<(&LowFidelity, &PhysicalFaults)> =
                simulations.iter().map(|(place, of)| (of, runs[*place].faults)).collect();
            let currents_a = LowFidelity::currents_every(step, &tests);
            for ((place, simulation), current_a) in simulations.iter().zip(currents_a) {
                let DriveRun { test, .. } = runs[*place];
                // strided already, but for a filter
                let (rate_hz, samples) = (simulation.rate_hz(), test.command.len());
                drives[*place] = Ok(shown(&current_a, rate_hz, 1, samples, filter(test)));
            }
        }
        drives
    }
}

/// A test that was prepared, with effects.
fn ready(
    model: &Model,
    test: &MachineTest<'_>,
    prepared: &PreparedTest,
    effects: &[Effect],
) -> Result<LowFidelity, MachineTestError> {
    match &prepared.low_fidelity {
        Some(ready) => Ok(ready.on_actuator(&model.actuator)?.with_effects(effects)?),
        None => ideal(model, effects, test),
    }
}

/// Filter behind the current of a test.
fn filter(test: &MachineTest<'_>) -> Option<EnvelopeFilter> {
    test.filter_hz.map(|corner_hz| EnvelopeFilter { corner_hz, output_hz: test.rate_hz })
}

/// The drive signal at the rate of a test, given the current at each tick of the controller.
fn shown(
    current_a: &[f64],
    rate_hz: f64,
    step: usize,
    samples: usize,
    filter: Option<EnvelopeFilter>,
) -> Vec<f64> {
    match filter {
        Some(filter) => filter.apply(current_a, rate_hz),
        None => every(current_a, step, samples),
    }
}

/// Signals of an actuator at each tick of its controller.
struct AtTicks<'a> {
    rate_hz: f64,
    current_a: &'a [f64],
    motor_angle_rad: &'a [f64],
    motor_speed_rad_per_s: &'a [f64],
    surface_angle_rad: &'a [f64],
}

impl<'a> From<&'a LowFidelityTrace> for AtTicks<'a> {
    fn from(trace: &'a LowFidelityTrace) -> Self {
        Self {
            rate_hz: trace.rate_hz,
            current_a: &trace.current_a,
            motor_angle_rad: &trace.motor_angle_rad,
            motor_speed_rad_per_s: &trace.motor_speed_rad_per_s,
            surface_angle_rad: &trace.surface_angle_rad,
        }
    }
}

/// Samples of a test among the ticks of a controller, and the filter behind the current.
struct Shown {
    step: usize,
    samples: usize,
    filter: Option<EnvelopeFilter>,
}

impl Shown {
    /// The signals at the rate of the test.
    fn signals(&self, at: &AtTicks<'_>) -> MachineSignals {
        let &Self { step, samples, filter } = self;
        MachineSignals {
            drive: shown(at.current_a, at.rate_hz, step, samples, filter),
            motor: every(at.motor_angle_rad, step, samples),
            speed: every(at.motor_speed_rad_per_s, step, samples),
            surface: every(at.surface_angle_rad, step, samples),
        }
    }
}

/// The scenario of a test, with ideal electronics.
fn scenario(test: &MachineTest<'_>) -> Result<Scenario, MachineTestError> {
    Ok(Scenario {
        command: Command::Recorded { values_rad: test.command.to_vec(), rate_hz: test.rate_hz },
        mode: match test.asks_for {
            CommandKind::Position => ControlMode::Position,
            CommandKind::Speed => ControlMode::Speed,
            CommandKind::Motion => return Err(MachineTestError::Motion),
        },
        load_n_m: 0.0,
        duration_s: test.duration_s(),
        start_angle_rad: test.start_rad.or(test.shown_start).unwrap_or(0.0),
        ..Scenario::chirp()
    })
}

/// An actuator on the command of a test, with ideal electronics.
fn ideal(
    model: &Model,
    effects: &[Effect],
    test: &MachineTest<'_>,
) -> Result<LowFidelity, MachineTestError> {
    low_fidelity(model, effects, test, &scenario(test)?)
}

/// An actuator in the scenario of a test.
fn low_fidelity(
    model: &Model,
    effects: &[Effect],
    test: &MachineTest<'_>,
    scenario: &Scenario,
) -> Result<LowFidelity, MachineTestError> {
    let simulation = LowFidelity::new(&model.actuator, scenario)?.with_effects(effects)?;
    Ok(simulation.with_load(test.recorded_load())?)
}

/// An actuator in a test, with all that it did.
struct ActuatorRun {
    simulation: LowFidelity,
    trace: LowFidelityTrace,
    ticks_per_sample: usize,
    samples: usize,
    gear_ratio: f64,
    filter: Option<EnvelopeFilter>,
}

impl MachineRun for ActuatorRun {
    fn signals(&self) -> MachineSignals {
        let (step, samples, filter) = (self.ticks_per_sample, self.samples, self.filter);
        Shown { step, samples, filter }.signals(&AtTicks::from(&self.trace))
    }

    fn replayed_drive_change(&self, position: &[f64]) -> Vec<f64> {
        let (step, samples) = (self.ticks_per_sample, self.samples);
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
