//! E16, inductance and eddy currents.

use crate::effect::{
    capabilities::{ModelCapabilities, WindingModel},
    info::{EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::EffectLaw,
    number::{Limit, MOST, Size, numbers, size},
    part::Parts,
    quantity::Quantity,
    shaft_load::{Moment, ShaftLoad},
};

numbers! {
    /// Numbers of inductance and eddy loss.
    InductanceEddy {
        inductance_henry: size(
            ["inductance_henry", "inductance_henry"],
            Quantity::Inductance,
            Size { least: 0.0, most: 10.0, typical: |_| 1e-4, limit: Limit::Catalogue },
            "L of the conducting pair",
        ),
        eddy_drag: size(
            ["eddy_n_m_s_per_rad", "eddy_n_s_per_m"],
            Quantity::Drag,
            Size {
                least: 0.0,
                most: MOST,
                typical: |s| 0.03 * s.torque / s.positive_speed(),
                limit: Limit::Drag,
            },
            "c",
        ),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E16",
    name: "inductance and eddy loss",
    port: Port::Electrical,
    class: EffectClass::Electrical,
    equation: "V = R·I + L·I' + k·ω, T = c·ω",
    parameters: InductanceEddy::NUMBERS,
    mimics: "viscous drag",
    separated_by: "a chirp",
    source: "MuJoCo, DC motor technical note",
    repetition: Repetition::Once,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

const OWN_INDUCTANCE: &str = "its winding has an inductance of its own; the eddy loss alone acts";
const NO_INDUCTANCE: &str = "the drive regulates the current, and `inductance-henry` has no voltage to \
                             act on; the eddy loss alone acts";

/// Share of a tick that a segment with an inductance lasts at most.
const LONGEST_RATIO: f64 = 0.25;

impl EffectLaw for InductanceEddy {
    fn refusal(&self, model: &ModelCapabilities) -> Option<&'static str> {
        let phases = matches!(model.winding, WindingModel::Phases { .. });
        (phases && self.inductance_henry != 0.0).then_some(OWN_INDUCTANCE)
    }

    fn idle(&self, model: &ModelCapabilities) -> Option<&'static str> {
        let regulated = matches!(model.winding, WindingModel::Regulated);
        (regulated && self.inductance_henry != 0.0).then_some(NO_INDUCTANCE)
    }

    fn can_feed(&self) -> bool {
        false
    }

    fn rubs(&self) -> bool {
        false
    }

    fn install(&self, parts: &mut Parts) {
        (parts.winding.inductance_henry, parts.winding.any) = (self.inductance_henry, true);
        if self.inductance_henry > 0.0 {
            parts.bound_span_s(LONGEST_RATIO * parts.machine.tick_s);
        }
    }

    #[inline]
    fn load(&self, at: &Moment, _: [f64; 2], shaft: &mut ShaftLoad) {
        shaft.against_n_m += self.eddy_drag * at.speed_rad_per_s;
    }
}
