//! Effects and numbers of effects that are refused.

use crate::{
    effect::{catalogue::EffectId, quantity::Geometry},
    number_format::{Expected, Told},
};

/// A number that an effect does not have, or not with this value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EffectError {
    /// No such parameter.
    #[error("effect {} has no parameter `{key}`", .effect.info().symbol)]
    UnknownKey {
        /// The effect.
        effect: EffectId,
        /// The key given.
        key: String,
    },
    /// Not finite, or outside its bounds.
    #[error(
        "`{key}` of effect {} is {}, expected {}",
        .effect.info().symbol,
        Told(*.value),
        Expected(*.least, *.most)
    )]
    OutOfBounds {
        /// The effect.
        effect: EffectId,
        /// The parameter.
        key: &'static str,
        /// Value given.
        value: f64,
        /// Least value allowed.
        least: f64,
        /// Largest value allowed.
        most: f64,
    },
    /// The model has not what the effect acts on, or has it built in.
    #[error("effect {} ({}) does not act in {model}: {reason}", .effect.info().symbol, .effect.info().name)]
    NotInModel {
        /// The effect.
        effect: EffectId,
        /// The model.
        model: &'static str,
        /// Why.
        reason: &'static str,
    },
    /// Stronger than the machine that it is put in can be simulated with.
    #[error(
        "`{key}` of effect {} is {}, and this machine takes at most {}: {reason}",
        .effect.info().symbol,
        Told(*.value),
        Told(*.most)
    )]
    TooStrong {
        /// The effect.
        effect: EffectId,
        /// The parameter.
        key: &'static str,
        /// Value given.
        value: f64,
        /// Largest size that the machine takes, of either sign.
        most: f64,
        /// The quantity of the machine that sets it.
        reason: &'static str,
    },
    /// The effect is of a machine of the other geometry.
    #[error("effect {} is in the units of a {found:?} machine", .effect.info().symbol)]
    WrongGeometry {
        /// The effect.
        effect: EffectId,
        /// Geometry that its numbers are in.
        found: Geometry,
    },
    /// Two effects that cannot act together.
    #[error("effect {} acts in a model once only", .effect.info().symbol)]
    Twice {
        /// The effect.
        effect: EffectId,
    },
}
