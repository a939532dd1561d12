//! A servo axis, rotary or linear: any machine with one moving mass, dry friction, backlash and
//! a cascade.

use std::sync::Arc;

use crate::{
    axis_parameter::AxisParameter,
    drive_train::{DriveTrain, Parts},
    effect::{
        Effect, Geometry,
        capabilities::{AdmissibleSize, Commutated, ModelCapabilities, SizingData, WindingModel},
        part::MachineNumbers,
        rescaling::Rescaling,
    },
    ended::Ended,
    extension::rescaling,
    fault::{FaultId, PhysicalFaults},
    load::Load,
    parameter::{Keyed, kinetic_within_static},
    parameter_error::ParameterError,
    params::least_inertia,
    plant::{Additions, Group, Kept, Member, Run},
    runaway::Runaway,
    scenario::{Command, MOST_TICKS},
    servo_control::{Asked, AxisCascade, AxisController, AxisLane, Drive, Feedback},
    simulation_error::SimulationError,
    speed_guard::SpeedGuard,
};

/// A servo axis. What is an angle in a rotary axis is a length in a linear one, a torque a force,
/// an inertia a mass.
///
/// ```text
/// M·v' = k·u − F_c·sgn v − F_v·v − offset − load
/// ```
///
/// # Source
///
/// Structure and four-parameter friction: Janot, Gautier, Brunot, "Data Set and Reference Models
/// of EMPS", 2019 Workshop on Nonlinear System Identification Benchmarks; see
/// `docs/models/servo-axis.md`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoAxis {
    /// Geometry of the axis: the units of everything below.
    pub geometry: Geometry,
    /// Moving inertia, kg·m², or mass, kg.
    pub inertia: f64,
    /// Viscous drag, N·m·s/rad or N·s/m.
    pub viscous: f64,
    /// Kinetic dry friction, N·m or N.
    pub kinetic_friction: f64,
    /// Static dry friction, N·m or N.
    pub static_friction: f64,
    /// Torque or force against positive motion, whichever way the axis moves.
    pub offset: f64,
    /// Whole play between motor and load, rad or m.
    pub backlash: f64,
    /// Stage between the controller's output and the motor.
    pub drive: Drive,
    /// Torque or force over the output; for [`Drive::Winding`] over the current, and back-EMF.
    pub force_constant: f64,
    /// Resistance of the winding; for [`Drive::Winding`] alone.
    pub resistance_ohm: f64,
    /// The cascade.
    pub controller: AxisController,
}

impl ServoAxis {
    /// Torque or force of the motor at the controller's limit, at rest.
    fn peak_force(&self) -> f64 {
        self.at_rest(self.force_constant * self.controller.output_limit)
    }

    /// A multiple of the controller's output at rest, through the resistance where it is a voltage
    /// on a winding.
    fn at_rest(&self, of_output: f64) -> f64 {
        if self.drive == Drive::Winding { of_output / self.resistance_ohm } else { of_output }
    }

    /// The facts by which effects are taken or refused.
    fn capabilities(&self) -> ModelCapabilities {
        let c = &self.controller;
        let sizing = SizingData {
            peak_torque: self.peak_force(),
            inertia: self.inertia,
            gear_ratio: 1.0,
            tick_s: 1.0 / c.sample_hz,
            stop_rad: None,
            supply_v: c.output_limit,
            output: self.at_rest(c.output_limit),
        };
        ModelCapabilities {
            name: "the servo axis",
            geometry: self.geometry,
            commutated: Commutated::Not,
            winding: match self.drive {
                Drive::Current | Drive::Amplifier => WindingModel::Regulated,
                Drive::Winding => WindingModel::Quasistatic,
            },
            encoder_on_motor: false,
            surface_rubs: false,
            undivided_inertia: Some(self.inertia),
            gains: [
                c.position_gain_per_s.max(c.position_integral_per_s2),
                c.speed_gain,
                c.speed_integral,
            ],
            dry_friction: self.static_friction > 0.0,
            rubbing_effect: false,
            current_recorded: self.drive != Drive::Amplifier,
            admissible: AdmissibleSize::new(&sizing),
        }
    }

