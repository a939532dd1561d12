//! Effects that a model takes, and those that it refuses by name.

use crate::effect::{
    capabilities::{Bound, ModelCapabilities},
    curve::CurveKind,
    error::EffectError,
    info::Repetition,
    instance::Effect,
    number::MOST,
};

const FRICTION: &str = "times its curve, the friction that any effect may have";

impl ModelCapabilities {
    /// Refuses effects that the model has no place for, that are stronger than it can be simulated
    /// with, or that have a number which would change nothing.
    ///
    /// An effect whose sizes are all zero is never refused for changing nothing.
    pub(crate) fn check(mut self, effects: &[Effect]) -> Result<(), EffectError> {
        self.rubbing_effect = effects.iter().any(Effect::rubs);
        for (place, effect) in effects.iter().enumerate() {
            let id = effect.id();
            if effect.geometry() != self.geometry {
                return Err(EffectError::WrongGeometry { effect: id, found: effect.geometry() });
            }
            let refused = |reason| EffectError::NotInModel { effect: id, model: self.name, reason };
            if let Some(reason) = effect.law(|law| law.refusal(&self)) {
                return Err(refused(reason));
            }
            let again = effects[..place].iter().any(|earlier| earlier.id() == id);
            if again && id.info().repetition == Repetition::Once {
                return Err(EffectError::Twice { effect: id });
            }
            self.check_sizes(effect)?;
            self.check_curve(effect)?;
            let idle = effect.law(|law| law.idle(&self));
            if let Some(reason) = idle.filter(|_| !effect.is_off()) {
                return Err(refused(reason));
            }
        }
        Ok(())
    }

    /// Refuses a number beyond what the machine can be simulated with.
    fn check_sizes(&self, effect: &Effect) -> Result<(), EffectError> {
        let numbers = effect.id().info().parameters.iter().zip(effect.values());
        for (parameter, &value) in numbers {
            if let Some(Bound { most, reason }) = self.admissible.broken(parameter.limit(), value) {
                let key = parameter.key(effect.geometry());
                let effect = effect.id();
                return Err(EffectError::TooStrong { effect, key, value, most, reason });
            }
        }
        Ok(())
    }

    /// Refuses a measured torque or friction beyond what the machine can be simulated with.
    fn check_curve(&self, effect: &Effect) -> Result<(), EffectError> {
        let Some(curve) = effect.curve() else { return Ok(()) };
        let bound = match curve.kind() {
            CurveKind::Torque => self.admissible.torque_bound(),
            CurveKind::Friction => Bound { most: MOST, reason: FRICTION },
        };
        let (largest, value) = (curve.largest(), effect.values()[0]);
        if value.abs() * largest <= bound.most {
            return Ok(());
        }
        let key = effect.id().info().parameters[0].key(effect.geometry());
        let (effect, most, reason) = (effect.id(), bound.most / largest, bound.reason);
        Err(EffectError::TooStrong { effect, key, value, most, reason })
    }
}
