//! A setting of a run.

use fdi_report::SettingRow;

/// A setting of this run with its value and origin.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ResolvedSetting {
    pub(crate) path: String,
    pub(crate) value: Option<String>,
    pub(crate) origin: Option<String>,
}

impl ResolvedSetting {
    /// True where it is anything but left at its default.
    pub(crate) fn is_set(&self) -> bool {
        self.origin.is_some()
    }

    /// True where the answer can differ with it: how many are worked on at the same time does not show.
    pub(crate) fn is_of_the_answer(&self) -> bool {
        self.path != "jobs"
    }

    /// Name, value and origin for a table.
    pub(crate) fn row(&self) -> SettingRow {
        SettingRow {
            name: self.path.clone(),
            value: self.value.clone().unwrap_or_else(|| "-".to_owned()),
            origin: self.origin.clone().unwrap_or_else(|| "default".to_owned()),
        }
    }
}
