//! Levels of damage for decisions, in model files.

use toml::{Spanned, de::DeValue};

use super::{
    error::ModelFileError,
    reader::{Reader, closest_of, line_of},
};
use crate::fault::FaultId;

const BLOCK: &str = "action-levels";
const WATCH: &str = "watch";
const ACT: &str = "act";

/// Levels of one fault from which the machine is to be watched, and to be acted on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActionLevel {
    /// For watching.
    pub watch: f64,
    /// For acting, no less.
    pub act: f64,
}

/// Levels of k1 to k6 that a model file states.
pub type StatedLevels = [Option<ActionLevel>; 6];

impl Reader<'_> {
    /// The levels of a block; of a fault that it leaves out those of the base.
    pub(super) fn action_levels(
        &self,
        value: &Spanned<DeValue<'_>>,
        base: StatedLevels,
    ) -> Result<StatedLevels, ModelFileError> {
        let mut levels = base;
        let faults = &FaultId::ALL[..levels.len()];
        for (key, value) in self.table(BLOCK, value)? {
            let name = key.get_ref().as_ref();
            let path = format!("{BLOCK}.{name}");
            let fault = faults.iter().position(|fault| fault.symbol() == name);
            let Some(place) = fault else {
                let closest = closest_of(name, faults.iter().map(|fault| fault.symbol()));
                let line = line_of(self.text, key);
                return Err(ModelFileError::UnknownKey { line, key: path, closest });
            };
            levels[place] = Some(self.action_level(&path, value)?);
        }
        Ok(levels)
    }

    fn action_level(
        &self,
        path: &str,
        value: &Spanned<DeValue<'_>>,
    ) -> Result<ActionLevel, ModelFileError> {
        let (mut watch, mut act) = (None, None);
        for (key, value) in self.table(path, value)? {
            let name = key.get_ref().as_ref();
            let inner = format!("{path}.{name}");
            let level = match name {
                WATCH => &mut watch,
                ACT => &mut act,
                _ => {
                    let closest = closest_of(name, [WATCH, ACT].into_iter());
                    let line = line_of(self.text, key);
                    return Err(ModelFileError::UnknownKey { line, key: inner, closest });
                }
            };
            let number = self.number(&inner, value)?;
            if !(number > 0.0 && number <= 1.0) {
                let expected = "a level above 0 and at most 1";
                return Err(self.wrong(&inner, expected, value, number.to_string()));
            }
            *level = Some(number);
        }
        let found = match (watch, act) {
            (Some(watch), Some(act)) if watch <= act => return Ok(ActionLevel { watch, act }),
            (Some(watch), Some(act)) => format!("watched from {watch} and acted on from {act}"),
            (Some(_), None) => format!("without `{ACT}`"),
            (None, _) => format!("without `{WATCH}`"),
        };
        Err(self.wrong(path, "a table with `watch` and `act`, which is no less", value, found))
    }
}

/// Adds the block of levels that are stated.
pub(super) fn write(levels: &StatedLevels, lines: &mut Vec<String>) {
    if levels.iter().all(Option::is_none) {
        return;
    }
    lines.push(format!("\n[{BLOCK}]"));
    for (fault, level) in FaultId::ALL.iter().zip(levels) {
        if let Some(ActionLevel { watch, act }) = level {
            lines.push(format!("{} = {{ {WATCH} = {watch:?}, {ACT} = {act:?} }}", fault.symbol()));
        }
    }
}
