//! E25, commutation at a wrong angle.

use crate::effect::{
    capabilities::{Commutated, ModelCapabilities, NO_COMMUTATION, NO_SECTORS},
    info::{CHOICE, EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::EffectLaw,
    number::{Limit, Size, numbers, size},
    part::{Parts, commutation::longest_turn_rad},
    quantity::Quantity,
};

numbers! {
    /// Numbers of a commutation at a wrong angle.
    HallOffset {
        offset_rad: size(
            ["hall_offset_rad", "hall_offset_rad"],
            Quantity::ElectricalAngle,
            Size { least: -0.5, most: 0.5, typical: |_| 0.05, limit: Limit::Catalogue },
            "d, electrical",
        ),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E25",
    name: "commutation (Hall) offset",
    port: Port::Sensor,
    class: EffectClass::AnglePeriodic,
    equation: "sector of θ_e + d in place of θ_e",
    parameters: HallOffset::NUMBERS,
    mimics: "k3 to k5, E14",
    separated_by: "both directions of rotation",
    source: CHOICE,
    repetition: Repetition::Once,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

impl EffectLaw for HallOffset {
    fn refusal(&self, model: &ModelCapabilities) -> Option<&'static str> {
        match model.commutated {
            Commutated::Not => Some(NO_COMMUTATION),
            Commutated::Smoothly => Some(NO_SECTORS),
            Commutated::BySectors => None,
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
        let errors = parts.commutation_errors();
        errors.shaped = true;
        errors.offset_rad = self.offset_rad;
    }
}
