//! Levels that decisions are made by: those of the options, else of the machine, else the default.

use anyhow::Result;
use fdi_core::{
    DiagnosedAlone, decide_together,
    report::{ActionLevels, RecordDiagnosis},
};

use crate::{DiagnoseArgs, Diagnoser, diagnoser::KnownTest};

/// Levels for the answers of a diagnosis.
#[derive(Clone, Debug, Default)]
pub struct Deciding {
    /// SHA-256 of the bundle at the head of the answers.
    of_head: String,
    /// Levels of machines, by the SHA-256 of the bundle.
    known: Vec<(String, ActionLevels)>,
    other: ActionLevels,
    is_asked: bool,
}

impl Deciding {
    /// Levels of the options over those that are stated.
    ///
    /// # Errors
    /// A level for acting that is below the one for watching.
    pub(crate) fn of(args: &DiagnoseArgs, diagnoser: &dyn Diagnoser) -> Result<Self> {
        let levels = &args.levels;
        let over = |one: KnownTest| Ok((one.bundle_sha256, levels.over(one.levels)?));
        let is_asked = args.ask_for_decisions() || diagnoser.states_levels();
        // bundles are not read to their ends for nothing
        let known = if is_asked || args.wants_report() { diagnoser.known() } else { Vec::new() };
        Ok(Self {
            of_head: diagnoser.bundle_sha256().to_owned(),
            known: known.into_iter().map(over).collect::<Result<_>>()?,
            other: levels.over(ActionLevels::default())?,
            is_asked,
        })
    }

    /// True where answers have a decision: the options ask for it, or the owner of a machine has stated
    /// its levels.
    pub(crate) fn is_asked(&self) -> bool {
        self.is_asked
    }

    /// Answers with their decisions, which reports begin with: those that have none get one.
    pub fn decided(&self, records: impl Iterator<Item = RecordDiagnosis>) -> Vec<RecordDiagnosis> {
        let with_action = |mut record: RecordDiagnosis| {
            if record.action.is_none() {
                self.decide(&mut record, &[]);
            }
            record
        };
        records.map(with_action).collect()
    }

    /// Puts a decision into an answer, of several recordings by what each shows too.
    pub(crate) fn decide(&self, record: &mut RecordDiagnosis, alone: &[DiagnosedAlone]) {
        let bundle = record.bundle.as_ref().unwrap_or(&self.of_head);
        let known = self.known.iter().find(|(one, _)| one == bundle);
        let levels = known.map_or(&self.other, |(_, levels)| levels);
        let alone = alone.iter().map(DiagnosedAlone::answer);
        record.action = Some(decide_together(record, alone, levels));
    }
}
