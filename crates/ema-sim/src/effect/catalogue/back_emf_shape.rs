//! E23, shape of the back-EMF.

use crate::{
    effect::{
        capabilities::{Commutated, ModelCapabilities, NO_COMMUTATION, WindingModel},
        info::{EffectClass, EffectInfo, LoopPart, Port, Repetition},
        law::EffectLaw,
        number::{Limit, Size, numbers, size},
        part::{Parts, commutation::longest_turn_rad},
        quantity::Quantity,
    },
    waveform::Waveform,
};

const HARMONIC: Size = Size { least: -0.5, most: 0.5, typical: |_| 0.01, limit: Limit::Catalogue };

numbers! {
    /// Numbers of the back-EMF's shape.
    BackEmfShape {
        flat_loss_rad: size(
            ["flat_loss_rad", "flat_loss_rad"],
            Quantity::ElectricalAngle,
            Size { least: 0.0, most: 1.0, typical: |_| 0.05, limit: Limit::Catalogue },
            "δ, electrical, at each end of the flat top",
        ),
        fifth: size(
            ["fifth_harmonic_ratio", "fifth_harmonic_ratio"],
            Quantity::Ratio,
            HARMONIC,
            "h5",
        ),
        seventh: size(
            ["seventh_harmonic_ratio", "seventh_harmonic_ratio"],
            Quantity::Ratio,
            HARMONIC,
            "h7",
        ),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E23",
    name: "back-EMF shape",
    port: Port::MotorTorque,
    class: EffectClass::AnglePeriodic,
    equation: "f(x) → trapezoid with flat 120° − 2δ + h5·sin 5x + h7·sin 7x, torque and back-EMF",
    parameters: BackEmfShape::NUMBERS,
    mimics: "k3 to k5, E12",
    separated_by: "a constant speed at two loads, the open winding",
    source: "FREEDOM paper's machine is drawn with 120°; real ones have 90° to 120° (choice)",
    repetition: Repetition::Once,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

const FROM_TABLE: &str = "a field-oriented drive takes its shape of back-EMF from a table";
const OWN_SHAPE: &str = "the machine has a shape of back-EMF of its own";

impl EffectLaw for BackEmfShape {
    fn refusal(&self, model: &ModelCapabilities) -> Option<&'static str> {
        match (model.commutated, model.winding) {
            (Commutated::Not, _) => Some(NO_COMMUTATION),
            (Commutated::Smoothly, _) => Some(FROM_TABLE),
            (Commutated::BySectors, WindingModel::Phases { trapezoidal: false, .. }) => {
                Some(OWN_SHAPE)
            }
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
        let errors = parts.commutation_errors();
        errors.shaped = true;
        errors.wave = Waveform {
            flat_loss_rad: self.flat_loss_rad,
            fifth: self.fifth,
            seventh: self.seventh,
        };
    }
}
