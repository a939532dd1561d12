//! Figures of a page, and the page that is made of them.

use serde::{Deserialize, Serialize};

/// One recomputable figure of a page.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(crate) struct Figure {
    /// Name on the page.
    pub(crate) id: String,
    /// Value on the page.
    pub(crate) value: f64,
    /// Relative difference that a recomputation may show.
    pub(crate) tolerance_rel: f64,
    /// Unit, `1` for a pure number.
    pub(crate) unit: String,
}

/// A page with its drawings.
pub(super) struct Rendered {
    pub(super) markdown: String,
    /// File names in `figures/`, and what they hold.
    pub(super) drawings: Vec<(String, String)>,
}

impl From<String> for Rendered {
    fn from(markdown: String) -> Self {
        Self { markdown, drawings: Vec::new() }
    }
}
