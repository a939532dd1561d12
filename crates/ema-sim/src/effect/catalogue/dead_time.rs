//! E17, voltage lost in the inverter.

use crate::effect::{
    capabilities::{Legs, ModelCapabilities, NO_VOLTAGE, WindingModel},
    info::{EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::EffectLaw,
    number::{Limit, Range, Role, Size, number, numbers, size},
    part::Parts,
    quantity::Quantity,
    rescaling::Rescaling,
};

numbers! {
    /// Numbers of the inverter's dead time.
    DeadTime {
        lost_v: size(
            ["dead_time_v", "dead_time_v"],
            Quantity::Voltage,
            Size { least: 0.0, most: 1e3, typical: |_| 0.1, limit: Limit::Supply },
            "V_d = V_dc·t_d·f_sw",
        ),
        /// Current from which on all of it is lost.
        current_a: number(
            ["dead_time_current_a", "dead_time_current_a"],
            Quantity::Current,
            Range { defaults: [0.1, 0.1], least: 1e-6, most: 1e3 },
            Role::Shape(&[0.3, 1.0, 3.0]),
            "I_0",
        ),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E17",
    name: "inverter dead time",
    port: Port::Electrical,
    class: EffectClass::Electrical,
    equation: "V → V − V_d·tanh(I/I_0)",
    parameters: DeadTime::NUMBERS,
    mimics: "resistance",
    separated_by: "reversals at low current",
    source: "gym-electric-motor, interlocking term of its converters",
    repetition: Repetition::Once,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

const NO_CARRIER: &str = "without a carrier that switches, its legs have no dead time";
const LONG_DEAD_TIME: &str = "the voltage is lost by a dead time longer than a tenth of a period";

impl EffectLaw for DeadTime {
    fn refusal(&self, model: &ModelCapabilities) -> Option<&'static str> {
        match model.winding {
            WindingModel::Regulated => Some(NO_VOLTAGE),
            WindingModel::Quasistatic => None,
            WindingModel::Phases {
                legs: Legs::Switched { dead_s, lost_v_per_s, most_dead_s },
                ..
            } => (dead_s + self.lost_v / lost_v_per_s > most_dead_s).then_some(LONG_DEAD_TIME),
            WindingModel::Phases { .. } => Some(NO_CARRIER),
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

    /// High fidelity: a dead time that loses the voltage on average.
    fn rescale(&self, machine: &mut Rescaling) {
        machine.lost_v += self.lost_v;
    }

    /// Low fidelity: a voltage against the current.
    fn install(&self, parts: &mut Parts) {
        let w = &mut parts.winding;
        (w.dead_v, w.dead_a, w.any) = (self.lost_v, self.current_a, true);
    }
}
