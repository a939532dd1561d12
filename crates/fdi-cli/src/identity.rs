//! Identity of a recording: its actuator and its date, by its file name or by itself; its operator.

use std::path::Path;

use anyhow::{Result, bail};
use fdi_core::{ColumnMap, Metadata, Recording, RecordingDate, report::RecordDiagnosis};

use crate::args::NameArgs;

/// Which actuator a recording is of, when it was taken, and who took it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Identity {
    pub(crate) actuator_id: Option<String>,
    pub(crate) date: Option<String>,
    operator: Option<String>,
    /// Date of the file name that is no day.
    no_day: Option<String>,
}

impl Identity {
    /// The actuator and the date: those that the name of the file says, else its metadata.
    pub(crate) fn of(names: &NameArgs, path: &Path, metadata: &Metadata) -> Self {
        let patterns = [&names.id_from, &names.date_from];
        let named = patterns.map(|one| one.as_ref().map(|one| one.read(path)).unwrap_or_default());
        let [mut by_id, mut by_date] = named;
        let date = by_date.date.or(by_id.date.take()).or(metadata.date.clone());
        Self {
            actuator_id: by_id.id.or(by_date.id.take()).or(metadata.actuator_id.clone()),
            date: date.map(|date| date.to_string()),
            operator: metadata.operator.clone(),
            no_day: by_date.no_day.or(by_id.no_day),
        }
    }

    /// Puts actuator and date into a recording.
    pub(crate) fn put_into(&self, recording: &mut Recording) -> Result<()> {
        if let Some(text) = &self.no_day {
            bail!("the name says the date `{text}`, and there is no such day");
        }
        recording.metadata.actuator_id.clone_from(&self.actuator_id);
        recording.metadata.date = self.date.as_deref().and_then(RecordingDate::parse);
        Ok(())
    }

    /// Puts actuator, date and operator into an answer.
    pub(crate) fn put_into_answer(&self, record: &mut RecordDiagnosis) {
        record.actuator_id.clone_from(&self.actuator_id);
        record.date.clone_from(&self.date);
        record.operator.clone_from(&self.operator);
    }
}

/// Reads a recording with the identity that its name says.
pub(crate) fn read_named(path: &Path, map: &ColumnMap, names: &NameArgs) -> Result<Recording> {
    let mut recording = Recording::read(path, map)?;
    Identity::of(names, path, &recording.metadata).put_into(&mut recording)?;
    Ok(recording)
}