    /// The axis with some of its constants scaled by effects.
    fn rescaled(mut self, by: &Rescaling) -> Self {
        self.force_constant *= by.torque_constant_ratio;
        let c = &mut self.controller;
        c.position_gain_per_s *= by.position_gain_ratio;
        c.position_integral_per_s2 *= by.position_gain_ratio;
        c.speed_gain *= by.speed_gain_ratio;
        c.speed_integral *= by.speed_integral_ratio;
        c.output_limit *= by.output_limit_ratio;
        self
    }

    /// Refuses numbers that no axis has.
    ///
    /// # Errors
    ///
    /// [`ParameterError`] naming the first field that is not finite or out of its bounds.
    pub fn check(&self) -> Result<(), ParameterError> {
        for parameter in AxisParameter::ALL {
            if parameter.applies(self.drive) {
                parameter.check(self)?;
            }
        }
        let kinetic = &self.key_of("axis.kinetic-friction-{f}");
        let fixed = &self.key_of("axis.static-friction-{f}");
        kinetic_within_static(
            Keyed { key: kinetic, value: self.kinetic_friction },
            Keyed { key: fixed, value: self.static_friction },
        )?;
        if self.controller.speed_samples > 1000 {
            let (field, value) = ("controller.speed-samples", self.controller.speed_samples);
            let (value, least, most) = (f64::from(value), 0.0, 1000.0);
            return Err(ParameterError::OutOfBounds { field, value, least, most });
        }
        self.check_pace()
    }

    /// Refuses an axis that its drag slows within a tick.
    fn check_pace(&self) -> Result<(), ParameterError> {
        let braking = match self.drive {
            Drive::Winding => self.force_constant * self.force_constant / self.resistance_ohm,
            Drive::Current | Drive::Amplifier => 0.0,
        };
        let tick_s = 1.0 / self.controller.sample_hz;
        let (value, least) = (self.inertia, least_inertia(self.viscous + braking, tick_s));
        if value < least {
            let field = self.key_of("axis.{inertia}");
            return Err(ParameterError::TooLight { field, value, least, tick_s });
        }
        Ok(())
    }

    /// Refuses a fault that changes nothing in this axis.
    ///
    /// # Errors
    ///
    /// [`ParameterError::NoSuchFault`] for `k1` without dry friction, `k2` without backlash, and
    /// those of phases and air gap.
    ///
    /// # Examples
    ///
    /// ```
    /// # use ema_sim::{model_file::{MachineModel, parse_machine}, FaultId};
    /// # let text = include_str!("../../../fixtures/models/emps.toml");
    /// # let MachineModel::ServoAxis(model) = parse_machine(text)? else { panic!() };
    /// let emps = model.axis;
    /// assert!(emps.check_fault(FaultId::Friction).is_ok());
    /// let error = emps.check_fault(FaultId::Backlash).unwrap_err();
    /// assert_eq!(error.to_string(), "k2 changes nothing in this axis: it has no backlash");
    /// # Ok::<_, ema_sim::model_file::ModelFileError>(())
    /// ```
    pub fn check_fault(&self, fault: FaultId) -> Result<(), ParameterError> {
        let reason = match fault {
            FaultId::Friction if self.static_friction > 0.0 => return Ok(()),
            FaultId::Friction => "it has no dry friction",
            FaultId::Backlash if self.backlash > 0.0 => return Ok(()),
            FaultId::Backlash => "it has no backlash",
            _ => "it has no phases and no air gap",
        };
        Err(ParameterError::NoSuchFault { fault, reason })
    }

    /// The key of the parameter with a pattern.
    fn key_of(&self, pattern: &str) -> String {
        AxisParameter::of_pattern(pattern)
            .map_or_else(String::new, |p| p.key(self.geometry, self.drive))
    }

