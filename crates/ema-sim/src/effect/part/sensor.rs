//! Sensors that show something else than what they measure.

use libm::exp;

use crate::{lane_sine::sincos_of, quantisation::quantised};

/// A wave of the shown position over the motor's angle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PositionWave {
    pub(crate) sin_rad: f64,
    pub(crate) cos_rad: f64,
    /// Periods in a turn of the motor.
    pub(crate) order: f64,
}

impl PositionWave {
    /// The error at an angle of the motor.
    pub(crate) fn at(&self, motor_rad: f64) -> f64 {
        let (sin, cos) = sincos_of(self.order * motor_rad);
        self.sin_rad * sin + self.cos_rad * cos
    }
}

/// The sensor of the current: `τ·y' = (1 + g)·I + o − y`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CurrentSensor {
    pub(crate) gain_error_ratio: f64,
    pub(crate) offset_a: f64,
    pub(crate) lag_s: f64,
    /// True where the current loop uses this sensor.
    pub(crate) in_loop: bool,
    /// Current shown last.
    pub(crate) shown_a: Option<f64>,
}

impl CurrentSensor {
    /// The current shown a period after it was read last.
    pub(crate) fn read_a(&mut self, current_a: f64, period_s: f64) -> f64 {
        let seen = (1.0 + self.gain_error_ratio) * current_a + self.offset_a;
        let before = self.shown_a.unwrap_or(seen);
        let shown = lagging(before, seen, self.lag_s, period_s);
        self.shown_a = Some(shown);
        shown
    }

    /// The current that flows when this sensor's reading is held at a set-point.
    pub(crate) fn regulated_a(&self, reference_a: f64) -> f64 {
        if self.in_loop {
            (reference_a - self.offset_a) / (1.0 + self.gain_error_ratio)
        } else {
            reference_a
        }
    }
}

/// The sensor of the surface's position: `τ·y' = θ + a·sin θ_m + b·cos θ_m − y`, in steps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PositionSensor {
    pub(crate) lag_s: f64,
    pub(crate) eccentricity_sin_rad: f64,
    pub(crate) eccentricity_cos_rad: f64,
    pub(crate) step_rad: f64,
    /// Position shown last, before its steps.
    pub(crate) lagged_rad: Option<f64>,
}

impl PositionSensor {
    /// The position shown a tick after it was read last.
    pub(crate) fn read_rad(&mut self, position_rad: f64, motor_rad: f64, tick_s: f64) -> f64 {
        let [a, b] = [self.eccentricity_sin_rad, self.eccentricity_cos_rad];
        let (sin, cos) = if [a, b] == [0.0, 0.0] { (0.0, 1.0) } else { sincos_of(motor_rad) };
        let seen = position_rad + a * sin + b * cos;
        let before = self.lagged_rad.unwrap_or(seen);
        let shown = lagging(before, seen, self.lag_s, tick_s);
        self.lagged_rad = Some(shown);
        quantised(shown, self.step_rad)
    }
}

/// A first-order lag over a tick; without lag the input itself.
fn lagging(before: f64, input: f64, lag_s: f64, tick_s: f64) -> f64 {
    if lag_s > 0.0 { input + (before - input) * exp(-tick_s / lag_s) } else { input }
}
