//! Shorted turns that stay in the machine, in model files.

use toml::{Spanned, de::DeValue};

use super::{
    error::ModelFileError,
    reader::{Reader, closest_of, line_of},
};
use crate::shorted_turns::ShortedTurns;

const RESISTANCE: &str = "resistance-ohm";
const LEAKAGE: &str = "leakage-ratio";

impl Reader<'_> {
    /// The shorted turns of a block; what it leaves out is the base's, and of a base without one
    /// the default.
    pub(super) fn short_circuit(
        &self,
        value: &Spanned<DeValue<'_>>,
        base: ShortedTurns,
    ) -> Result<ShortedTurns, ModelFileError> {
        let (mut resistance, mut leakage) = match base {
            ShortedTurns::Removed => (None, ShortedTurns::DEFAULT_LEAKAGE_RATIO),
            ShortedTurns::Closed { resistance_ohm, leakage_ratio } => {
                (Some(resistance_ohm), leakage_ratio)
            }
        };
        for (key, value) in self.table("short-circuit", value)? {
            let name = key.get_ref().as_ref();
            let path = format!("short-circuit.{name}");
            match name {
                RESISTANCE => resistance = Some(self.number(&path, value)?),
                LEAKAGE => leakage = self.number(&path, value)?,
                _ => {
                    let closest = closest_of(name, [RESISTANCE, LEAKAGE].into_iter());
                    let line = line_of(self.text, key);
                    return Err(ModelFileError::UnknownKey { line, key: path, closest });
                }
            }
        }
        let missing = ModelFileError::Missing { key: "short-circuit.resistance-ohm" };
        let resistance_ohm = resistance.ok_or(missing)?;
        Ok(ShortedTurns::Closed { resistance_ohm, leakage_ratio: leakage })
    }
}

/// Adds the block of shorted turns that stay in the machine.
pub(super) fn write(turns: ShortedTurns, lines: &mut Vec<String>) {
    if let ShortedTurns::Closed { resistance_ohm, leakage_ratio } = turns {
        lines.push("\n[short-circuit]".to_owned());
        lines.push(format!("{RESISTANCE} = {resistance_ohm:?}"));
        if leakage_ratio != ShortedTurns::DEFAULT_LEAKAGE_RATIO {
            lines.push(format!("{LEAKAGE} = {leakage_ratio:?}"));
        }
    }
}
