//! E15, resistance that rises with temperature.

use crate::effect::{
    capabilities::{ModelCapabilities, NO_VOLTAGE, WindingModel},
    info::{EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::EffectLaw,
    number::{Limit, Range, Role, Size, number, numbers, size},
    part::Parts,
    quantity::Quantity,
};

numbers! {
    /// Numbers of the resistance's drift.
    ResistanceDrift {
        rise_per_k: size(
            ["resistance_rise_per_k", "resistance_rise_per_k"],
            Quantity::PerKelvin,
            Size { least: 0.0, most: 0.1, typical: |_| 1e-3, limit: Limit::Catalogue },
            "α; copper 0.0039",
        ),
        kelvin_per_w: number(
            ["thermal_resistance_k_per_w", "thermal_resistance_k_per_w"],
            Quantity::ThermalResistance,
            Range { defaults: [3.0, 3.0], least: 0.0, most: 1e4 },
            Role::Shape(&[0.3, 1.0, 3.0]),
            "R_th",
        ),
        time_constant_s: number(
            ["thermal_time_constant_s", "thermal_time_constant_s"],
            Quantity::Time,
            Range { defaults: [30.0, 30.0], least: 1e-2, most: 1e6 },
            Role::Shape(&[0.1, 1.0, 10.0]),
            "τ",
        ),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E15",
    name: "resistance drift",
    port: Port::Electrical,
    class: EffectClass::Electrical,
    equation: "R → R·(1 + α·ΔT), τ·ΔT' = R_th·R·I² − ΔT",
    parameters: ResistanceDrift::NUMBERS,
    mimics: "k3 to k5, with the other sign",
    separated_by: "a held current, then a move",
    source: "MSL Electrical.Machines.Thermal.Constants",
    repetition: Repetition::Once,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

impl EffectLaw for ResistanceDrift {
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
        let w = &mut parts.winding;
        (w.rise_per_k, w.kelvin_per_w) = (self.rise_per_k, self.kelvin_per_w);
        (w.thermal_s, w.any) = (self.time_constant_s, true);
    }
}
