//! Position and speed cascade, shared by both fidelities.

use crate::{
    noise::NoiseSource,
    params::{Actuator, Controller},
    scenario::Scenario,
};

/// The sampled cascade with its sensors.
#[derive(Clone, Debug)]
pub(crate) struct Cascade {
    law: Controller,
    position_gain: f64,
    integral_step: f64,
    integral_a: f64,
    surface_step_rad: f64,
    current_step_a: f64,
    speed_noise_rad_per_s: f64,
    noise: NoiseSource,
}

impl Cascade {
    /// The cascade at rest.
    pub(crate) fn new(actuator: &Actuator, scenario: &Scenario) -> Self {
        let law = actuator.controller;
        let on = |switch: bool, value: f64| if switch { value } else { 0.0 };
        let imperfect = scenario.imperfections;
        Self {
            law,
            position_gain: law.position_gain_per_s * actuator.transmission.gear_ratio,
            integral_step: law.speed_integral_a_per_rad / law.sample_hz,
            integral_a: scenario.initial.speed_integral_a,
            surface_step_rad: on(imperfect.digitisation, actuator.sensing.surface_step_rad),
            current_step_a: on(imperfect.digitisation, actuator.sensing.current_reference_step_a),
            speed_noise_rad_per_s: on(
                imperfect.controller_noise,
                actuator.sensing.speed_noise_rad_per_s,
            ),
            noise: NoiseSource::new(scenario.seed),
        }
    }

    /// One tick: the current set-point from the command and what the sensors show.
    pub(crate) fn step(&mut self, command_rad: f64, surface_rad: f64, speed_rad_per_s: f64) -> f64 {
        let measured_rad = quantised(surface_rad, self.surface_step_rad);
        let mut measured_speed = speed_rad_per_s;
        if self.speed_noise_rad_per_s > 0.0 {
            measured_speed += self.speed_noise_rad_per_s * self.noise.normal();
        }
        let limit = self.law.speed_limit_rad_per_s;
        let reference = (self.position_gain * (command_rad - measured_rad)).clamp(-limit, limit);
        let error = reference - measured_speed;
        let wanted_a = self.law.speed_gain_a_s_per_rad * error + self.integral_a;
        let limit_a = self.law.current_limit_a;
        if wanted_a.abs() < limit_a {
            self.integral_a += self.integral_step * error;
        }
        quantised(wanted_a.clamp(-limit_a, limit_a), self.current_step_a)
    }
}

/// The nearest multiple of a step; the value itself without one.
pub(crate) fn quantised(value: f64, step: f64) -> f64 {
    if step > 0.0 { step * libm::floor(value / step + 0.5) } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::presets::EMA_48;

    #[test]
    fn the_integral_rests_while_saturated() {
        let mut cascade = Cascade::new(&EMA_48, &Scenario::chirp());
        for _ in 0..1000 {
            assert_eq!(cascade.step(0.3, 0.0, 0.0), EMA_48.controller.current_limit_a);
        }
        assert_eq!(cascade.integral_a, 0.0);
    }

    #[test]
    fn quantised_is_the_nearest_step() {
        assert_eq!(quantised(0.26, 0.1), 0.1 * 3.0);
        assert_eq!(quantised(-0.24, 0.1), 0.1 * -2.0);
        assert_eq!(quantised(0.26, 0.0), 0.26);
    }
}