    /// The gain that an input needs and that is zero, with what is given.
    fn unregulated(&self, input: &AxisInput) -> Option<SimulationError> {
        let law = &self.controller;
        let gains =
            [law.position_gain_per_s, law.position_integral_per_s2, law.position_derivative_ratio];
        let position = gains.iter().any(|gain| *gain > 0.0);
        let speed = law.speed_gain > 0.0 || law.speed_integral > 0.0;
        let (given, pattern) = match input {
            AxisInput::Position(_) if !position => ("position", "controller.position-gain-per-s"),
            AxisInput::Position(_) if !speed => ("position", "controller.speed-gain-{u}-s-per-{x}"),
            AxisInput::Speed(_) if !speed => ("speed", "controller.speed-gain-{u}-s-per-{x}"),
            _ => return None,
        };
        Some(SimulationError::Unregulated { given, field: self.key_of(pattern) })
    }
}

/// Input of an axis.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum AxisInput {
    /// A position to follow, in the axis' unit: rad, or m in place of rad.
    Position(Command),
    /// A speed to hold, rad/s or m/s in place of rad.
    Speed(Command),
    /// The controller's output itself, A or V, held over each tick: the machine without its
    /// controller. [`ServoAxisSimulation::with_replayed_output`] takes it from a recording.
    Output(Command),
}

/// State of an axis at the start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisStart {
    /// Position of the motor.
    pub position: f64,
    /// Speed of the motor.
    pub speed: f64,
    /// Integral part of the controller's output.
    pub output: f64,
    /// Place of the load in the backlash, −1 to 1 (1: the upper side touches).
    pub backlash_side_ratio: f64,
}

/// A test of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisScenario {
    /// Input given.
    pub input: AxisInput,
    /// Load against positive motion.
    pub load: f64,
    /// Length.
    pub duration_s: f64,
    /// State at the start.
    pub start: AxisStart,
}

/// Signals of an axis, sampled at each tick; the output is what the controller makes of that
/// very sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AxisTrace {
    /// Rate of all channels.
    pub rate_hz: f64,
    /// Input at each tick.
    pub command: Vec<f64>,
    /// Position as its sensor shows it.
    pub position: Vec<f64>,
    /// Speed.
    pub speed: Vec<f64>,
    /// The controller's output, A or V.
    pub output: Vec<f64>,
    /// Current, as its sensor shows it, before the controller acts; of [`Drive::Amplifier`] the
    /// output that acted before.
    pub current: Vec<f64>,
    /// Torque or force of the motor before the controller acts.
    pub force: Vec<f64>,
    /// Cost of the run: segments between events.
    pub segments: u64,
    /// Why the run ended before its test, where it did; its channels are NaN from there on.
    pub runaway: Option<Runaway>,
}

impl Ended for AxisTrace {
    fn runaway(&self) -> Option<&Runaway> {
        self.runaway.as_ref()
    }

    fn channels(&mut self) -> Vec<&mut Vec<f64>> {
        let Self { command, position, speed, output, current, force, .. } = self;
        vec![command, position, speed, output, current, force]
    }
}

/// An axis in one test.
///
/// # Examples
///
/// ```
/// use ema_sim::{
///     AxisController, AxisInput, AxisScenario, AxisStart, Command, Drive, Feedback, Geometry,
///     HealthState, ServoAxis, ServoAxisSimulation,
/// };
///
/// let axis = ServoAxis {
///     geometry: Geometry::Rotary,
///     inertia: 1e-3,
///     viscous: 1e-3,
///     kinetic_friction: 0.02,
///     static_friction: 0.03,
///     offset: 0.0,
///     backlash: 0.0,
///     drive: Drive::Current,
///     force_constant: 0.1,
///     resistance_ohm: 1.0,
///     controller: AxisController {
///         sample_hz: 1e3,
///         position_gain_per_s: 20.0,
///         position_integral_per_s2: 0.0,
///         position_derivative_ratio: 0.0,
///         speed_limit: 50.0,
///         speed_gain: 1.0,
///         speed_integral: 20.0,
///         output_limit: 5.0,
///         speed_samples: 0,
///         encoder_step: 0.0,
///         feedback: Feedback::Motor,
///     },
/// };
/// let command = Command::Sine { amplitude_rad: 1.0, frequency_hz: 0.5 };
/// let scenario = AxisScenario {
///     input: AxisInput::Position(command),
///     load: 0.0,
///     duration_s: 2.0,
///     start: AxisStart::default(),
/// };
/// let simulation = ServoAxisSimulation::new(&axis, &scenario)?;
/// let trace = simulation.simulate(&(&HealthState::HEALTHY).into());
/// assert_eq!(trace.position.len(), 2000);
/// # Ok::<_, ema_sim::SimulationError>(())
/// ```
#[derive(Clone, Debug)]
pub struct ServoAxisSimulation {
    axis: ServoAxis,
    scenario: AxisScenario,
    command: Vec<f64>,
    effects: Vec<Effect>,
    load: Arc<Load>,
    finer: f64,
}

