//! E09, error of the gear's ratio over the turn.

use crate::effect::{
    capabilities::ModelCapabilities,
    info::{CHOICE, EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::{EffectLaw, Function},
    number::{Limit, Size, cosine, numbers, order, size},
    part::{Parts, sensor::PositionWave},
    quantity::Quantity,
    shaft_load::{Moment, ShaftLoad},
};

const SIZE: Size =
    Size { least: -1.0, most: 1.0, typical: |s| 3e-4 * s.travel, limit: Limit::Catalogue };

numbers! {
    /// Numbers of a transmission error.
    TransmissionError {
        sin: size(["error_sin_rad", "error_sin_m"], Quantity::Angle, SIZE, "a"),
        cos: cosine(["error_cos_rad", "error_cos_m"], Quantity::Angle, SIZE, "b"),
        order: order(1.0),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E09",
    name: "transmission error",
    port: Port::Transmission,
    class: EffectClass::AnglePeriodic,
    equation: "θ → θ + a·sin(n·θ_m) + b·cos(n·θ_m), and the load's work with it",
    parameters: TransmissionError::NUMBERS,
    mimics: "k6",
    separated_by: "constant speed, both ways",
    source: CHOICE,
    repetition: Repetition::ByOrder,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

impl EffectLaw for TransmissionError {
    fn refusal(&self, _: &ModelCapabilities) -> Option<&'static str> {
        None
    }

    fn idle(&self, _: &ModelCapabilities) -> Option<&'static str> {
        None
    }

    fn can_feed(&self) -> bool {
        [self.sin, self.cos] != [0.0; 2]
    }

    fn rubs(&self) -> bool {
        false
    }

    fn error_of_position(&self, position: f64) -> f64 {
        let (sin, cos) = libm::sincos(self.order * position);
        self.sin * sin + self.cos * cos
    }

    fn install(&self, parts: &mut Parts) {
        parts.resolve_order(self.order);
        let wave = PositionWave { sin_rad: self.sin, cos_rad: self.cos, order: self.order };
        parts.position_waves.push(wave);
    }

    #[inline]
    fn function(&self) -> Function {
        Function::Sine
    }

    #[inline]
    fn argument(&self, at: &Moment) -> f64 {
        self.order * at.motor_rad
    }

    #[inline]
    fn load(&self, at: &Moment, [sin, cos]: [f64; 2], shaft: &mut ShaftLoad) {
        // the load's work on a surface that moves with the error: its slope over the motor's angle
        let slope = self.order * (self.sin * cos - self.cos * sin);
        shaft.against_n_m += slope * at.load_n_m / at.per_gear_ratio;
    }
}
