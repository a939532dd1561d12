//! Options of the report, and of fleets over time.

use std::path::PathBuf;

use clap::Args;
use recordings::NamePattern;

use super::positive;
use crate::report_file::Places;

/// Where the report and its drawings go.
#[derive(Clone, Debug, Default, Args)]
pub struct ReportArgs {
    /// Write a report into this file: one page with figures, read in any browser without a network
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// Write the drawings of the report into this folder, as SVG
    #[arg(long, value_name = "DIR")]
    pub figures: Option<PathBuf>,
}

impl ReportArgs {
    /// Where a report and its drawings go.
    pub(crate) fn places(&self) -> Places<'_> {
        Places { report: self.report.as_deref(), figures: self.figures.as_deref() }
    }
}

/// Which actuator a recording is of, and when it was taken.
#[derive(Clone, Debug, Default, Args)]
pub struct NameArgs {
    /// Read the actuator off the file name, such as `{id}_*`; the recording's own `actuator-id` counts where the name has none
    #[arg(long, value_name = "PATTERN")]
    pub id_from: Option<NamePattern>,
    /// Read the date off the file name, such as `*_{date}`; the recording's own `date` counts where the name has none
    #[arg(long, value_name = "PATTERN")]
    pub date_from: Option<NamePattern>,
}

/// Fleets over time.
#[derive(Clone, Debug, Args)]
pub struct FleetArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "a doc comment would become the help of the flattened group")]
    pub names: NameArgs,
    /// Warn when a level has risen by this much, and by more than noise, since the actuator's reference recording
    #[arg(long, value_name = "LEVEL", default_value_t = 0.02, value_parser = positive)]
    pub warning_change: f64,
}
