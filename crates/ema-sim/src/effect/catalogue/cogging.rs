//! E11, torque of a fixed order of the motor angle.

use crate::effect::{
    capabilities::ModelCapabilities,
    info::{EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::{EffectLaw, Function},
    number::{Limit, MOST, Size, cosine, numbers, order, size},
    part::Parts,
    quantity::Quantity,
    shaft_load::{Moment, ShaftLoad},
};

const SIZE: Size =
    Size { least: -MOST, most: MOST, typical: |s| 0.03 * s.torque, limit: Limit::Torque };

numbers! {
    /// Numbers of cogging.
    Cogging {
        sin: size(["cogging_sin_n_m", "cogging_sin_n"], Quantity::Torque, SIZE, "a"),
        cos: cosine(["cogging_cos_n_m", "cogging_cos_n"], Quantity::Torque, SIZE, "b"),
        order: order(24.0),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E11",
    name: "cogging",
    port: Port::MotorTorque,
    class: EffectClass::AnglePeriodic,
    equation: "T = a·sin(n·θ_m) + b·cos(n·θ_m)",
    parameters: Cogging::NUMBERS,
    mimics: "k6, k7",
    separated_by: "a constant slow speed without load",
    source: "MuJoCo, DC motor technical note: 1 to 5 % of the rated torque",
    repetition: Repetition::ByOrder,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

impl EffectLaw for Cogging {
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
        parts.resolve_order(self.order);
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
    fn load(&self, _: &Moment, [sin, cos]: [f64; 2], shaft: &mut ShaftLoad) {
        shaft.against_n_m += self.sin * sin + self.cos * cos;
    }
}
