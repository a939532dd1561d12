//! Reasons for which a text is not a model.

use super::effect_block;
use crate::{
    effect::{Coordinate, CurveKind, EffectError, EffectId, Geometry},
    parameter_error::ParameterError,
    presets::PRESETS,
};

/// Why a text is not a model. Lines count from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelFileError {
    /// Not TOML.
    #[error("line {line}: {message}")]
    Syntax {
        /// Where.
        line: usize,
        /// Message of the TOML reader.
        message: String,
    },
    /// A key that no model has.
    #[error("line {line}: unknown key `{key}`{}", .closest.map_or_else(String::new, |k| format!(", did you mean `{k}`")))]
    UnknownKey {
        /// Where.
        line: usize,
        /// The key, with its block.
        key: String,
        /// The known key most like it.
        closest: Option<&'static str>,
    },
    /// A value of another kind than the key needs.
    #[error("line {line}: `{key}` is {found}, expected {expected}")]
    WrongType {
        /// Where.
        line: usize,
        /// The key, with its block.
        key: String,
        /// Value that is needed.
        expected: &'static str,
        /// Value that stands there.
        found: String,
    },
    /// Without a base every parameter must be given.
    #[error("`{key}` is missing; give it, or a `base`")]
    Missing {
        /// The key, with its block.
        key: &'static str,
    },
    /// A number of a servo axis that has no default.
    #[error("`{key}` is missing")]
    MissingOfAxis {
        /// The key, with its block.
        key: String,
    },
    /// The base is not a preset.
    #[error("line {line}: base `{base}` is not one of {}", PRESETS.map(|(name, _)| name).join(", "))]
    UnknownBase {
        /// Where.
        line: usize,
        /// Value that stands there.
        base: String,
    },
    /// The file describes an effect that this simulator does not have.
    #[error("line {line}: effect `{id}` is not one that this version simulates")]
    UnknownEffect {
        /// Where.
        line: usize,
        /// Identifier of the effect.
        id: String,
    },
    /// An effect that is given no size, and would do nothing.
    #[error(
        "line {line}: effect {} ({}) has no size and would do nothing: give {} in `parameters`{}",
        .effect.info().symbol,
        .effect.info().name,
        effect_block::sizes(*.effect, *.geometry),
        effect_block::shapes(*.effect, *.geometry)
    )]
    Sizeless {
        /// Where.
        line: usize,
        /// The effect.
        effect: EffectId,
        /// The units of its keys.
        geometry: Geometry,
    },
    /// A tabulated effect without its table.
    #[error(
        "line {line}: effect U (tabulated) has no `curve` and would do nothing: give \
         `curve = {{ over = \"{}\", acts-as = \"{}\", points = [[x, y], …] }}`",
        Coordinate::ALL.map(|(name, _)| name).join("\" or \""),
        CurveKind::ALL.map(|(name, _)| name).join("\" or \"")
    )]
    Curveless {
        /// Where.
        line: usize,
    },
    /// An effect with a number that it does not have.
    #[error("line {line}: {error}")]
    Effect {
        /// Where.
        line: usize,
        /// Reason of the refusal.
        error: EffectError,
    },
    /// The file describes a machine of another kind than is asked for.
    #[error("line {line}: a `{found}` where an actuator is expected")]
    OtherMachine {
        /// Where.
        line: usize,
        /// Value that stands there.
        found: String,
    },
    /// A fault that changes nothing in the machine.
    #[error("line {line}: `faults`: {error}")]
    Fault {
        /// Where.
        line: usize,
        /// Reason of the refusal.
        error: ParameterError,
    },
    /// A parameter that no machine has.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
}
