//! The two machines: their numbers, and the nominal model file that goes with a case.

use core::f64::consts::TAU;

/// Rate of the recordings, Hz.
pub const RATE_HZ: f64 = 2000.0;

/// Which machine a case is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Machine {
    /// The EMA-48 actuator in low fidelity.
    Ema48,
    /// A rotary servo axis driven by current.
    Servo,
}

impl Machine {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Ema48, Self::Servo];

    /// Name in truths and results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ema48 => "ema-48",
            Self::Servo => "servo",
        }
    }

    /// The nominal model, as a model file.
    pub fn nominal_toml(self) -> &'static str {
        match self {
            Self::Ema48 => include_str!("nominal/ema_48.toml"),
            Self::Servo => include_str!("nominal/servo.toml"),
        }
    }

    /// Fault coordinates that it has: `k1` to `k5`, `k6·cos φ`, `k6·sin φ`, or `k1`, `k2`.
    pub fn fault_count(self) -> usize {
        match self {
            Self::Ema48 => 7,
            Self::Servo => 2,
        }
    }
}

/// Numbers of a machine; angles and torques of the shaft are the motor's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Numbers {
    pub(crate) machine: Machine,
    /// Motor's inertia and, added to it, the surface's behind the gear.
    pub(crate) motor_inertia: f64,
    pub(crate) reflected_inertia: f64,
    pub(crate) viscous: f64,
    pub(crate) kinetic: f64,
    pub(crate) fixed: f64,
    /// Whole play, at the surface.
    pub(crate) play: f64,
    pub(crate) gear: f64,
    pub(crate) efficiency: f64,
    /// Torque over current with all turns healthy, and resistance of the conducting pair.
    pub(crate) constant: f64,
    pub(crate) ohm: f64,
    pub(crate) supply_v: f64,
    pub(crate) pole_pairs: f64,
    pub(crate) tick_hz: f64,
    pub(crate) position_gain: f64,
    pub(crate) speed_limit: f64,
    pub(crate) speed_gain: f64,
    pub(crate) speed_integral: f64,
    pub(crate) current_limit: f64,
    /// Step of the encoder in the loop.
    pub(crate) encoder_step: f64,
}

/// A number with a tolerance on the data sheet: a nuisance parameter of the hidden effects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Nuisance {
    Inertia,
    Viscous,
}

impl Nuisance {
    pub(crate) const ALL: [Self; 2] = [Self::Inertia, Self::Viscous];

    /// Half-width over value in the nominal model's `[tolerance]`.
    pub(crate) fn half_width(self, machine: Machine) -> f64 {
        match (self, machine) {
            (Self::Inertia, Machine::Ema48) => 0.05,
            (Self::Inertia, Machine::Servo) => 0.1,
            (Self::Viscous, _) => 0.3,
        }
    }

    /// Key in the model file.
    pub(crate) fn key(self, machine: Machine) -> &'static str {
        match (self, machine) {
            (Self::Inertia, Machine::Ema48) => "motor.inertia-kg-m2",
            (Self::Viscous, Machine::Ema48) => "motor.viscous-n-m-s-per-rad",
            (Self::Inertia, Machine::Servo) => "axis.inertia-kg-m2",
            (Self::Viscous, Machine::Servo) => "axis.viscous-n-m-s-per-rad",
        }
    }

    fn of(self, numbers: &mut Numbers) -> &mut f64 {
        match self {
            Self::Inertia => &mut numbers.motor_inertia,
            Self::Viscous => &mut numbers.viscous,
        }
    }

    /// Multiplies it by `1 + change`.
    pub(crate) fn change(self, numbers: &mut Numbers, change: f64) {
        *self.of(numbers) *= 1.0 + change;
    }
}

/// Bandwidth of the actuator's speed loop, rad/s, and its total inertia.
const EMA_BANDWIDTH: f64 = TAU * 60.0;
const EMA_INERTIA: f64 = 2.5e-5 + 0.2 / (500.0 * 500.0);

impl Numbers {
    /// The nominal machine; the same numbers as in [`Machine::nominal_toml`].
    pub(crate) fn nominal(machine: Machine) -> Self {
        match machine {
            Machine::Ema48 => Self {
                machine,
                motor_inertia: 2.5e-5,
                reflected_inertia: 0.2 / (500.0 * 500.0),
                viscous: 3e-5,
                kinetic: 0.030,
                fixed: 0.045,
                play: 5e-5,
                gear: 500.0,
                efficiency: 0.85,
                constant: 0.0752,
                ohm: 2.13,
                supply_v: 48.0,
                pole_pairs: 4.0,
                tick_hz: 1e4,
                position_gain: 60.0 * 500.0,
                speed_limit: 600.0,
                speed_gain: EMA_INERTIA * EMA_BANDWIDTH / 0.0752,
                speed_integral: EMA_INERTIA * EMA_BANDWIDTH / 0.0752 * EMA_BANDWIDTH / 5.0,
                current_limit: 20.0,
                encoder_step: 0.0,
            },
            Machine::Servo => Self {
                machine,
                motor_inertia: 2.2e-4,
                reflected_inertia: 0.0,
                viscous: 4e-4,
                kinetic: 0.035,
                fixed: 0.045,
                play: 1e-4,
                gear: 1.0,
                efficiency: 1.0,
                constant: 0.12,
                ohm: 1.0,
                supply_v: f64::INFINITY,
                pole_pairs: 1.0,
                tick_hz: RATE_HZ,
                position_gain: 30.0,
                speed_limit: 80.0,
                speed_gain: 0.28,
                speed_integral: 8.0,
                current_limit: 8.0,
                encoder_step: 1e-6,
            },
        }
    }

    pub(crate) fn inertia(&self) -> f64 {
        self.motor_inertia + self.reflected_inertia
    }

    /// Ticks of the controller in a sample of the recording.
    pub(crate) fn ticks_per_sample(&self) -> usize {
        libm::round(self.tick_hz / RATE_HZ) as usize
    }
}