impl ServoAxisSimulation {
    /// Prepares a test.
    ///
    /// # Errors
    ///
    /// [`SimulationError`] for an axis or a test that cannot be simulated.
    pub fn new(axis: &ServoAxis, scenario: &AxisScenario) -> Result<Self, SimulationError> {
        axis.check()?;
        let bounded = |field, value: f64, least, most| {
            if value >= least && value <= most {
                Ok(())
            } else {
                Err(SimulationError::Scenario { field, value, least, most })
            }
        };
        let start = &scenario.start;
        let tick_s = 1.0 / axis.controller.sample_hz;
        bounded("scenario.load", scenario.load, -1e9, 1e9)?;
        let longest_s = (MOST_TICKS * tick_s).min(1e5);
        bounded("scenario.duration-s", scenario.duration_s, tick_s, longest_s)?;
        bounded("scenario.position", start.position, -1e9, 1e9)?;
        bounded("scenario.speed", start.speed, -1e6, 1e6)?;
        bounded("scenario.output", start.output, -1e9, 1e9)?;
        bounded("scenario.backlash-side-ratio", start.backlash_side_ratio, -1.0, 1.0)?;
        let (AxisInput::Position(command) | AxisInput::Speed(command) | AxisInput::Output(command)) =
            &scenario.input;
        command.check()?;
        if let Some(error) = axis.unregulated(&scenario.input) {
            return Err(error);
        }
        let ticks = libm::round(scenario.duration_s / tick_s) as usize;
        let command: Vec<f64> = (0..ticks).map(|tick| command.at(tick as f64 * tick_s)).collect();
        for value in &command {
            bounded("command.values", *value, -1e9, 1e9)?;
        }
        Ok(Self {
            axis: *axis,
            scenario: scenario.clone(),
            command,
            effects: Vec::new(),
            load: Arc::new(Load::None),
            finer: 1.0,
        })
    }

    /// The machine without its controller: an output for every tick, from a recording.
    ///
    /// # Errors
    ///
    /// [`SimulationError::Scenario`] where an output is not finite.
    pub fn with_replayed_output(mut self, output: &[f64]) -> Result<Self, SimulationError> {
        if let Some(value) = output.iter().find(|u| !u.is_finite()) {
            let (field, value, least, most) = ("output", *value, f64::MIN, f64::MAX);
            return Err(SimulationError::Scenario { field, value, least, most });
        }
        self.command = output.to_vec();
        self.scenario.input = AxisInput::Output(Command::Steps(Vec::new()));
        Ok(self)
    }

    /// Puts effects into the axis.
    ///
    /// # Errors
    ///
    /// [`SimulationError::Effect`] for an effect that this axis cannot take.
    pub fn with_effects(mut self, effects: &[Effect]) -> Result<Self, SimulationError> {
        self.axis.capabilities().check(effects)?;
        self.effects = effects.to_vec();
        Ok(self)
    }

    /// Puts a load besides the constant one on the axis.
    ///
    /// # Errors
    ///
    /// [`SimulationError::Scenario`] for a load out of bounds.
    pub fn with_load(mut self, load: Load) -> Result<Self, SimulationError> {
        load.check()?;
        self.load = Arc::new(load);
        Ok(self)
    }

    /// Cuts segments to a share of their length, rounded up to whole parts: of
    /// the controller's tick, or of what effects allow.
    #[must_use]
    pub fn with_finer_segments(mut self, longest_segment_ratio: f64) -> Self {
        self.finer = longest_segment_ratio.clamp(1e-4, 1.0);
        self
    }

