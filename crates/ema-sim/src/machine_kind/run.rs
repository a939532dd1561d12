//! A test of a machine on a recorded command, and the signals that it gives.

use super::NumberValue;
use crate::{
    effect::Effect, fault::PhysicalFaults, load::Load, low_fidelity::LowFidelity,
    simulation_error::SimulationError,
};

/// Quantity that a command asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CommandKind {
    /// A position: rad, of a linear axis m.
    #[default]
    Position,
    /// A speed: rad/s or m/s.
    Speed,
    /// Nothing that is known: the controller is another than the model's, and the command is the
    /// measured position, which a controller of our own follows. Of a servo axis whose current,
    /// or whose amplifier, is recorded.
    Motion,
}

/// A test: command and load, with one sample at each multiple of `1/rate_hz`, beginning at zero.
#[derive(Clone, Copy, Debug)]
pub struct MachineTest<'a> {
    /// Rate of all samples.
    pub rate_hz: f64,
    /// The command: rad or rad/s, m or m/s.
    pub command: &'a [f64],
    /// Quantity that it asks for.
    pub asks_for: CommandKind,
    /// Load against positive motion, as long as the command: N·m or N.
    pub load: Option<&'a [f64]>,
    /// Corner of the two first-order low-passes behind the drive signal, Hz, where it is filtered.
    pub filter_hz: Option<f64>,
    /// First position that the sensor of motor or axis shows.
    pub shown_start: Option<f64>,
    /// Angle of the motor at the first sample, rad, where it is known better than the sensor
    /// shows it.
    pub start_rad: Option<f64>,
}

impl<'a> MachineTest<'a> {
    /// Test of a position command without a load, the drive signal unfiltered.
    pub fn of_position(rate_hz: f64, command: &'a [f64]) -> Self {
        Self {
            rate_hz,
            command,
            asks_for: CommandKind::Position,
            load: None,
            filter_hz: None,
            shown_start: None,
            start_rad: None,
        }
    }

    /// Length in seconds.
    pub(super) fn duration_s(&self) -> f64 {
        self.command.len() as f64 / self.rate_hz
    }

    /// Ticks of a controller for a sample.
    pub(super) fn ticks_per_sample(&self, sample_hz: f64) -> Result<usize, MachineTestError> {
        let rate_hz = self.rate_hz;
        whole_ratio(sample_hz / rate_hz).ok_or(MachineTestError::Rate { rate_hz, sample_hz })
    }

    pub(super) fn recorded_load(&self) -> Load {
        match self.load {
            Some(values) => Load::Recorded { values_n_m: values.to_vec(), rate_hz: self.rate_hz },
            None => Load::None,
        }
    }
}

/// A ratio of rates as a whole number, which the crystals of two clocks do not keep to the last digit.
fn whole_ratio(ratio: f64) -> Option<usize> {
    let whole = libm::round(ratio);
    (whole >= 1.0 && (ratio - whole).abs() < 1e-4 * whole).then_some(whole as usize)
}

/// The rate, Hz, at which a machine can be run on a test that was recorded at a rate: that rate where
/// the controller's is a whole multiple of it, else the next above of which it is one, at most the
/// controller's own.
pub fn testable_rate_hz(recorded_hz: f64, controller_hz: f64) -> f64 {
    let ratio = controller_hz / recorded_hz;
    match whole_ratio(ratio) {
        Some(_) => recorded_hz,
        None => controller_hz / libm::floor(ratio).max(1.0),
    }
}

/// Reason why a machine cannot be run on a test.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MachineTestError {
    /// The simulation refuses numbers, effects or command.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The rates of controller and test do not fit.
    #[error("sampled at {rate_hz} Hz, which the controller's {sample_hz} Hz is no multiple of")]
    Rate {
        /// Rate of the test.
        rate_hz: f64,
        /// Rate of the controller.
        sample_hz: f64,
    },
    /// The machine cannot follow a motion.
    #[error(
        "its motion can be followed on a servo axis whose current or amplifier is recorded, on no \
         other machine"
    )]
    Motion,
    /// The model file describes no electronics.
    #[error("the model file of the machine describes no electronics to run it with")]
    NoElectronics,
}

/// Signals that a machine gives in a test, at its rate.
#[derive(Clone, Debug, PartialEq)]
pub struct MachineSignals {
    /// Drive signal as its sensor shows it: A, or V.
    pub drive: Vec<f64>,
    /// Angle of the motor, or position of the axis: rad or m.
    pub motor: Vec<f64>,
    /// Speed of the motor, or of the axis: rad/s or m/s.
    pub speed: Vec<f64>,
    /// Position of the surface, or of the axis: rad or m.
    pub surface: Vec<f64>,
}

/// A machine in a test, with all that it did.
pub trait MachineRun {
    /// The signals, at the rate of the test.
    fn signals(&self) -> MachineSignals;

    /// Change of the drive signal when the controller is run again on a measured position of
    /// motor or axis instead of the simulated one: the controller replay. One value for each
    /// sample of the test, in A or V.
    fn replayed_drive_change(&self, position: &[f64]) -> Vec<f64>;
}

/// One of many runs of which the drive signal alone is asked for.
#[derive(Clone, Copy, Debug)]
pub struct DriveRun<'a> {
    /// Numbers of the machine that are replaced.
    pub numbers: &'a [NumberValue],
    /// The test, and what its runs share.
    pub test: &'a MachineTest<'a>,
    /// The test as [`prepare`](super::MachineKind::prepare) has made it ready.
    pub prepared: &'a PreparedTest,
    /// Damage.
    pub faults: &'a PhysicalFaults,
    /// Effects besides the base model.
    pub effects: &'a [Effect],
}

/// Runs of which one signal is asked for, by the ticks in a sample; with place and test.
pub(super) type BySteps<T> = std::collections::BTreeMap<usize, Vec<(usize, T)>>;

/// Work that several runs of one test share.
#[derive(Clone, Debug, Default)]
pub struct PreparedTest {
    /// Command and load at the ticks of an actuator.
    pub(super) low_fidelity: Option<LowFidelity>,
}

/// Measured less predicted position, and its rate, at the ticks of the controller.
pub(super) struct Departure {
    angle: Vec<f64>,
    speed: Vec<f64>,
}

impl Departure {
    pub(super) fn new(
        predicted: &[f64],
        measured: &[f64],
        ticks_per_sample: usize,
        tick_s: f64,
    ) -> Self {
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

    pub(super) fn add_angle(&self, to: &mut [f64], share: f64) {
        for (x, off) in to.iter_mut().zip(&self.angle) {
            *x += share * off;
        }
    }

    pub(super) fn add_speed(&self, to: &mut [f64]) {
        for (x, off) in to.iter_mut().zip(&self.speed) {
            *x += off;
        }
    }
}

/// First signal less the second.
pub(super) fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// A signal one tick later.
pub(super) fn delayed(mut values: Vec<f64>) -> Vec<f64> {
    values.pop();
    values.insert(0, 0.0);
    values
}

/// Samples of a signal at ticks.
pub(super) fn every(values: &[f64], step: usize, samples: usize) -> Vec<f64> {
    values.iter().step_by(step).take(samples).copied().collect()
}
