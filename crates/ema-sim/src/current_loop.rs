//! The digital current loop of the six-step drive.

use crate::{noise::NoiseSource, params::Actuator, scenario::Scenario};

/// Digital current loop, sampled once a carrier period; its duty acts in the next period.
///
/// ```text
/// u = sat((K_p·e + x)/V_dc, 1)      x' = K_i·e, held while saturated
/// K_p = 2·L·ω_c,  K_i = 2·R·ω_c
/// ```
///
/// # Source
///
/// Textbook choice of gains that cancel the winding's pole; see `docs/models/inverter.md`.
pub(crate) struct CurrentLoop {
    pub(crate) period_s: f64,
    gain: f64,
    integral_step: f64,
    per_bus_v: f64,
    integral_v: f64,
    pub(crate) pending_duty: f64,
    noise_half_width_a: f64,
    noise: NoiseSource,
}

/// Keeps the stream of the current's noise apart from the speed's.
pub(crate) const CURRENT_NOISE_STREAM: u64 = 0x9e37_79b9_7f4a_7c15;

impl CurrentLoop {
    pub(crate) fn new(actuator: &Actuator, scenario: &Scenario) -> Self {
        let inverter = &actuator.inverter;
        let bandwidth = core::f64::consts::TAU * inverter.current_bandwidth_hz;
        let period_s = 1.0 / inverter.carrier_hz;
        let noisy = scenario.imperfections.controller_noise;
        Self {
            period_s,
            gain: 2.0 * actuator.motor.inductance_henry * bandwidth,
            integral_step: 2.0 * actuator.motor.resistance_ohm * bandwidth * period_s,
            per_bus_v: 1.0 / inverter.bus_voltage_v,
            integral_v: scenario.initial.current_integral_v,
            pending_duty: 0.0,
            noise_half_width_a: if noisy {
                actuator.sensing.current_noise_half_width_a
            } else {
                0.0
            },
            noise: NoiseSource::new(scenario.seed ^ CURRENT_NOISE_STREAM),
        }
    }

    /// One period: the duty to apply now, −1 to 1, computed from the period before.
    pub(crate) fn step(&mut self, reference_a: f64, current_a: f64) -> f64 {
        let mut measured_a = current_a;
        if self.noise_half_width_a > 0.0 {
            measured_a += self.noise_half_width_a * self.noise.symmetric();
        }
        let error = reference_a - measured_a;
        let wanted = (self.gain * error + self.integral_v) * self.per_bus_v;
        if wanted.abs() < 1.0 {
            self.integral_v += self.integral_step * error;
        }
        core::mem::replace(&mut self.pending_duty, wanted.clamp(-1.0, 1.0))
    }
}
