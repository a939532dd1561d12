//! A model file of whatever kind of machine.

use super::{
    AxisModel, EffectBlock, Model,
    error::ModelFileError,
    reader::{Reader, document, entry, string},
};
use crate::{
    effect::{Effect, Geometry},
    fault::{FAULT_COUNT, FaultId},
    machine_kind::MachineKind,
    parameter_error::ParameterError,
};

/// Why a machine is not given a fault.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FaultRefused {
    /// The machine has no such part.
    #[error("{reason}")]
    Impossible {
        /// The fault.
        fault: FaultId,
        /// The part that is missing.
        reason: ParameterError,
    },
    /// `faults` of the model leaves it out.
    #[error("`faults` of the model does not list {}", .fault.symbol())]
    NotListed {
        /// The fault.
        fault: FaultId,
    },
}

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

    /// Checks that the machine can have the faults whose level is not zero. k7 is the direction of
    /// k6 and no damage of its own.
    ///
    /// # Errors
    ///
    /// [`FaultRefused`] for the first fault that the machine cannot have or does not list.
    pub fn check_faults(&self, levels: &[f64; FAULT_COUNT]) -> Result<(), FaultRefused> {
        let damages = FaultId::ALL.into_iter().filter(|&fault| fault != FaultId::EccentricityPhase);
        for fault in damages.filter(|fault| levels[fault.index()] > 0.0) {
            if let Self::ServoAxis(model) = self {
                let impossible = |reason| FaultRefused::Impossible { fault, reason };
                model.axis.check_fault(fault).map_err(impossible)?;
            }
            if !self.faults().contains(&fault) {
                return Err(FaultRefused::NotListed { fault });
            }
        }
        Ok(())
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::presets::EMA_48;

    fn refused(machine: &MachineModel, symbol: usize) -> Option<String> {
        let mut levels = [0.0; FAULT_COUNT];
        levels[symbol - 1] = 0.02;
        machine.check_faults(&levels).err().map(|refused| refused.to_string())
    }

    #[test]
    fn a_machine_has_the_faults_that_its_model_lists() {
        let faults = vec![FaultId::Friction];
        let machine = MachineModel::Actuator(Model { faults, ..EMA_48.into() });
        assert_eq!(refused(&machine, 1), None);
        let told = "`faults` of the model does not list k2";
        assert_eq!(refused(&machine, 2).as_deref(), Some(told));
        // a direction alone is no damage
        assert_eq!(refused(&machine, 7), None);
    }

    #[test]
    fn an_axis_without_a_part_cannot_have_its_fault() {
        let text = include_str!("../../../../fixtures/models/emps.toml");
        let machine = parse_machine(text).unwrap();
        assert_eq!(refused(&machine, 1), None);
        let told = "k2 changes nothing in this axis: it has no backlash";
        assert_eq!(refused(&machine, 2).as_deref(), Some(told));
    }
}
