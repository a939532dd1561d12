//! Position and speed cascade, shared by both fidelities.

mod lanes;

use crate::{
    bounds::within,
    noise::NoiseSource,
    params::{Actuator, Controller, PositionSensor},
    quantisation::quantised,
    scenario::{ControlMode, Scenario},
};

/// State that the cascade's sensors measure.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Measured {
    pub(crate) surface_rad: f64,
    /// Motor angle from the start.
    pub(crate) motor_rad: f64,
    pub(crate) speed_rad_per_s: f64,
}

/// The cascade's law: what it makes of an angle, a speed and its integral in one tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Law {
    controller: Controller,
    mode: ControlMode,
    gear_ratio: f64,
    position_gain: f64,
    integral_step: f64,
}

impl Law {
    /// The angle that the position loop holds, as the surface's.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
    pub(crate) fn held_rad(&self, measured: &Measured) -> f64 {
        match self.controller.position_sensor {
            PositionSensor::Surface => measured.surface_rad,
            PositionSensor::MotorShaft => measured.motor_rad / self.gear_ratio,
        }
    }

    /// Error of the speed.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
    pub(crate) fn error(&self, command: f64, held_rad: f64, speed_rad_per_s: f64) -> f64 {
        let asked = match self.mode {
            ControlMode::Position => self.position_gain * (command - held_rad),
            ControlMode::Speed => self.gear_ratio * command,
        };
        let limit = self.controller.speed_limit_rad_per_s;
        within(asked, limit) - speed_rad_per_s
    }

    /// Current asked for by the proportional and the integral part.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
    pub(crate) fn wanted_a(&self, error: f64, integral_a: f64) -> f64 {
        self.controller.speed_gain_a_s_per_rad * error + integral_a
    }

    /// The current within its limit, and the integral, which rests at the limit.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
    pub(crate) fn limited_a(&self, wanted_a: f64, error: f64, integral_a: f64) -> (f64, f64) {
        let limit_a = self.controller.current_limit_a;
        let growth_a = if wanted_a.abs() < limit_a { self.integral_step * error } else { 0.0 };
        (within(wanted_a, limit_a), integral_a + growth_a)
    }
}

/// The sampled cascade with its sensors.
#[derive(Clone, Debug)]
pub(crate) struct Cascade {
    law: Law,
    derivative_gain: f64,
    last_error: Option<f64>,
    integral_a: f64,
    surface_step_rad: f64,
    current_step_a: f64,
    speed_noise_rad_per_s: f64,
    noise: NoiseSource,
}

impl Cascade {
    /// The cascade at rest.
    pub(crate) fn new(actuator: &Actuator, scenario: &Scenario) -> Self {
        let controller = actuator.controller;
        let on = |switch: bool, value: f64| if switch { value } else { 0.0 };
        let imperfect = scenario.imperfections;
        Self {
            law: Law {
                controller,
                mode: scenario.mode,
                gear_ratio: actuator.transmission.gear_ratio,
                position_gain: controller.position_gain_per_s * actuator.transmission.gear_ratio,
                integral_step: controller.speed_integral_a_per_rad / controller.sample_hz,
            },
            derivative_gain: controller.speed_derivative_a_s2_per_rad * controller.sample_hz,
            last_error: None,
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

    /// The law and the integral, where a tick is nothing more: neither noise, digitisation nor
    /// derivative part.
    pub(crate) fn plain(&self) -> Option<(Law, f64)> {
        let steps = self.surface_step_rad > 0.0 || self.current_step_a > 0.0;
        let plain = !steps && self.derivative_gain == 0.0 && self.speed_noise_rad_per_s <= 0.0;
        plain.then_some((self.law, self.integral_a))
    }

    #[cold]
    fn noise_rad_per_s(&mut self) -> f64 {
        self.speed_noise_rad_per_s * self.noise.normal()
    }

    /// One tick: the current set-point from the command and what the sensors show.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "on the monitor's critical path")]
    pub(crate) fn step(&mut self, command: f64, measured: &Measured) -> f64 {
        let mut measured_speed = measured.speed_rad_per_s;
        if self.speed_noise_rad_per_s > 0.0 {
            measured_speed += self.noise_rad_per_s();
        }
        let held_rad = quantised(self.law.held_rad(measured), self.surface_step_rad);
        let error = self.law.error(command, held_rad, measured_speed);
        let mut wanted_a = self.law.wanted_a(error, self.integral_a);
        if self.derivative_gain != 0.0 {
            let before = self.last_error.replace(error).unwrap_or(error);
            wanted_a += self.derivative_gain * (error - before);
        }
        let (reference_a, integral_a) = self.law.limited_a(wanted_a, error, self.integral_a);
        self.integral_a = integral_a;
        quantised(reference_a, self.current_step_a)
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;
    use crate::presets::EMA_48;

    /// Rounding of a product of two gains.
    const ROUNDING: f64 = 1e-14;

    fn at(surface_rad: f64, motor_rad: f64, speed_rad_per_s: f64) -> Measured {
        Measured { surface_rad, motor_rad, speed_rad_per_s }
    }

    #[test]
    fn the_sensor_decides_which_angle_is_held() {
        let mut cascade = Cascade::new(&EMA_48, &Scenario::chirp());
        assert_eq!(cascade.step(1e-3, &at(1e-3, 7.0, 0.0)), 0.0);
        let mut actuator = EMA_48;
        actuator.controller.position_sensor = PositionSensor::MotorShaft;
        let mut cascade = Cascade::new(&actuator, &Scenario::chirp());
        let held_rad = 1e-3 * actuator.transmission.gear_ratio;
        assert_abs_diff_eq!(cascade.step(1e-3, &at(7.0, held_rad, 0.0)), 0.0, epsilon = 1e-15);
    }

    #[test]
    fn law_speed_mode_with_all_three_gains() {
        let mut actuator = EMA_48;
        actuator.controller.speed_derivative_a_s2_per_rad = 2e-5;
        let law = actuator.controller;
        let scenario = Scenario { mode: ControlMode::Speed, ..Scenario::chirp() };
        let mut cascade = Cascade::new(&actuator, &scenario);
        // errors of 10 and 13 rad/s: the surface's speed times the gear less the motor's
        let first = cascade.step(0.02, &at(0.3, 5.0, 0.0));
        let second = cascade.step(0.02, &at(0.3, 5.0, -3.0));
        let (p, i) = (law.speed_gain_a_s_per_rad, law.speed_integral_a_per_rad);
        assert_abs_diff_eq!(first, p * 10.0, epsilon = ROUNDING);
        let wanted = p * 13.0 + i * 10.0 * 1e-4 + 2e-5 * (13.0 - 10.0) * 1e4;
        assert_abs_diff_eq!(second, wanted, epsilon = ROUNDING);
    }

    #[test]
    fn the_integral_rests_while_saturated() {
        let mut cascade = Cascade::new(&EMA_48, &Scenario::chirp());
        for _ in 0..1000 {
            assert_eq!(cascade.step(0.3, &at(0.0, 0.0, 0.0)), EMA_48.controller.current_limit_a);
        }
        assert_eq!(cascade.integral_a, 0.0);
    }
}
