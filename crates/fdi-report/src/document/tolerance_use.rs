//! Use of the tolerances of a machine in a diagnosis.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::words;

/// Use of the tolerances of a machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum ToleranceUse {
    /// The machine is exactly its model file.
    #[default]
    None,
    /// The numbers of the machine scatter as the model file says.
    Model,
}

words! {
    ToleranceUse { None "none", Model "model" }
}
