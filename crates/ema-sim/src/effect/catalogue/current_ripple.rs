//! E12, torque ripple with the current.

use crate::effect::{
    capabilities::ModelCapabilities,
    info::{CHOICE, EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::{EffectLaw, Function},
    number::{Limit, Size, cosine, numbers, order, size},
    part::Parts,
    quantity::Quantity,
    shaft_load::{Moment, ShaftLoad},
};

const SIZE: Size = Size { least: -1.0, most: 1.0, typical: |_| 0.01, limit: Limit::Catalogue };

numbers! {
    /// Numbers of current ripple.
    CurrentRipple {
        sin: size(["ripple_sin_ratio", "ripple_sin_ratio"], Quantity::Ratio, SIZE, "a"),
        cos: cosine(["ripple_cos_ratio", "ripple_cos_ratio"], Quantity::Ratio, SIZE, "b"),
        order: order(24.0),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E12",
    name: "current ripple",
    port: Port::MotorTorque,
    class: EffectClass::AnglePeriodic,
    equation: "T_m → T_m·(1 + a·sin(n·θ_m) + b·cos(n·θ_m))",
    parameters: CurrentRipple::NUMBERS,
    mimics: "k3 to k6",
    separated_by: "a constant slow speed at two loads",
    source: CHOICE,
    repetition: Repetition::ByOrder,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

impl EffectLaw for CurrentRipple {
    fn refusal(&self, _: &ModelCapabilities) -> Option<&'static str> {
        None
    }

    fn idle(&self, _: &ModelCapabilities) -> Option<&'static str> {
        None
    }

    fn can_feed(&self) -> bool {
        // beyond its own size the ripple turns the motor's torque around
        self.sin.hypot(self.cos) > 1.0
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
    fn load(&self, at: &Moment, [sin, cos]: [f64; 2], shaft: &mut ShaftLoad) {
        shaft.against_n_m -= at.motor_n_m * (self.sin * sin + self.cos * cos);
    }
}
