//! E07, friction that falls as the machine warms.

use crate::effect::{
    capabilities::ModelCapabilities,
    info::{CHOICE, EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::{EffectLaw, Function},
    number::{Limit, Range, Role, Size, number, numbers, size},
    quantity::Quantity,
    shaft_load::{Moment, ShaftLoad},
};

numbers! {
    /// Numbers of friction drift.
    FrictionDrift {
        /// Share of the dry friction that is lost in the end.
        drop: size(
            ["friction_drop_ratio", "friction_drop_ratio"],
            Quantity::Ratio,
            Size { least: -1.0, most: 1.0, typical: |_| 0.01, limit: Limit::Catalogue },
            "a",
        ),
        time_constant_s: number(
            ["time_constant_s", "time_constant_s"],
            Quantity::Time,
            Range { defaults: [10.0, 10.0], least: 1e-3, most: 1e6 },
            Role::Shape(&[0.1, 0.3, 1.0, 3.0, 10.0]),
            "τ",
        ),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E07",
    name: "friction drift",
    port: Port::MotorTorque,
    class: EffectClass::Time,
    equation: "F → F·(1 − a·(1 − exp(−t/τ)))",
    parameters: FrictionDrift::NUMBERS,
    mimics: "k1",
    separated_by: "the same move cold and warm",
    source: CHOICE,
    repetition: Repetition::Sum,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

const NO_FRICTION: &str = "the machine has no dry friction that it could change";

impl EffectLaw for FrictionDrift {
    fn refusal(&self, _: &ModelCapabilities) -> Option<&'static str> {
        None
    }

    fn idle(&self, model: &ModelCapabilities) -> Option<&'static str> {
        (!model.dry_friction).then_some(NO_FRICTION)
    }

    fn can_feed(&self) -> bool {
        false
    }

    fn rubs(&self) -> bool {
        false
    }

    #[inline]
    fn function(&self) -> Function {
        Function::Exponential
    }

    #[inline]
    fn argument(&self, at: &Moment) -> f64 {
        -at.time_s / self.time_constant_s
    }

    #[inline]
    fn load(&self, _: &Moment, [decayed, _]: [f64; 2], shaft: &mut ShaftLoad) {
        shaft.friction_ratio *= 1.0 - self.drop * (1.0 - decayed);
    }
}