    /// Runs the test as [`simulate`](Self::simulate) does, to its end.
    ///
    /// # Errors
    ///
    /// [`SimulationError::Runaway`] for an axis that is driven away.
    pub fn try_simulate(&self, faults: &PhysicalFaults) -> Result<AxisTrace, SimulationError> {
        self.simulate(faults).whole()
    }

    /// Runs the test on an axis with worn friction (`k1`) and backlash (`k2`); the faults of a
    /// winding have no place in it. Where the axis is driven away the run ends at once:
    /// [`runaway`](field@AxisTrace::runaway) says why, and the channels are NaN from there on.
    pub fn simulate(&self, faults: &PhysicalFaults) -> AxisTrace {
        let axis = self.axis.rescaled(&rescaling(&self.effects));
        let law = &axis.controller;
        let tick_s = 1.0 / law.sample_hz;
        let start = &self.scenario.start;
        let mut run = self.start(&axis, faults, tick_s);
        let mut cascade = AxisCascade::new(law, start.position, start.speed, start.output);
        let mut trace = self.empty_trace();
        for (tick, &command) in self.command.iter().enumerate() {
            run.begin_tick(tick, tick_s);
            let load_position = run.shown_surface_rad();
            let position = match law.feedback {
                Feedback::Load => load_position,
                Feedback::Motor if self.effects.is_empty() => start.position + run.train.angle_rad,
                Feedback::Motor => load_position + run.before_play_rad(),
            };
            let speed = run.train.speed_rad_per_s;
            let output = match self.scenario.input {
                AxisInput::Position(_) => cascade.position(command, position, speed),
                AxisInput::Speed(_) => cascade.speed(command, position, speed),
                AxisInput::Output(_) => command.clamp(-law.output_limit, law.output_limit),
            };
            trace.command.push(command);
            trace.position.push(position);
            trace.speed.push(speed);
            trace.output.push(output);
            trace.force.push(run.motor_n_m());
            trace.current.push(run.shown_current_a());
            run.advance(output, tick_s);
            if run.guard.has_passed() {
                break;
            }
        }
        trace.segments = run.segments;
        trace.runaway = run.guard.told(&self.effects, axis.geometry);
        trace.filled(self.command.len())
    }

    /// Drive signal alone of many tests, of axes, effects and lengths of their own, every `step`-th
    /// value: the current as its sensor shows it, of [`Drive::Amplifier`] the output. What
    /// [`simulate`](Self::simulate) gives, bit for bit; tests go side by side where they can.
    #[cfg(feature = "model-file")]
    pub(crate) fn drives_every(step: usize, tests: &[(&Self, &PhysicalFaults)]) -> Vec<Vec<f64>> {
        let alone = |place: usize| {
            let (test, faults) = tests[place];
            let trace = test.simulate(faults);
            let is_output = test.axis.drive == Drive::Amplifier;
            let shown = if is_output { trace.output } else { trace.current };
            shown.into_iter().step_by(step).collect::<Vec<f64>>()
        };
        let one_alone = |place: usize| vec![alone(place)];
        let mut drives = vec![Vec::new(); tests.len()];
        let (mut currents, mut outputs) = (Vec::new(), Vec::new());
        for (place, (test, faults)) in tests.iter().enumerate() {
            match (test.member(faults, place), test.axis.drive) {
                (Some(member), Drive::Amplifier) => outputs.push(member),
                (Some(member), _) => currents.push(member),
                (None, _) => drives[place] = alone(place),
            }
        }
        for (kept, members) in [(Kept::Current, currents), (Kept::Output, outputs)] {
            let group = Group { members, kept: &[kept], step };
            group.run(one_alone, |place, mut drive| drives[place] = drive.swap_remove(0));
        }
        drives
    }

