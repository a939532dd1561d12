//! The law of an effect: where it has a place, what it needs, and what it does in a model.

use crate::{
    effect::{
        capabilities::ModelCapabilities,
        curve::Curve,
        number::MOST_PARAMETERS,
        part::Parts,
        quantity::Geometry,
        rescaling::Rescaling,
        shaft_load::{Moment, ShaftLoad},
    },
    lane_sine::sincos_of,
};

/// The numbers that an effect is given.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Given<'a> {
    pub(crate) values: &'a [f64; MOST_PARAMETERS],
    pub(crate) curve: Option<&'a Curve>,
    pub(crate) geometry: Geometry,
}

/// Function of the state that a law takes beside arithmetic. Runs side by side take it for several
/// lanes at a time, with the bits of `libm`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Function {
    /// The law is arithmetic alone.
    None,
    /// Sine, cosine.
    Sine,
    /// Exponential, zero.
    Exponential,
}

impl Function {
    /// The two numbers that a law is given.
    #[inline]
    fn of(self, argument: f64) -> [f64; 2] {
        match self {
            Self::None => [0.0; 2],
            Self::Sine => sincos_of(argument).into(),
            Self::Exponential => [libm::exp(argument), 0.0],
        }
    }
}

/// Adds what a law does on the moving shaft.
#[inline]
pub(super) fn add(law: &impl EffectLaw, at: &Moment, shaft: &mut ShaftLoad) {
    law.load(at, law.function().of(law.argument(at)), shaft);
}

/// Law of one effect, in every model.
///
/// The first four are decisions that each effect states. Of the others an effect has those by which
/// it acts; a test over the catalogue fails for a number that changes nothing.
pub(crate) trait EffectLaw {
    /// Reason for which a model has no place for the effect.
    fn refusal(&self, model: &ModelCapabilities) -> Option<&'static str>;

    /// Reason for which one of the numbers would change nothing recorded of a machine. Asked of an
    /// effect with a size alone.
    fn idle(&self, model: &ModelCapabilities) -> Option<&'static str>;

    /// True where its torque can put energy into the motion, and not only brake or hold.
    fn can_feed(&self) -> bool;

    /// True where it adds dry friction.
    fn rubs(&self) -> bool;

    /// Error of the position that a servo axis shows where it stands, at rest.
    fn error_of_position(&self, _position: f64) -> f64 {
        0.0
    }

    /// Changes constants of the machine for the whole run.
    fn rescale(&self, _machine: &mut Rescaling) {}

    /// Puts parts with a state into the machine, and bounds the length of segments.
    fn install(&self, _parts: &mut Parts) {}

    /// Function whose numbers [`load`](Self::load) is given. The same for all numbers of the effect.
    #[inline]
    fn function(&self) -> Function {
        Function::None
    }

    /// Argument of that function.
    #[inline]
    fn argument(&self, _at: &Moment) -> f64 {
        0.0
    }

    /// Adds to friction and torque on the moving shaft, in the middle of a segment; `_values` are
    /// those of the function.
    #[inline]
    fn load(&self, _at: &Moment, _values: [f64; 2], _shaft: &mut ShaftLoad) {}
}
