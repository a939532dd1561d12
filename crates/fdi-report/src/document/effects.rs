//! The catalogue of effects, as JSON.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Effects that a model may have besides its base: what `fdi explain` looks for, and what the
/// `[[effect]]` blocks of a model file switch on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EffectCatalogue {
    /// Version of this form.
    pub schema_version: u32,
    /// Name and version of the program, `fdi 0.1.0`.
    pub tool: String,
    /// The effects, in the order of the catalogue.
    pub effects: Vec<CatalogueEffect>,
}

/// One effect of the catalogue.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CatalogueEffect {
    /// Symbol, `E` and a number; `U` for a measured curve.
    pub id: String,
    /// An engineer's name for it.
    pub name: String,
    /// Where it acts: `motor-torque`, `transmission`, `electrical`, `sensor` or `controller`.
    pub port: String,
    /// Family of effects that are hard to tell apart.
    pub class: String,
    /// Contribution to the machine's equations; torques are against positive motion.
    pub equation: String,
    /// Faults and effects that it is confounded with.
    pub confounded_with: String,
    /// The experiment that tells it apart.
    pub separated_by: String,
    /// Where form and size come from.
    pub source: String,
    /// How often it may act in one model: `once`, as a `sum` of several blocks, or `by-order`,
    /// each of several orders a cause of its own.
    pub repetition: String,
    /// True where its sizes differ between recordings of one machine.
    pub differs_by_recording: bool,
    /// True where its action is not in proportion to its size.
    pub nonlinear_in_size: bool,
    /// True where it takes a measured curve.
    pub takes_curve: bool,
    /// Numbers of the effect, its sizes first.
    pub parameters: Vec<CatalogueParameter>,
}

/// One number of an effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CatalogueParameter {
    /// Symbol in the equation, and what it stands for.
    pub meaning: String,
    /// Role for one who fits it: `amplitude` (zero is no effect), `shape`, `place`, `order`,
    /// `frequency` or `switch`.
    pub role: String,
    /// Least value allowed.
    pub least: f64,
    /// Largest value allowed.
    pub most: f64,
    /// The number on a machine that turns.
    pub rotary: CatalogueKey,
    /// The number on a machine that slides.
    pub linear: CatalogueKey,
}

/// Key, unit and default of a number on machines of one geometry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CatalogueKey {
    /// Key in answers; model files write `-` for `_`.
    pub key: String,
    /// Unit, `N·m·s/rad`; empty for a plain number.
    pub unit: String,
    /// Value where a model file leaves it out, in that unit.
    pub default: f64,
}
