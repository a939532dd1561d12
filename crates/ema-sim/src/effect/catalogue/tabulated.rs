//! U, a measured curve without a cause.

use crate::effect::{
    capabilities::ModelCapabilities,
    curve::{Coordinate, Curve, CurveKind},
    info::{EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::{EffectLaw, Given},
    number::{EffectParameter, Limit, Size, size},
    part::Parts,
    quantity::{Geometry, Quantity},
    shaft_load::{Moment, ShaftLoad},
};

/// A measured curve, scaled.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tabulated<'a> {
    scale: f64,
    curve: Option<&'a Curve>,
    geometry: Geometry,
}

const NUMBERS: &[EffectParameter] = &[size(
    ["scale_ratio", "scale_ratio"],
    Quantity::Ratio,
    // what the curve amounts to is bounded with the curve
    Size { least: -1e3, most: 1e3, typical: |_| 0.01, limit: Limit::Catalogue },
    "scale of the curve",
)];

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "U",
    name: "tabulated",
    port: Port::MotorTorque,
    class: EffectClass::Unknown,
    equation: "T = scale·y(x) or scale·s·y(x), x the motor angle, speed, position or time",
    parameters: NUMBERS,
    mimics: "whatever its curve is like",
    separated_by: "another coordinate than the curve's",
    source: "measured",
    repetition: Repetition::Sum,
    differs_by_recording: false,
    nonlinear_in_size: false,
    acts_through: LoopPart::Machine,
    takes_curve: true,
};

impl<'a> Tabulated<'a> {
    #[inline]
    pub(super) fn of(given: &Given<'a>) -> Self {
        let [scale, ..] = *given.values;
        Self { scale, curve: given.curve, geometry: given.geometry }
    }
}

impl EffectLaw for Tabulated<'_> {
    fn refusal(&self, _: &ModelCapabilities) -> Option<&'static str> {
        None
    }

    fn idle(&self, _: &ModelCapabilities) -> Option<&'static str> {
        None
    }

    fn can_feed(&self) -> bool {
        self.curve.is_some_and(|curve| curve.can_feed(self.scale))
    }

    fn rubs(&self) -> bool {
        self.curve.is_some_and(|curve| curve.kind() == CurveKind::Friction)
    }

    fn install(&self, parts: &mut Parts) {
        let Some(curve) = self.curve else { return };
        let spacing = curve.spacing();
        match curve.over() {
            Coordinate::MotorAngle => parts.bound_turn_rad(spacing),
            Coordinate::Position => parts.bound_turn_rad(spacing / parts.machine.per_gear_ratio),
            Coordinate::Time => parts.bound_span_s(spacing),
            Coordinate::Speed => {}
        }
    }

    #[inline]
    fn load(&self, at: &Moment, _: [f64; 2], shaft: &mut ShaftLoad) {
        let Some(curve) = self.curve else { return };
        let y = self.scale
            * match curve.over() {
                Coordinate::MotorAngle if self.geometry == Geometry::Rotary => {
                    curve.around(at.motor_rad)
                }
                Coordinate::MotorAngle => curve.at(at.motor_rad),
                Coordinate::Speed => curve.at(at.speed_rad_per_s),
                Coordinate::Position => curve.at(at.position_rad),
                Coordinate::Time => curve.at(at.time_s),
            };
        match curve.kind() {
            CurveKind::Torque => shaft.against_n_m += y,
            CurveKind::Friction => shaft.rub(y),
        }
    }
}
