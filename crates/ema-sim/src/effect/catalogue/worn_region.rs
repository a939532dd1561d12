//! E06, friction of a worn region.

use crate::effect::{
    capabilities::ModelCapabilities,
    info::{CHOICE, EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::{EffectLaw, Function},
    number::{Limit, MOST, Range, Role, Size, number, numbers, size},
    part::{LONGEST_PHASE_RAD, Parts},
    quantity::Quantity,
    shaft_load::{Moment, ShaftLoad},
};

numbers! {
    /// Numbers of a worn region.
    WornRegion {
        /// Friction added in the middle of the region.
        added: size(
            ["worn_n_m", "worn_n"],
            Quantity::Torque,
            Size { least: -MOST, most: MOST, typical: |s| 0.03 * s.torque, limit: Limit::Catalogue },
            "a",
        ),
        centre: number(
            ["centre_rad", "centre_m"],
            Quantity::Angle,
            Range { defaults: [0.0, 0.0], least: -1e6, most: 1e6 },
            Role::Place,
            "c",
        ),
        width: number(
            ["width_rad", "width_m"],
            Quantity::Angle,
            Range { defaults: [0.02, 0.02], least: 1e-6, most: 1e6 },
            Role::Shape(&[0.2, 0.5, 1.0, 2.0, 5.0]),
            "w",
        ),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E06",
    name: "worn region",
    port: Port::MotorTorque,
    class: EffectClass::Position,
    equation: "T = a·s·exp(−((θ − c)/w)²/2)",
    parameters: WornRegion::NUMBERS,
    mimics: "k1",
    separated_by: "a slow full stroke, both ways",
    source: CHOICE,
    repetition: Repetition::Sum,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

impl EffectLaw for WornRegion {
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
        true
    }

    fn install(&self, parts: &mut Parts) {
        let motor_width = self.width / parts.machine.per_gear_ratio;
        parts.bound_turn_rad(LONGEST_PHASE_RAD * motor_width);
    }

    #[inline]
    fn function(&self) -> Function {
        Function::Exponential
    }

    #[inline]
    fn argument(&self, at: &Moment) -> f64 {
        let off = (at.position_rad - self.centre) / self.width;
        -0.5 * off * off
    }

    #[inline]
    fn load(&self, _: &Moment, [decayed, _]: [f64; 2], shaft: &mut ShaftLoad) {
        shaft.rub(self.added * decayed);
    }
}
