//! What of a machine an effect needs to have something to act on.
//!
//! An effect whose number would change nothing is refused by name, so that nobody takes its
//! silence for an answer. One whose sizes are all zero is never refused for it.

use super::{CurveKind, Effect, EffectError, EffectId};

/// What a machine has, and what of it is seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footing {
    /// Gains that E21 scales: position, speed, integral of the speed.
    pub(crate) gains: [f64; 3],
    /// Whether anything rubs besides effects.
    pub(crate) dry_friction: bool,
    /// Whether a drive without a winding makes the current.
    pub(crate) regulated: bool,
    /// Whether that current is measured.
    pub(crate) measured: bool,
}

const NO_INDUCTANCE: &str = "the drive regulates the current, and `inductance-henry` has no voltage to \
                             act on; the eddy loss alone acts";
const UNMEASURED: &str = "the drive's current is not recorded: outside its loop (`in-loop = 1`) \
                          its sensor changes nothing";
const UNMEASURED_LAG: &str = "the drive's current is not recorded: `lag-s` of its sensor, of what \
                              is shown, changes nothing";
const NO_POSITION_GAIN: &str =
    "the controller has no position gain, and `position-gain-error-ratio` scales nothing";
const NO_SPEED_GAIN: &str =
    "the controller has no speed gain, and `speed-gain-error-ratio` scales nothing";
const NO_INTEGRAL: &str =
    "the controller has no integral part, and `integral-error-ratio` scales nothing";
const NO_FRICTION: &str = "the machine has no dry friction that it could change";

impl Footing {
    /// Refuses an effect of which a number changes nothing; `all` are those of the model.
    pub(crate) fn check(
        &self,
        effect: &Effect,
        all: &[Effect],
        model: &'static str,
    ) -> Result<(), EffectError> {
        match self.missing(effect, all) {
            Some(reason) if !effect.is_off() => {
                Err(EffectError::NotInModel { effect: effect.id(), model, reason })
            }
            _ => Ok(()),
        }
    }

    fn missing(&self, effect: &Effect, all: &[Effect]) -> Option<&'static str> {
        let v = effect.values();
        match effect.id() {
            EffectId::InductanceEddy => (self.regulated && v[0] != 0.0).then_some(NO_INDUCTANCE),
            EffectId::CurrentSensor if self.measured => None,
            EffectId::CurrentSensor if v[3] <= 0.5 => Some(UNMEASURED),
            EffectId::CurrentSensor => (v[2] != 0.0).then_some(UNMEASURED_LAG),
            EffectId::ControllerMismatch => {
                let reasons = [NO_POSITION_GAIN, NO_SPEED_GAIN, NO_INTEGRAL];
                let mut parts = v.iter().zip(self.gains).zip(reasons);
                let idle = |((error, gain), _): &((&f64, f64), _)| **error != 0.0 && *gain == 0.0;
                parts.find(idle).map(|(_, reason)| reason)
            }
            EffectId::FrictionDrift => (!self.dry_friction).then_some(NO_FRICTION),
            EffectId::Presliding => {
                (!self.dry_friction && !all.iter().any(rubs)).then_some(NO_FRICTION)
            }
            _ => None,
        }
    }
}

/// Whether an effect adds dry friction.
fn rubs(effect: &Effect) -> bool {
    let adds = match effect.id() {
        EffectId::Stribeck
        | EffectId::DirectionalFriction
        | EffectId::LoadFriction
        | EffectId::WornRegion => true,
        EffectId::Tabulated => {
            effect.curve().is_some_and(|curve| curve.kind() == CurveKind::Friction)
        }
        _ => false,
    };
    adds && !effect.is_off()
}
