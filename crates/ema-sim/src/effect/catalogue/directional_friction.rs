//! E03, friction that differs between the directions.

use crate::effect::{
    capabilities::ModelCapabilities,
    info::{EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::EffectLaw,
    number::{Limit, MOST, Size, numbers, size},
    quantity::Quantity,
    shaft_load::{Moment, ShaftLoad},
};

numbers! {
    /// Numbers of direction-dependent friction.
    DirectionalFriction {
        /// Half of the difference of the dry friction between the directions.
        coulomb: size(
            ["coulomb_asymmetry_n_m", "coulomb_asymmetry_n"],
            Quantity::Torque,
            Size { least: -MOST, most: MOST, typical: |s| 0.03 * s.torque, limit: Limit::Torque },
            "a",
        ),
        /// Half of the difference of the drag between the directions.
        viscous: size(
            ["viscous_asymmetry_n_m_s_per_rad", "viscous_asymmetry_n_s_per_m"],
            Quantity::Drag,
            Size {
                least: -MOST,
                most: MOST,
                typical: |s| 0.03 * s.torque / s.positive_speed(),
                limit: Limit::Drag,
            },
            "c",
        ),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E03",
    name: "direction-dependent friction",
    port: Port::MotorTorque,
    class: EffectClass::Asymmetry,
    equation: "T = a·|s| + c·|ω|",
    parameters: DirectionalFriction::NUMBERS,
    mimics: "E19 offset, load bias",
    separated_by: "slow ramps",
    source: "Janot, Gautier, Brunot 2019 (EMPS): 16 % between the directions",
    repetition: Repetition::Sum,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

impl EffectLaw for DirectionalFriction {
    fn refusal(&self, _: &ModelCapabilities) -> Option<&'static str> {
        None
    }

    fn idle(&self, _: &ModelCapabilities) -> Option<&'static str> {
        None
    }

    fn can_feed(&self) -> bool {
        // of one sign in both directions: with the motion in one of them
        self.viscous != 0.0
    }

    fn rubs(&self) -> bool {
        true
    }

    #[inline]
    fn load(&self, at: &Moment, _: [f64; 2], shaft: &mut ShaftLoad) {
        shaft.rub_forward(self.coulomb);
        shaft.against_n_m += self.viscous * at.speed_rad_per_s.abs();
    }
}
