//! The forms of an answer.

mod answer;
mod columns;
mod csv;
mod human;
mod json;
#[cfg(feature = "parquet")]
mod parquet;
mod table;

use std::{collections::BTreeMap, io::Write};

use fdi_core::report::{Failure, NoticeCode, RecordDiagnosis, Severity, Verdict};

use crate::OutputFormat;
pub(crate) use answer::AnswerWriter;
pub use answer::{Answer, Head};
pub use columns::{Cell, Kind};
pub(crate) use columns::{columns, row};
pub(crate) use json::{TOOL, to_line};
pub(crate) use table::table;

/// The writer of a form; `styled` where the stream takes care of colours.
pub(crate) fn writer<'a>(
    format: OutputFormat,
    styled: bool,
    out: &'a mut dyn Write,
) -> Box<dyn AnswerWriter + 'a> {
    match format {
        OutputFormat::Human => Box::new(human::Human::new(out, styled)),
        OutputFormat::Json => Box::new(json::Document::new(out)),
        OutputFormat::Jsonl => Box::new(json::Lines::new(out)),
        OutputFormat::Csv => Box::new(csv::Rows::new(out)),
        #[cfg(feature = "parquet")]
        OutputFormat::Parquet => Box::new(parquet::Table::new(out)),
    }
}

/// Counts of the answers of a batch.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    /// Answers of an earlier run among them.
    taken_over: usize,
    verdicts: [usize; 4],
    /// Recordings that answers to several are of.
    together: usize,
    /// Recordings that are neither healthy nor faulty: nothing was concluded.
    pub(crate) without_conclusion: usize,
    pub(crate) failures: Vec<Failure>,
    /// Answers without a unit or references.
    pub(crate) without_unit: usize,
    /// Recordings that the model does not explain.
    pub(crate) unexplained: Vec<String>,
    /// Recordings by what is to be done about their machines.
    decided: BTreeMap<Severity, Vec<String>>,
}

/// Tells whether an answer says neither that the actuator is healthy nor what is wrong with it.
fn is_open(record: &RecordDiagnosis) -> bool {
    match record.verdict {
        Verdict::Undetermined | Verdict::ModelInadequate => true,
        Verdict::Healthy => record.is_unfinished(),
        Verdict::Faulty => false,
    }
}

/// The verdicts in the order in which they are told.
const VERDICTS: [Verdict; 4] =
    [Verdict::Healthy, Verdict::Faulty, Verdict::Undetermined, Verdict::ModelInadequate];

impl Tally {
    pub(crate) fn count(&mut self, answer: &Answer) {
        match answer {
            Answer::Diagnosed(record) => {
                let of = VERDICTS.iter().position(|&verdict| verdict == record.verdict);
                self.verdicts[of.expect("the list holds every verdict")] += 1;
                self.without_conclusion += usize::from(is_open(record));
                let is_unit_used = record.notice(NoticeCode::ReferenceUsed).is_some();
                self.without_unit += usize::from(!is_unit_used);
                if let Some(action) = &record.action {
                    let of = self.decided.entry(action.severity).or_default();
                    of.push(record.recording.clone());
                }
                self.together += record.together.len();
                // no one cause explains recordings that differ in their state of health
                let disagree = record.notice(NoticeCode::RecordingsDisagree).is_some();
                if record.verdict == Verdict::ModelInadequate && !disagree {
                    let own =
                        [&record.recording].into_iter().filter(|_| record.together.is_empty());
                    let several = record.together.iter().map(|one| &one.recording);
                    self.unexplained.extend(own.chain(several).cloned());
                }
            }
            Answer::Failed(failure) => self.failures.push(failure.clone()),
        }
    }

    /// Counts an answer of an earlier run.
    pub(crate) fn take_over(&mut self, answer: &Answer) {
        self.count(answer);
        self.taken_over += usize::from(matches!(answer, Answer::Diagnosed(_)));
    }

    /// Tells whether no recording could be diagnosed.
    pub(crate) fn is_empty(&self) -> bool {
        self.verdicts == [0; 4]
    }

    /// Recordings about whose machines so much is to be done.
    pub(crate) fn decided(&self, severity: Severity) -> &[String] {
        self.decided.get(&severity).map_or(&[], Vec::as_slice)
    }

    pub(crate) fn of(&self, verdict: Verdict) -> usize {
        let counted = VERDICTS.iter().zip(self.verdicts);
        counted.filter(|(of, _)| **of == verdict).map(|(_, count)| count).sum()
    }

    /// Sums the batch up in one line.
    pub(crate) fn sentence(&self) -> String {
        let all: usize = self.verdicts.iter().sum();
        let told = VERDICTS.iter().zip(self.verdicts).filter(|(_, count)| *count > 0);
        let told: Vec<_> = told.map(|(verdict, count)| format!("{count} {verdict}")).collect();
        let verdicts = if all == 0 { String::new() } else { format!(": {}", told.join(", ")) };
        let open = self.without_conclusion;
        let open = if open == 0 { String::new() } else { format!("; no conclusion on {open}") };
        let failed = self.failures.len();
        let failed = if failed == 0 { String::new() } else { format!("; {failed} failed") };
        let noun = |count: usize| if count == 1 { "recording" } else { "recordings" };
        let done = match (all - self.taken_over, self.taken_over) {
            (now, _) if self.together > 0 => {
                let answers = if now == 1 { "answer" } else { "answers" };
                format!("{now} {answers} to {} {}", self.together, noun(self.together))
            }
            (now, 0) => format!("{now} {} diagnosed", noun(now)),
            (now, taken) => {
                format!("{now} {} diagnosed now, {taken} taken over", noun(now))
            }
        };
        format!("{done}{verdicts}{open}{failed}")
    }
}
