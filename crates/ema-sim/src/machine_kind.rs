//! Kinds of machines: the facts and the runs that comparisons with recordings ask of each.
//!
//! A new kind is one file beside [`actuator`] and [`axis`], one variant of
//! [`MachineModel`](crate::model_file::MachineModel), and its keys in the model files. It compiles
//! when it answers every question of [`MachineKind`].

mod actuator;
mod axis;
mod follow;
mod replay;
mod run;

pub use follow::{resolved_hz, shown_while_followed};
pub use run::{
    CommandKind, DriveRun, MachineRun, MachineSignals, MachineTest, MachineTestError, PreparedTest,
    testable_rate_hz,
};

use crate::{
    effect::{Effect, Geometry},
    fault::{FaultId, PhysicalFaults},
    model_file::EffectBlock,
    motion_term::MotionTerm,
};

/// Unit of the signal that drives a machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriveUnit {
    /// Current, A.
    Ampere,
    /// Voltage of an amplifier, V.
    Volt,
}

impl DriveUnit {
    /// Symbol as keys are spelt: `a`, `v`.
    pub fn key(self) -> &'static str {
        match self {
            Self::Ampere => "a",
            Self::Volt => "v",
        }
    }
}

/// Number of a machine, with the values that any machine of the kind can have.
#[derive(Clone, Debug, PartialEq)]
pub struct MachineNumber {
    /// Key of the model file: `axis.mass-kg`.
    pub key: String,
    /// Term of the equation of motion that it sets, if any: what a calibration looks for.
    pub motion_term: Option<MotionTerm>,
    /// Least value.
    pub least: f64,
    /// Largest value.
    pub most: f64,
}

/// Tolerance that a data sheet gives a number of a machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NumberTolerance {
    /// Place among [`MachineKind::numbers`].
    pub place: usize,
    /// Half-width of the tolerance over the value; of a normal distribution √3 standard deviations.
    pub half_width_frac: f64,
}

/// Value for a number of a machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NumberValue {
    /// Place among [`MachineKind::numbers`].
    pub place: usize,
    /// Value, in the unit of its key.
    pub value: f64,
}

/// Gains of the loops for position and speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopGains {
    /// Speed asked for over error of the position, 1/s.
    pub position_per_s: f64,
    /// Drive signal asked for over error of the speed: A·s/rad, V·s/m and the like.
    pub speed: f64,
    /// Drive signal asked for over the integral of the speed's error: A/rad, V/m and the like.
    pub speed_integral: f64,
}

/// Model in which a machine is run with its electronics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelFidelity {
    /// The monitoring model: one equivalent direct current.
    Low,
    /// The reference model: three phases, their inverter and its carrier.
    High,
}

/// Run of a machine with the noise and the steps of its electronics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Electronics {
    /// Model that is run.
    pub fidelity: ModelFidelity,
    /// Seed of the noise of the controller's sensors.
    pub noise_seed: u64,
}

/// A machine as its model file describes it: facts, numbers, and runs on a command.
///
/// No question has a default answer, so that a kind cannot leave one out.
pub trait MachineKind {
    /// Name that its owner gave.
    fn name(&self) -> Option<&str>;

    /// Name that its owner gave, to be changed.
    fn name_mut(&mut self) -> &mut Option<String>;

    /// Faults that it can have.
    fn faults(&self) -> &[FaultId];

    /// Effects besides the base model.
    fn effects(&self) -> &[EffectBlock];

    /// Effects besides the base model, to be changed.
    fn effects_mut(&mut self) -> &mut Vec<EffectBlock>;

    /// Text of its model file, complete and without a base.
    fn write(&self) -> String;

    /// Rotary or linear: the units of its effects.
    fn geometry(&self) -> Geometry;

    /// Unit of the signal that drives it.
    fn drive_unit(&self) -> DriveUnit;

    /// True where the controller's output is the signal that drives it. Between the voltage on a
    /// winding and its current stand resistance and back-EMF.
    fn controls_its_drive(&self) -> bool;

    /// Torque, or force, over the drive signal: N·m/A, N/A or N/V.
    fn torque_per_drive(&self) -> f64;

    /// Inertia, or mass, that the motor moves: kg·m² or kg.
    fn moved_inertia(&self) -> f64;

    /// Pole pairs of a motor whose commutation the model follows.
    fn pole_pairs(&self) -> Option<u32>;

    /// Rate of its controller, Hz: that of a recording is to be a whole part of it.
    fn controller_hz(&self) -> f64;

    /// Gains of its loops.
    fn loop_gains(&self) -> LoopGains;

    /// Largest speed of surface or axis that its controller allows, rad/s or m/s; `None` where it
    /// has no limit.
    fn speed_limit(&self) -> Option<f64>;

    /// Largest drive signal that its controller allows, A or V.
    fn drive_limit(&self) -> f64;

    /// All its numbers, in the order of the model file.
    fn numbers(&self) -> Vec<MachineNumber>;

    /// Value of a number, by its place among [`numbers`](Self::numbers).
    ///
    /// # Panics
    ///
    /// Where there is no such place.
    fn number(&self, place: usize) -> f64;

    /// Replaces numbers. A static friction among them is that beside the kinetic friction of before:
    /// given or not, it follows the kinetic one in the ratio that the two had, and is never below it.
    /// Where the kinetic friction stays it is as given.
    ///
    /// # Panics
    ///
    /// Where there is no such place among [`numbers`](Self::numbers).
    fn set_numbers(&mut self, values: &[NumberValue]);

