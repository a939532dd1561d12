//! Optional physics: what a machine does besides the base model, one effect a cause.
//!
//! An effect acts on a declared port and has an equation with a few numbers. With the defaults
//! it does nothing, and a model without effects is the base model bit for bit.
//!
//! # Adding an effect
//!
//! An effect is one file in `effect/catalogue/` and one line in the table of
//! `effect/catalogue.rs`: file, identity, one sentence. The file holds three things.
//!
//! 1. **Numbers**, declared by `numbers!`: a field for each, with its keys on a machine that turns
//!    and on one that slides, its quantity (which gives the unit and must be the end of the key),
//!    bounds, role and default. A size also says what is worth trying first on a machine of some
//!    scales, and the quantity of a machine that bounds it. Sizes come first.
//! 2. **`INFO`**: symbol (the next one of the catalogue), name, port, class, equation,
//!    look-alikes, source; how often it may act in one model, whether it differs between
//!    recordings, and whether it is non-linear in its size.
//! 3. **`impl EffectLaw`**. Four answers are asked of every effect: `refusal` (a model without a
//!    place for it), `idle` (a machine on which a number changes nothing), `can_feed` (energy put
//!    into the motion) and `rubs` (dry friction). Then what it does: `load` adds to torque and
//!    friction in the middle of a segment, `install` puts a part with a state into the machine
//!    (`effect/part/`) or bounds the length of segments, `rescale` changes constants.
//!
//! Runs go side by side, several lanes in one vector (`docs/decisions/0128-effects-side-by-side.md`),
//! so `load` is arithmetic. A law that takes a sine or an exponential of the state does not call
//! `libm` in `load`: it names the function in `function`, says of what in `argument`, and `load` is
//! given the values. A choice in `load` is best a selection between two numbers that are worked out
//! in any case. A law that calls `libm` all the same, as E01 and E02 do for unusual exponents, gives
//! the same answers and is slower.
//!
//! Models of both fidelities, the servo axis, model files, `fdi effects` and the search of
//! `greybox` take it from there. Without `INFO`, an answer or a field the crate does not compile;
//! a key that is not in the unit of its number, an effect that is on by default, or a number that
//! neither changes anything nor is refused fails a test (`tests/it/idle_effects.rs`). A test
//! wants a row in `docs/models/effects.md`.

pub(crate) mod admission;
pub(crate) mod capabilities;
pub(crate) mod catalogue;
pub(crate) mod curve;
pub(crate) mod error;
pub(crate) mod info;
pub(crate) mod instance;
pub(crate) mod lanes;
pub(crate) mod law;
pub(crate) mod number;
pub(crate) mod part;
pub(crate) mod power;
pub(crate) mod quantity;
pub(crate) mod rescaling;
pub(crate) mod shaft_load;

pub use catalogue::EffectId;
pub use curve::{Coordinate, Curve, CurveError, CurveKind};
pub use error::EffectError;
pub use info::{EffectClass, EffectInfo, LoopPart, Port, Repetition};
pub use instance::Effect;
pub use number::{EffectParameter, MOST_PARAMETERS, MachineScales, Role, ShapeScales};
pub use quantity::{Geometry, Quantity};
pub use shaft_load::{ShaftMoment, ShaftTorque};
