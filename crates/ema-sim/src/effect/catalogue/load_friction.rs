//! E04, friction with the torque passed on.

use crate::effect::{
    capabilities::ModelCapabilities,
    info::{EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::EffectLaw,
    number::{Limit, Size, numbers, size},
    quantity::Quantity,
    shaft_load::{Moment, ShaftLoad},
};

numbers! {
    /// Numbers of load-dependent friction.
    LoadFriction {
        /// Share of the motor's torque.
        motor_share: size(
            ["motor_share_ratio", "motor_share_ratio"],
            Quantity::Ratio,
            Size { least: 0.0, most: 1.0, typical: |_| 0.01, limit: Limit::Catalogue },
            "a_m",
        ),
        /// Share of the load at the motor's shaft.
        load_share: size(
            ["load_share_ratio", "load_share_ratio"],
            Quantity::Ratio,
            Size { least: 0.0, most: 1.0, typical: |_| 0.01, limit: Limit::Catalogue },
            "a_e",
        ),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E04",
    name: "load-dependent friction",
    port: Port::MotorTorque,
    class: EffectClass::Load,
    equation: "T = s·|a_m·T_m − a_e·T_e|, T_e the load at the motor shaft",
    parameters: LoadFriction::NUMBERS,
    mimics: "k1",
    separated_by: "two levels of load",
    source: "Duclusaud et al., ICRA 2025: 6 to 20 % of the torque",
    repetition: Repetition::Sum,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

impl EffectLaw for LoadFriction {
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

    #[inline]
    fn load(&self, at: &Moment, _: [f64; 2], shaft: &mut ShaftLoad) {
        shaft.rub((self.motor_share * at.motor_n_m - self.load_share * at.load_n_m).abs());
    }
}
