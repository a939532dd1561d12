//! E19, gain, offset and lag of the current sensor.

use crate::effect::{
    capabilities::{Legs, ModelCapabilities, WindingModel},
    info::{CHOICE, EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::EffectLaw,
    number::{Limit, Range, Role, Size, number, numbers, size},
    part::{Parts, sensor},
    quantity::Quantity,
};

numbers! {
    /// Numbers of the current's sensor.
    CurrentSensor {
        gain_error: size(
            ["gain_error_ratio", "gain_error_ratio"],
            Quantity::Ratio,
            Size { least: -0.5, most: 0.5, typical: |_| 0.01, limit: Limit::Catalogue },
            "g",
        ),
        offset_a: size(
            ["offset_a", "offset_a"],
            Quantity::Current,
            Size {
                least: -1e3,
                most: 1e3,
                typical: |s| 0.03 * s.drive,
                limit: Limit::ControllerOutput,
            },
            "o",
        ),
        lag_s: size(
            ["lag_s", "lag_s"],
            Quantity::Time,
            Size { least: 0.0, most: 1.0, typical: |s| 0.3 * s.sample_s, limit: Limit::Catalogue },
            "τ, of what is shown",
        ),
        in_loop: number(
            ["in_loop", "in_loop"],
            Quantity::Number,
            Range { defaults: [0.0, 0.0], least: 0.0, most: 1.0 },
            Role::Switch,
            "1 where the current loop uses this sensor",
        ),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E19",
    name: "current sensor",
    port: Port::Sensor,
    class: EffectClass::Sensor,
    equation: "τ·y' = (1 + g)·I + o − y; in the loop I = (I_ref − o)/(1 + g)",
    parameters: CurrentSensor::NUMBERS,
    mimics: "E14, E03",
    separated_by: "standstill, slow ramps",
    source: CHOICE,
    repetition: Repetition::Once,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

const NO_CURRENT_LOOP: &str = "the comparators see the phases themselves, not this sensor";
const UNMEASURED: &str = "the drive's current is not recorded: outside its loop (`in-loop = 1`) \
                          its sensor changes nothing";
const UNMEASURED_LAG: &str = "the drive's current is not recorded: `lag-s` of its sensor, of what \
                              is shown, changes nothing";

impl CurrentSensor {
    fn is_in_loop(&self) -> bool {
        self.in_loop > 0.5
    }
}

impl EffectLaw for CurrentSensor {
    fn refusal(&self, model: &ModelCapabilities) -> Option<&'static str> {
        let compared = matches!(model.winding, WindingModel::Phases { legs: Legs::Compared, .. });
        (compared && self.is_in_loop()).then_some(NO_CURRENT_LOOP)
    }

    fn idle(&self, model: &ModelCapabilities) -> Option<&'static str> {
        if model.current_recorded {
            None
        } else if self.is_in_loop() {
            (self.lag_s != 0.0).then_some(UNMEASURED_LAG)
        } else {
            Some(UNMEASURED)
        }
    }

    fn can_feed(&self) -> bool {
        false
    }

    fn rubs(&self) -> bool {
        false
    }

    fn install(&self, parts: &mut Parts) {
        parts.current_sensor = Some(sensor::CurrentSensor {
            gain_error_ratio: self.gain_error,
            offset_a: self.offset_a,
            lag_s: self.lag_s,
            in_loop: self.is_in_loop(),
            shown_a: None,
        });
    }
}
