//! E24, torque missing after commutation.

use crate::effect::{
    capabilities::{Commutated, ModelCapabilities, NO_COMMUTATION, NO_SECTORS, WindingModel},
    info::{CHOICE, EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::{EffectLaw, Function},
    number::{Limit, Range, Role, Size, number, numbers, size},
    part::{
        Parts,
        commutation::{longest_span_s, longest_turn_rad},
    },
    quantity::Quantity,
    shaft_load::{Moment, ShaftLoad},
};

numbers! {
    /// Numbers of the commutation's overlap.
    CommutationOverlap {
        dip: size(
            ["commutation_dip_ratio", "commutation_dip_ratio"],
            Quantity::Ratio,
            Size { least: 0.0, most: 1.0, typical: |_| 0.01, limit: Limit::Catalogue },
            "a",
        ),
        time_constant_s: number(
            ["time_constant_s", "time_constant_s"],
            Quantity::Time,
            Range { defaults: [3.4e-4, 3.4e-4], least: 1e-6, most: 1.0 },
            Role::Shape(&[0.3, 1.0, 3.0]),
            "τ, about L/R",
        ),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E24",
    name: "commutation overlap",
    port: Port::MotorTorque,
    class: EffectClass::AnglePeriodic,
    equation: "T_m → T_m·(1 − a·exp(−t_c/τ)), t_c the time since the last commutation",
    parameters: CommutationOverlap::NUMBERS,
    mimics: "E12, viscous drag",
    separated_by: "two speeds",
    source: CHOICE,
    repetition: Repetition::Once,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

const OWN_COMMUTATION: &str = "what commutation takes is a part of the model already";

impl EffectLaw for CommutationOverlap {
    fn refusal(&self, model: &ModelCapabilities) -> Option<&'static str> {
        match (model.commutated, model.winding) {
            (Commutated::Not, _) => Some(NO_COMMUTATION),
            (_, WindingModel::Phases { .. }) => Some(OWN_COMMUTATION),
            (Commutated::Smoothly, _) => Some(NO_SECTORS),
            (Commutated::BySectors, _) => None,
        }
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
        parts.bound_turn_rad(longest_turn_rad(parts.machine.pole_pairs));
        parts.bound_span_s(longest_span_s(self.time_constant_s));
    }

    #[inline]
    fn function(&self) -> Function {
        Function::Exponential
    }

    #[inline]
    fn argument(&self, at: &Moment) -> f64 {
        -at.since_commutation_s / self.time_constant_s
    }

    #[inline]
    fn load(&self, at: &Moment, [decayed, _]: [f64; 2], shaft: &mut ShaftLoad) {
        shaft.against_n_m += at.motor_n_m * (self.dip * decayed);
    }
}