    /// The run of a test at its start; `None` where it has to go alone.
    #[cfg(feature = "model-file")]
    fn member(&self, faults: &PhysicalFaults, place: usize) -> Option<Member<'_, AxisLane>> {
        let axis = self.axis.rescaled(&rescaling(&self.effects));
        let (law, start) = (&axis.controller, &self.scenario.start);
        let tick_s = 1.0 / law.sample_hz;
        let run = self.start(&axis, faults, tick_s);
        let asked = match self.scenario.input {
            AxisInput::Position(_) => Asked::Position,
            AxisInput::Speed(_) => Asked::Speed,
            AxisInput::Output(_) => Asked::Output,
        };
        let law = AxisLane {
            asked,
            cascade: AxisCascade::new(law, start.position, start.speed, start.output),
            start: start.position,
            is_plain: self.effects.is_empty(),
        };
        let commands = &self.command;
        let is_plain = self.finer >= 1.0 && run.joins_lanes();
        is_plain.then_some(Member { place, run, law, commands, tick_s })
    }

    /// The controller's output at each tick of the test, A or V, when its sensors show the
    /// position and speed of a trace, simulated or recorded: the loop cut open. Of a trace of
    /// this very test it is its output. A trace that ends before the test is replayed to its end.
    pub fn replayed_output(&self, trace: &AxisTrace) -> Vec<f64> {
        let axis = self.axis.rescaled(&rescaling(&self.effects));
        let (law, start) = (&axis.controller, &self.scenario.start);
        let mut cascade = AxisCascade::new(law, start.position, start.speed, start.output);
        let seen = trace.position.iter().zip(&trace.speed);
        let tick = |(&command, (&position, &speed))| match self.scenario.input {
            AxisInput::Position(_) => cascade.position(command, position, speed),
            AxisInput::Speed(_) => cascade.speed(command, position, speed),
            AxisInput::Output(_) => command.clamp(-law.output_limit, law.output_limit),
        };
        self.command.iter().zip(seen).map(tick).collect()
    }

    /// The machine at the start.
    fn start(&self, axis: &ServoAxis, faults: &PhysicalFaults, tick_s: f64) -> Run {
        let half_play = 0.5 * axis.backlash * faults.backlash_ratio;
        let start = &self.scenario.start;
        let train = DriveTrain::of(&Parts {
            inertia_kg_m2: axis.inertia,
            viscous_n_m_s_per_rad: axis.viscous,
            kinetic_n_m: axis.kinetic_friction * faults.friction_ratio,
            static_n_m: axis.static_friction * faults.friction_ratio,
            offset_n_m: axis.offset,
            gear_ratio: 1.0,
            half_play_rad: half_play,
            stop_rad: f64::INFINITY,
            efficiency_ratio: 1.0,
            load_n_m: self.scenario.load,
            surface_friction_n_m: 0.0,
            side_ratio: start.backlash_side_ratio,
            speed_rad_per_s: start.speed,
        });
        let resistance_ohm = (axis.drive == Drive::Winding).then_some(axis.resistance_ohm);
        let limit = axis.controller.output_limit;
        let mut run =
            Run::of_axis(train, axis.force_constant, resistance_ohm, limit, start.position);
        let machine = MachineNumbers {
            inertia_kg_m2: axis.inertia,
            per_gear_ratio: 1.0,
            load_inertia_kg_m2: 0.0,
            efficiency_ratio: 1.0,
            half_play_rad: half_play,
            tick_s,
            start_position_rad: start.position,
            pole_pairs: 1.0,
        };
        let additions = Additions { effects: &self.effects, load: &self.load, finer: self.finer };
        run.add(&machine, &additions, self.scenario.load);
        // an axis has no stops; what the air does to one is taken within a radian
        let load = self.scenario.load.abs() + self.load.most_n_m(1.0);
        let force = axis.peak_force() + axis.offset.abs() + load;
        let duration_s = self.command.len() as f64 * tick_s;
        run.guard = SpeedGuard::of_axis(start.speed, force, axis.inertia, duration_s);
        run
    }

    fn empty_trace(&self) -> AxisTrace {
        let room = || Vec::with_capacity(self.command.len());
        AxisTrace {
            rate_hz: self.axis.controller.sample_hz,
            command: room(),
            position: room(),
            speed: room(),
            output: room(),
            current: room(),
            force: room(),
            segments: 0,
            runaway: None,
        }
    }
}
