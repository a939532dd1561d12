//! E21, gains, limit and delay of the controller.

use crate::effect::{
    capabilities::ModelCapabilities,
    info::{CHOICE, EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::EffectLaw,
    number::{Limit, Size, numbers, size},
    part::{Parts, delay::Delay},
    quantity::Quantity,
    rescaling::Rescaling,
};

const GAIN: Size = Size { least: -0.9, most: 9.0, typical: |_| 0.01, limit: Limit::Catalogue };

numbers! {
    /// Numbers of a controller's mismatch.
    ControllerMismatch {
        position_gain_error: size(
            ["position_gain_error_ratio", "position_gain_error_ratio"],
            Quantity::Ratio,
            GAIN,
            "e of the position gains",
        ),
        speed_gain_error: size(
            ["speed_gain_error_ratio", "speed_gain_error_ratio"],
            Quantity::Ratio,
            GAIN,
            "e of the speed gain",
        ),
        integral_error: size(
            ["integral_error_ratio", "integral_error_ratio"],
            Quantity::Ratio,
            Size { least: -1.0, ..GAIN },
            "e of the speed integral",
        ),
        limit_error: size(
            ["limit_error_ratio", "limit_error_ratio"],
            Quantity::Ratio,
            GAIN,
            "e of the output limit",
        ),
        delay_s: size(
            ["delay_s", "delay_s"],
            Quantity::Time,
            Size { least: 0.0, most: 0.1, typical: |s| 0.3 * s.sample_s, limit: Limit::Catalogue },
            "T_d",
        ),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E21",
    name: "controller mismatch",
    port: Port::Controller,
    class: EffectClass::Controller,
    equation: "gains and limit times (1 + e); its output acts T_d later",
    parameters: ControllerMismatch::NUMBERS,
    mimics: "any",
    separated_by: "the controller replayed on what it measured",
    source: CHOICE,
    repetition: Repetition::Once,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Controller,
    takes_curve: false,
};

const NO_POSITION_GAIN: &str =
    "the controller has no position gain, and `position-gain-error-ratio` scales nothing";
const NO_SPEED_GAIN: &str =
    "the controller has no speed gain, and `speed-gain-error-ratio` scales nothing";
const NO_INTEGRAL: &str =
    "the controller has no integral part, and `integral-error-ratio` scales nothing";

impl EffectLaw for ControllerMismatch {
    fn refusal(&self, _: &ModelCapabilities) -> Option<&'static str> {
        None
    }

    fn idle(&self, model: &ModelCapabilities) -> Option<&'static str> {
        let errors = [self.position_gain_error, self.speed_gain_error, self.integral_error];
        let reasons = [NO_POSITION_GAIN, NO_SPEED_GAIN, NO_INTEGRAL];
        let mut parts = errors.into_iter().zip(model.gains).zip(reasons);
        parts.find(|((error, gain), _)| *error != 0.0 && *gain == 0.0).map(|(_, reason)| reason)
    }

    fn can_feed(&self) -> bool {
        false
    }

    fn rubs(&self) -> bool {
        false
    }

    fn rescale(&self, machine: &mut Rescaling) {
        machine.position_gain_ratio *= 1.0 + self.position_gain_error;
        machine.speed_gain_ratio *= 1.0 + self.speed_gain_error;
        machine.speed_integral_ratio *= 1.0 + self.integral_error;
        machine.output_limit_ratio *= 1.0 + self.limit_error;
    }

    fn install(&self, parts: &mut Parts) {
        if self.delay_s > 0.0 {
            parts.delay = Some(Delay::new(self.delay_s, parts.machine.tick_s));
        }
    }
}
