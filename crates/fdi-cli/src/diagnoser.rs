//! The seam between the command line and the diagnosis.

use anyhow::{Result, bail};
use fdi_core::{Recording, RootSeed, report::RecordDiagnosis};

use crate::DiagnoseArgs;

/// Diagnoses one recording after another, from several threads at once.
pub trait Diagnoser: Sync {
    /// SHA-256 of the bundle that stands at the head of the answer.
    fn bundle_sha256(&self) -> &str;

    /// Whether answers made with the bundle of that SHA-256 may stand beside its own.
    fn knows_bundle(&self, sha256: &str) -> bool {
        sha256 == self.bundle_sha256()
    }

    /// Rates that recordings may have, Hz: named when one cannot even be read and
    /// its rate is another.
    fn rates_hz(&self) -> &[f64];

    /// The answer to one recording, without the time it took.
    ///
    /// # Errors
    /// Why this recording cannot be diagnosed, in one line.
    fn diagnose(&self, recording: &Recording) -> Result<RecordDiagnosis>;
}

/// The diagnosis that the options ask for.
pub(crate) fn diagnoser(_args: &DiagnoseArgs, _seed: RootSeed) -> Result<Box<dyn Diagnoser>> {
    bail!("no diagnosis in this build")
}
