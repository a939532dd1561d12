//! A model file of whatever kind of machine.

use super::{AxisModel, EffectBlock, Model, ModelFileError, Reader, document, entry, string};
use crate::{
    effect::{Effect, Geometry},
    fault::FaultId,
    machine_kind::MachineKind,
};

/// A machine of one of the kinds. A match on it names each, so that no kind is passed over.
#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "one is read at a time")]
pub enum MachineModel {
    /// An actuator with three phases.
    Actuator(Model),
    /// A servo axis.
    ServoAxis(AxisModel),
}

impl MachineModel {
    /// The machine as what every kind can be asked.
    pub fn kind(&self) -> &dyn MachineKind {
        match self {
            Self::Actuator(model) => model,
            Self::ServoAxis(model) => model,
        }
    }

    /// The machine as what every kind can be asked, to be changed.
    pub fn kind_mut(&mut self) -> &mut dyn MachineKind {
        match self {
            Self::Actuator(model) => model,
            Self::ServoAxis(model) => model,
        }
    }

    /// Name that its owner gave.
    pub fn name(&self) -> Option<&str> {
        self.kind().name()
    }

    /// Faults that it can have.
    pub fn faults(&self) -> &[FaultId] {
        self.kind().faults()
    }

    /// Rotary or linear: the units of its effects.
    pub fn geometry(&self) -> Geometry {
        self.kind().geometry()
    }

    /// Effects besides the base model.
    pub fn effects(&self) -> &[EffectBlock] {
        self.kind().effects()
    }

    /// Effects besides the base model, to be changed.
    pub fn effects_mut(&mut self) -> &mut Vec<EffectBlock> {
        self.kind_mut().effects_mut()
    }

    /// The effects that are switched on.
    pub fn switched_on(&self) -> Vec<Effect> {
        self.effects().iter().map(|block| block.effect.clone()).collect()
    }

    /// Text of the model, complete and without a base; [`parse_machine`] gives it back bit for bit.
    pub fn write(&self) -> String {
        self.kind().write()
    }
}

/// Reads a model of any kind.
///
/// # Errors
///
/// [`ModelFileError`] naming line and key.
///
/// # Examples
///
/// ```
/// use ema_sim::model_file::{MachineModel, parse_machine};
///
/// let model = parse_machine("base = \"ema-48\"\n")?;
/// assert!(matches!(model, MachineModel::Actuator(_)));
/// # Ok::<_, ema_sim::model_file::ModelFileError>(())
/// ```
pub fn parse_machine(text: &str) -> Result<MachineModel, ModelFileError> {
    if is_axis(text)? {
        let reader = Reader { text, complete: false };
        return Ok(MachineModel::ServoAxis(reader.axis(&document(text)?, None)?));
    }
    super::parse(text).map(MachineModel::Actuator)
}

/// Reads a model whose `base` is another model; what the key says is not looked at.
///
/// # Errors
///
/// [`ModelFileError`] naming line and key.
pub fn parse_machine_onto(text: &str, base: &MachineModel) -> Result<MachineModel, ModelFileError> {
    match base {
        MachineModel::Actuator(model) => super::parse_onto(text, model).map(MachineModel::Actuator),
        MachineModel::ServoAxis(model) => {
            let reader = Reader { text, complete: true };
            let axis = reader.axis(&document(text)?, Some(model.clone()))?;
            Ok(MachineModel::ServoAxis(axis))
        }
    }
}

fn is_axis(text: &str) -> Result<bool, ModelFileError> {
    match entry(&document(text)?, "kind") {
        Some(kind) => Ok(string(text, "kind", kind)? == "servo-axis"),
        None => Ok(false),
    }
}
