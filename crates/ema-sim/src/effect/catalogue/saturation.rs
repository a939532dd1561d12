//! E13, torque constant that falls with current.

use crate::effect::{
    capabilities::ModelCapabilities,
    info::{CHOICE, EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::EffectLaw,
    number::{Limit, Size, numbers, size},
    part::Parts,
    quantity::Quantity,
};

numbers! {
    /// Numbers of the torque constant's saturation.
    Saturation {
        per_a2: size(
            ["saturation_per_a2", "saturation_per_a2"],
            Quantity::PerCurrentSquared,
            Size {
                least: 0.0,
                most: 1e3,
                typical: |s| 0.01 / s.positive_drive_squared(),
                limit: Limit::Catalogue,
            },
            "a",
        ),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E13",
    name: "torque constant saturation",
    port: Port::MotorTorque,
    class: EffectClass::Current,
    equation: "k → k·max(1 − a·I², 0.1), torque and back-EMF",
    parameters: Saturation::NUMBERS,
    mimics: "k3 to k5",
    separated_by: "high and low current",
    source: CHOICE,
    repetition: Repetition::Sum,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

impl EffectLaw for Saturation {
    fn refusal(&self, _: &ModelCapabilities) -> Option<&'static str> {
        None
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

    fn install(&self, parts: &mut Parts) {
        parts.saturations_per_a2.push(self.per_a2);
    }
}
