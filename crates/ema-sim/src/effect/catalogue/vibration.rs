//! E22, load of a fixed frequency.

use core::f64::consts::TAU;

use crate::effect::{
    capabilities::ModelCapabilities,
    info::{CHOICE, EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::{EffectLaw, Function},
    number::{Limit, MOST, Range, Role, Size, cosine, number, numbers, size},
    part::Parts,
    quantity::Quantity,
    shaft_load::{Moment, ShaftLoad},
};

const SIZE: Size =
    Size { least: -MOST, most: MOST, typical: |s| 0.03 * s.torque, limit: Limit::Torque };

numbers! {
    /// Numbers of a vibration.
    Vibration {
        sin: size(["vibration_sin_n_m", "vibration_sin_n"], Quantity::Torque, SIZE, "a"),
        cos: cosine(["vibration_cos_n_m", "vibration_cos_n"], Quantity::Torque, SIZE, "b"),
        frequency_hz: number(
            ["frequency_hz", "frequency_hz"],
            Quantity::Frequency,
            Range { defaults: [10.0, 10.0], least: 0.0, most: 1e4 },
            Role::Frequency,
            "f",
        ),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E22",
    name: "vibration",
    port: Port::MotorTorque,
    class: EffectClass::TimePeriodic,
    equation: "T = a·sin(2π·f·t) + b·cos(2π·f·t)",
    parameters: Vibration::NUMBERS,
    mimics: "nothing; free in phase between recordings",
    separated_by: "a repeat at another time",
    source: CHOICE,
    repetition: Repetition::Sum,
    // it knows no start of a recording, and has another phase in each
    differs_by_recording: true,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

impl EffectLaw for Vibration {
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

    fn install(&self, parts: &mut Parts) {
        parts.resolve_frequency(TAU * self.frequency_hz);
    }

    #[inline]
    fn function(&self) -> Function {
        Function::Sine
    }

    #[inline]
    fn argument(&self, at: &Moment) -> f64 {
        TAU * self.frequency_hz * at.time_s
    }

    #[inline]
    fn load(&self, _: &Moment, [sin, cos]: [f64; 2], shaft: &mut ShaftLoad) {
        shaft.against_n_m += self.sin * sin + self.cos * cos;
    }
}
