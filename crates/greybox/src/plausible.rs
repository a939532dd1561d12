//! Sizes that an effect of a machine can have in recordings: what is beyond them explains a residual
//! and is no cause.
//!
//! | quantity of a size | largest | why |
//! | --- | --- | --- |
//! | torque, force | that of the motor at the limit of its drive | the loop would not hold it |
//! | angle, length | the way that the motor went | an error of a position is within it |
//! | time | a quarter of a period of the faster loop | a loop with so much lag is unstable |
//! | current | the limit of the drive | |
//! | frequency | 0.8 of half the rate compared | beyond it stands an alias |

use core::f64::consts::TAU;

use ema_sim::{EffectParameter, Quantity};

use crate::{gram::dot, hypothesis::Scales, machine::Machine, problem::Problem};

/// Frequency over half the rate compared, at most.
const MOST_OF_NYQUIST: f64 = 0.8;
/// Share of a command's variance in one sine from which that is a line of the command.
const LINE_SHARE: f64 = 0.05;

/// Bounds of sizes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plausible {
    torque: f64,
    /// Half of the way that the surface went.
    pub(crate) travel: f64,
    motor_travel: f64,
    lag_s: f64,
    drive: f64,
}

impl Plausible {
    pub(crate) fn new(machine: &Machine, scales: &Scales) -> Self {
        let drive = machine.drive_limit();
        Self {
            torque: drive * machine.constant(),
            travel: scales.travel,
            motor_travel: scales.motor_travel,
            lag_s: 0.25 / machine.bandwidth_hz(),
            drive,
        }
    }

    /// Largest magnitude of a size.
    pub(crate) fn most(&self, size: &EffectParameter) -> f64 {
        match size.quantity() {
            Quantity::Torque => self.torque,
            Quantity::Angle => 2.0 * self.motor_travel,
            Quantity::Time => self.lag_s,
            Quantity::Current => self.drive,
            _ => f64::INFINITY,
        }
    }
}

/// Largest frequency that recordings show without an alias, Hz.
pub(crate) fn most_shown_hz(problem: &Problem<'_>) -> f64 {
    let nyquist = |rate_hz: f64| 0.5 * MOST_OF_NYQUIST * rate_hz;
    problem.records.iter().map(|record| nyquist(record.rate_hz())).fold(f64::INFINITY, f64::min)
}

/// Tells whether a frequency is within the resolution of a line of the command of some recording:
/// what stands there follows the command.
pub(crate) fn is_of_command(problem: &Problem<'_>, frequency_hz: f64) -> bool {
    problem.records.iter().any(|prepared| {
        let record = prepared.record;
        let command = &record.command;
        let samples = command.len() as f64;
        let mean = command.iter().sum::<f64>() / samples;
        let off: Vec<f64> = command.iter().map(|x| x - mean).collect();
        let energy = dot(&off, &off);
        let resolution_hz = record.rate_hz / samples;
        (-1..=1).any(|side| {
            let pace = TAU * (frequency_hz + f64::from(side) * resolution_hz) / record.rate_hz;
            let (mut sine, mut cosine) = (0.0, 0.0);
            for (n, x) in off.iter().enumerate() {
                let (s, c) = libm::sincos(pace * n as f64);
                sine += s * x;
                cosine += c * x;
            }
            2.0 * (sine * sine + cosine * cosine) / samples > LINE_SHARE * energy
        })
    })
}
