//! E10, gravity, imbalance, springs.

use crate::effect::{
    capabilities::ModelCapabilities,
    info::{CHOICE, EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::{EffectLaw, Function},
    number::{Limit, MOST, Size, cosine, numbers, size},
    quantity::Quantity,
    shaft_load::{Moment, ShaftLoad},
};

const WEIGHT: Size =
    Size { least: -MOST, most: MOST, typical: |s| 0.03 * s.torque, limit: Limit::Torque };

numbers! {
    /// Numbers of gravity, imbalance and springs.
    Imbalance {
        sin: size(["imbalance_sin_n_m", "imbalance_sin_n"], Quantity::Torque, WEIGHT, "a"),
        cos: cosine(["imbalance_cos_n_m", "imbalance_cos_n"], Quantity::Torque, WEIGHT, "b"),
        /// Torque over the surface's position.
        spring: size(
            ["spring_n_m_per_rad", "spring_n_per_m"],
            Quantity::Stiffness,
            Size {
                least: -MOST,
                most: MOST,
                typical: |s| 0.03 * s.torque / s.positive_travel(),
                limit: Limit::Spring,
            },
            "c",
        ),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E10",
    name: "gravity, imbalance, spring",
    port: Port::MotorTorque,
    class: EffectClass::Position,
    equation: "T = a·sin θ + b·cos θ + c·θ (θ in rad; of a linear axis in m)",
    parameters: Imbalance::NUMBERS,
    mimics: "load",
    separated_by: "a slow full stroke",
    source: CHOICE,
    repetition: Repetition::Sum,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

impl EffectLaw for Imbalance {
    fn refusal(&self, _: &ModelCapabilities) -> Option<&'static str> {
        None
    }

    fn idle(&self, _: &ModelCapabilities) -> Option<&'static str> {
        None
    }

    fn can_feed(&self) -> bool {
        [self.sin, self.cos] != [0.0; 2] || self.spring < 0.0
    }

    fn rubs(&self) -> bool {
        false
    }

    #[inline]
    fn function(&self) -> Function {
        Function::Sine
    }

    #[inline]
    fn argument(&self, at: &Moment) -> f64 {
        at.position_rad
    }

    #[inline]
    fn load(&self, at: &Moment, [sin, cos]: [f64; 2], shaft: &mut ShaftLoad) {
        let position = at.position_rad;
        shaft.against_n_m += self.sin * sin + self.cos * cos + self.spring * position;
    }
}
