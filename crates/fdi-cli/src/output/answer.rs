//! The answer for one recording, and the interface of its writers.

use std::{collections::BTreeMap, io};

use fdi_core::report::{BatchShard, Failure, RecordDiagnosis};

/// Result of one recording.
#[derive(Clone, Debug)]
pub enum Answer {
    /// The diagnosis.
    Diagnosed(Box<RecordDiagnosis>),
    /// Why there is none.
    Failed(Failure),
}

impl Answer {
    /// The recording that it is of.
    pub fn recording(&self) -> &str {
        match self {
            Self::Diagnosed(record) => &record.recording,
            Self::Failed(failure) => &failure.recording,
        }
    }

    /// One line that says that it is done.
    pub(crate) fn in_a_word(&self) -> String {
        match self {
            Self::Diagnosed(record) => {
                let took = record.elapsed_s.map(|elapsed_s| format!(" in {elapsed_s:.3} s"));
                format!("{}: {}{}", record.recording, record.verdict, took.unwrap_or_default())
            }
            Self::Failed(failure) => format!("{}: failed", failure.recording),
        }
    }
}

/// Facts that stand before all answers.
#[derive(Clone, Debug)]
pub struct Head {
    /// SHA-256 of the bundle.
    pub bundle: String,
    /// Seed of what is random.
    pub seed: u64,
    /// Date and time, where they are asked for.
    pub stamp: Option<String>,
    /// Which part of a batch follows, and the settings that its answers depend on.
    pub part: Option<(BatchShard, BTreeMap<String, Option<String>>)>,
}

/// Writes answers in one form, as they come.
pub(crate) trait AnswerWriter {
    /// Before the first answer.
    fn begin(&mut self, head: &Head) -> io::Result<()>;

    /// One answer, in the order of the input.
    fn answer(&mut self, answer: &Answer) -> io::Result<()>;

    /// After the last answer.
    fn end(&mut self) -> io::Result<()>;
}