    /// Numbers with a tolerance on the data sheet, in the order of the file: their tolerances of
    /// type and unit in one. Numbers that are no parameter of the machine are left out. The offset of
    /// an axis has one of its own size where the file states none, and is not zero.
    fn rough(&self) -> Vec<NumberTolerance>;

    /// Tolerances of numbers of motor, transmission and supply for which the file states none at any
    /// level, by their places: a half-width of 10 %, of friction, drag and play of 30 %
    /// (`docs/models/tolerances.md`). Numbers that are zero, that are counted (poles, teeth) and
    /// those of controller and sensors have none; nor has a static friction that is the kinetic one.
    fn usual_tolerances(&self) -> Vec<NumberTolerance>;

    /// True where a motion recorded under a controller that is not known can be followed
    /// ([`CommandKind::Motion`]).
    fn can_follow_motion(&self) -> bool;

    /// Runs it with damage and with these effects on the command of a test.
    ///
    /// # Errors
    ///
    /// [`MachineTestError`] for a test, numbers or effects that it cannot be run with.
    fn run(
        &self,
        test: &MachineTest<'_>,
        faults: &PhysicalFaults,
        effects: &[Effect],
    ) -> Result<Box<dyn MachineRun>, MachineTestError>;

    /// Drive signal that its controller makes of the command of a test and a recorded position of
    /// motor or axis, one value for each sample of the test, A or V: the controller replay on
    /// recorded signals alone. Integral parts begin at zero.
    ///
    /// `None` where no controller that the model knows makes the drive signal: of a followed motion,
    /// of a winding, and of an actuator, whose loop sees more than these two signals.
    ///
    /// # Errors
    ///
    /// [`MachineTestError`] for a test that it cannot be run on.
    fn replayed(
        &self,
        test: &MachineTest<'_>,
        position: &[f64],
        effects: &[Effect],
    ) -> Result<Option<Vec<f64>>, MachineTestError>;

    /// Models in which its electronics can be run, the finest last; none where its model file
    /// describes no electronics.
    fn electronics(&self) -> &'static [ModelFidelity];

    /// Runs it with the noise and the steps of its electronics: what a recording of it shows but
    /// for the noise of the sensors that recorded it. The current of three phases is shown as the
    /// envelope that the drive has.
    ///
    /// # Errors
    ///
    /// [`MachineTestError`] for a test, numbers, effects or electronics that it cannot be run with.
    fn run_with_electronics(
        &self,
        electronics: Electronics,
        test: &MachineTest<'_>,
        faults: &PhysicalFaults,
        effects: &[Effect],
    ) -> Result<MachineSignals, MachineTestError>;

    /// Makes ready what several runs of one test have in common.
    fn prepare(&self, test: &MachineTest<'_>) -> PreparedTest;

    /// Drive signal alone of a [`run`](Self::run), A or V at the rate of the test. A test that was
    /// [prepared](Self::prepare) with this kind of machine, whatever its numbers, saves time and
    /// changes no value.
    ///
    /// # Errors
    ///
    /// [`MachineTestError`] for a test, numbers or effects that it cannot be run with.
    fn drive(
        &self,
        test: &MachineTest<'_>,
        prepared: &PreparedTest,
        faults: &PhysicalFaults,
        effects: &[Effect],
    ) -> Result<Vec<f64>, MachineTestError>;

    /// Drive signals alone of many runs, each with numbers of its own: what [`drive`](Self::drive)
    /// gives of each after [`set_numbers`](Self::set_numbers), bit for bit, in less time.
    fn drives(&self, runs: &[DriveRun<'_>]) -> Vec<Result<Vec<f64>, MachineTestError>>;
}

/// Bandwidth of the faster of the loops for position and speed, Hz.
///
/// ```text
/// f = max(k_p, k_v·c/M)/2π
/// ```
///
/// with the gains `k_p` and `k_v`, torque or force over the drive signal `c` and the inertia or
/// mass moved `M`.
///
/// # Source
///
/// Two first-order loops, one within the other; a choice of this project, `docs/models/greybox.md`.
pub fn bandwidth_hz(machine: &dyn MachineKind) -> f64 {
    let LoopGains { position_per_s, speed, .. } = machine.loop_gains();
    let of_speed = speed * machine.torque_per_drive() / machine.moved_inertia();
    position_per_s.max(of_speed) / core::f64::consts::TAU
}

/// Adds a tolerance to those before it: several of one number add in squares.
fn add_tolerance(tolerances: &mut Vec<NumberTolerance>, new: NumberTolerance) {
    match tolerances.iter_mut().find(|earlier| earlier.place == new.place) {
        Some(earlier) => {
            earlier.half_width_frac = libm::hypot(earlier.half_width_frac, new.half_width_frac);
        }
        None => tolerances.push(new),
    }
}

/// Half-width over the value of a number that a data sheet states without a tolerance, and of
/// friction, drag and play, which differ most from one machine to the next.
const USUAL_FRAC: f64 = 0.1;
const USUAL_FRICTION_FRAC: f64 = 0.3;

/// Static friction beside a new kinetic one, in the ratio of the old ones and never below it.
fn static_friction(old_static: f64, old_kinetic: f64, kinetic: f64) -> f64 {
    if kinetic == old_kinetic {
        return old_static.max(kinetic);
    }
    let ratio = if old_kinetic > 0.0 { old_static / old_kinetic } else { 1.0 };
    kinetic * ratio.max(1.0)
}
