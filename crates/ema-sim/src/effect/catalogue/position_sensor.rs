//! E20, lag, eccentricity and steps of the position sensor.

use crate::effect::{
    capabilities::ModelCapabilities,
    info::{EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::EffectLaw,
    number::{Limit, Size, cosine, numbers, size},
    part::{Parts, sensor},
    quantity::Quantity,
};

const ECCENTRICITY: Size =
    Size { least: -1.0, most: 1.0, typical: |s| 3e-4 * s.travel, limit: Limit::Catalogue };

numbers! {
    /// Numbers of the position's sensor.
    PositionSensor {
        lag_s: size(
            ["lag_s", "lag_s"],
            Quantity::Time,
            Size { least: 0.0, most: 1.0, typical: |s| 0.3 * s.sample_s, limit: Limit::Catalogue },
            "τ",
        ),
        eccentricity_sin: size(
            ["eccentricity_sin_rad", "eccentricity_sin_m"],
            Quantity::Angle,
            ECCENTRICITY,
            "a",
        ),
        eccentricity_cos: cosine(
            ["eccentricity_cos_rad", "eccentricity_cos_m"],
            Quantity::Angle,
            ECCENTRICITY,
            "b",
        ),
        step: size(
            ["step_rad", "step_m"],
            Quantity::Angle,
            Size { least: 0.0, most: 1.0, typical: |s| 3e-4 * s.travel, limit: Limit::Catalogue },
            "q",
        ),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E20",
    name: "position sensor",
    port: Port::Sensor,
    class: EffectClass::Sensor,
    equation: "τ·y' = θ + a·sin θ_m + b·cos θ_m − y, in steps of q",
    parameters: PositionSensor::NUMBERS,
    mimics: "k2, k6",
    separated_by: "a chirp",
    source: "SimpleFOC, calibrated sensor: eccentric magnets",
    repetition: Repetition::Once,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Controller,
    takes_curve: false,
};

const MOTOR_ENCODER: &str = "the loop is closed on the motor's shaft, not on the surface";

impl EffectLaw for PositionSensor {
    fn refusal(&self, model: &ModelCapabilities) -> Option<&'static str> {
        model.encoder_on_motor.then_some(MOTOR_ENCODER)
    }

    fn idle(&self, _: &ModelCapabilities) -> Option<&'static str> {
        None
    }

    fn can_feed(&self) -> bool {
        false
    }

    fn rubs(&self) -> bool {
        false
    }

    fn error_of_position(&self, position: f64) -> f64 {
        let (sin, cos) = libm::sincos(position);
        self.eccentricity_sin * sin + self.eccentricity_cos * cos
    }

    fn install(&self, parts: &mut Parts) {
        parts.position_sensor = Some(sensor::PositionSensor {
            lag_s: self.lag_s,
            eccentricity_sin_rad: self.eccentricity_sin,
            eccentricity_cos_rad: self.eccentricity_cos,
            step_rad: self.step,
            lagged_rad: None,
        });
    }
}
