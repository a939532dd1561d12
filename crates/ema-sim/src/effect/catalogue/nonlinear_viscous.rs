//! E02, friction with a power of speed.

use crate::effect::{
    capabilities::ModelCapabilities,
    info::{EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::EffectLaw,
    number::{Limit, MOST, Range, Role, Size, Trials, number, numbers, size},
    power::power,
    quantity::Quantity,
    shaft_load::{Moment, ShaftLoad},
};

numbers! {
    /// Numbers of non-linear viscous friction.
    NonlinearViscous {
        /// Friction at the reference speed.
        at_reference: size(
            ["viscous_at_reference_n_m", "viscous_at_reference_n"],
            Quantity::Torque,
            Size { least: -MOST, most: MOST, typical: |s| 0.03 * s.torque, limit: Limit::Torque },
            "a",
        ),
        reference_speed: number(
            ["reference_speed_rad_per_s", "reference_speed_m_per_s"],
            Quantity::Speed,
            Range { defaults: [100.0, 0.1], least: 1e-6, most: 1e6 },
            Role::Shape(&[1.0]),
            "ω_0, fixes the unit of a",
        )
        .tried(Trials::OfSpeed(&[1.0])),
        exponent: number(
            ["viscous_exponent", "viscous_exponent"],
            Quantity::Number,
            Range { defaults: [2.0, 2.0], least: 0.3, most: 2.5 },
            Role::Shape(&[0.25, 0.5, 0.75, 1.0, 1.25]),
            "n",
        )
        .tried(Trials::Values(&[0.5, 1.5, 2.0, 2.5])),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E02",
    name: "non-linear viscous friction",
    port: Port::MotorTorque,
    class: EffectClass::FrictionSpeed,
    equation: "T = a·s·(|ω|/ω_0)^n",
    parameters: NonlinearViscous::NUMBERS,
    mimics: "k1, viscous drag",
    separated_by: "a wide range of speed",
    source: "shear thinning and churning of grease; the project's choice of form",
    repetition: Repetition::Sum,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

impl EffectLaw for NonlinearViscous {
    fn refusal(&self, _: &ModelCapabilities) -> Option<&'static str> {
        None
    }

    fn idle(&self, _: &ModelCapabilities) -> Option<&'static str> {
        None
    }

    fn can_feed(&self) -> bool {
        self.at_reference < 0.0
    }

    fn rubs(&self) -> bool {
        false
    }

    #[inline]
    fn load(&self, at: &Moment, _: [f64; 2], shaft: &mut ShaftLoad) {
        let (a, w) = (self.at_reference, at.speed_rad_per_s);
        let size = a * power(w.abs() / self.reference_speed, self.exponent);
        shaft.against_n_m += size.copysign(w * a);
    }
}
