//! E18, supply that sags with current.

use crate::effect::{
    capabilities::{ModelCapabilities, NO_VOLTAGE, WindingModel},
    info::{CHOICE, EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::EffectLaw,
    number::{Limit, Size, numbers, size},
    part::Parts,
    quantity::Quantity,
};

numbers! {
    /// Numbers of the supply's sag.
    BusSag {
        source_ohm: size(
            ["source_resistance_ohm", "source_resistance_ohm"],
            Quantity::Resistance,
            Size { least: 0.0, most: 1e3, typical: |_| 0.05, limit: Limit::Catalogue },
            "R_b",
        ),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E18",
    name: "bus sag",
    port: Port::Electrical,
    class: EffectClass::Electrical,
    equation: "|V| ≤ V_dc − R_b·|I|",
    parameters: BusSag::NUMBERS,
    mimics: "k1 at speed",
    separated_by: "fast moves",
    source: CHOICE,
    repetition: Repetition::Once,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

impl EffectLaw for BusSag {
    fn refusal(&self, model: &ModelCapabilities) -> Option<&'static str> {
        matches!(model.winding, WindingModel::Regulated).then_some(NO_VOLTAGE)
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
        (parts.winding.source_ohm, parts.winding.any) = (self.source_ohm, true);
    }
}
