//! E01, friction that falls with speed.

use crate::effect::{
    capabilities::ModelCapabilities,
    info::{EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::{EffectLaw, Function},
    number::{Limit, MOST, Range, Role, Size, Trials, number, numbers, size},
    power::power,
    quantity::Quantity,
    shaft_load::{Moment, ShaftLoad},
};

numbers! {
    /// Numbers of Stribeck friction.
    Stribeck {
        /// Friction added at standstill.
        added: size(
            ["stribeck_n_m", "stribeck_n"],
            Quantity::Torque,
            Size { least: 0.0, most: MOST, typical: |s| 0.03 * s.torque, limit: Limit::Catalogue },
            "a",
        ),
        /// Speed over which it falls.
        speed: number(
            ["stribeck_speed_rad_per_s", "stribeck_speed_m_per_s"],
            Quantity::Speed,
            Range { defaults: [5.0, 0.02], least: 1e-6, most: 1e6 },
            Role::Shape(&[0.2, 0.5, 1.0, 2.0, 5.0]),
            "ω_s",
        )
        .tried(Trials::OfSpeed(&[0.02, 0.05, 0.15, 0.4])),
        exponent: number(
            ["stribeck_exponent", "stribeck_exponent"],
            Quantity::Number,
            Range { defaults: [1.0, 1.0], least: 0.25, most: 4.0 },
            Role::Shape(&[1.0, 2.0]),
            "d",
        )
        .tried(Trials::Values(&[1.0])),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E01",
    name: "Stribeck friction",
    port: Port::MotorTorque,
    class: EffectClass::FrictionSpeed,
    equation: "T = a·s·exp(−(|ω|/ω_s)^d)",
    parameters: Stribeck::NUMBERS,
    mimics: "k1",
    separated_by: "slow reversals and fast plateaus",
    source: "MuJoCo, DC motor technical note; Duclusaud et al., ICRA 2025",
    repetition: Repetition::Sum,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

impl EffectLaw for Stribeck {
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
    fn function(&self) -> Function {
        Function::Exponential
    }

    #[inline]
    fn argument(&self, at: &Moment) -> f64 {
        -power(at.speed_rad_per_s.abs() / self.speed, self.exponent)
    }

    #[inline]
    fn load(&self, _: &Moment, [decayed, _]: [f64; 2], shaft: &mut ShaftLoad) {
        shaft.rub_in_motion(self.added * decayed);
    }
}
