//! E14, torque constant lower than thought.

use crate::effect::{
    capabilities::ModelCapabilities,
    info::{EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::EffectLaw,
    number::{Limit, Size, numbers, size},
    quantity::Quantity,
    rescaling::Rescaling,
};

numbers! {
    /// Numbers of a loss of magnetisation.
    MagnetLoss {
        loss: size(
            ["torque_constant_loss_ratio", "torque_constant_loss_ratio"],
            Quantity::Ratio,
            Size { least: -0.5, most: 0.9, typical: |_| 0.01, limit: Limit::Catalogue },
            "a",
        ),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E14",
    name: "magnet loss",
    port: Port::MotorTorque,
    class: EffectClass::Gain,
    equation: "k → k·(1 − a), torque and back-EMF; the controller keeps its gains",
    parameters: MagnetLoss::NUMBERS,
    mimics: "k3 to k5 alike, load scale",
    separated_by: "a step of known load",
    source: "NdFeB −0.1 %/K: Modelica Magnetic.FluxTubes, HardMagnetic.NdFeB",
    repetition: Repetition::Once,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

impl EffectLaw for MagnetLoss {
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

    fn rescale(&self, machine: &mut Rescaling) {
        machine.torque_constant_ratio *= 1.0 - self.loss;
    }
}
