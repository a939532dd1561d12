//! One answer to several recordings of an actuator.

use std::{
    convert::Infallible,
    io::{self, Write},
};

use anyhow::{Result, ensure};
use fdi_core::{
    DiagnosedAlone, Encoding, ToleranceUse, diagnose_together,
    report::{Failure, Fidelity, Method, RecordDiagnosis},
};

use super::Asked;
use crate::{
    DiagnoseArgs, GlobalArgs, Streams,
    answering::{Batch, Source},
    args::TogetherBy,
    batch::in_order,
    output::{Answer, Tally, writer},
    progress::Progress,
    streams::Worth,
};

/// Refuses settings with which recordings have no answer together.
pub(super) fn check(args: &DiagnoseArgs) -> Result<()> {
    if args.together.is_none() {
        return Ok(());
    }
    let needed = [
        (args.method == Method::Gls, "`--method gls`"),
        (args.fidelity == Fidelity::Low, "`--fidelity low`"),
        (args.encoding == Encoding::Full, "`--encoding full`"),
        (args.tolerance == ToleranceUse::Model, "`--tolerance model`"),
        (args.max_delay_s.is_none_or(|most_s| most_s == 0.0), "no `--max-delay-s`"),
        (!args.free_start, "no `--free-start`"),
    ];
    for (is_met, setting) in needed {
        ensure!(is_met, "`--together` needs {setting}");
    }
    Ok(())
}

/// Recordings that one answer is of.
struct Group {
    actuator_id: Option<String>,
    session: Option<String>,
    members: Vec<DiagnosedAlone>,
}

/// Diagnoses the recordings and writes an answer to each group, then the failure of each that could
/// not be diagnosed; says whether an older product was left because nothing came of them.
pub(super) fn tell(
    batch: &Batch<'_>,
    asked: &Asked,
    by: TogetherBy,
    records: &mut Option<Vec<RecordDiagnosis>>,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<(Tally, bool)> {
    let Asked { inputs, head, .. } = asked;
    let Streams { out, err, is_terminal } = streams;
    let is_told = !global.quiet && !global.verbose;
    let mut progress = Progress::new(if is_told { inputs.len() } else { 0 }, 0, *is_terminal);
    progress.begin(*err);
    let mut groups: Vec<Group> = Vec::new();
    let mut failures = Vec::new();
    let keep = |done: Result<DiagnosedAlone, Failure>| {
        progress.clear(*err);
        if global.verbose {
            let told = match &done {
                Ok(alone) => format!("{}: {}", alone.answer().recording, alone.answer().verdict),
                Err(failure) => format!("{}: failed", failure.recording),
            };
            // that progress cannot be told is no failure
            let _ = writeln!(err, "{told}");
        }
        match done {
            Ok(alone) => put_into(&mut groups, by, alone),
            Err(failure) => failures.push(Answer::Failed(failure)),
        }
        progress.step(*err);
        Ok::<_, Infallible>(())
    };
    let work = |_: usize, input: &Source| batch.alone(input);
    let Ok(()) = in_order(inputs, global.threads(), work, keep);
    progress.clear(*err);
    let mut answers: Vec<Answer> =
        groups.iter().map(|group| group.answer(batch)).chain(failures).collect();
    let mut tally = Tally::default();
    for answer in &mut answers {
        tally.count(answer);
        if let (Some(records), Answer::Diagnosed(record)) = (records.as_mut(), &*answer) {
            records.push((**record).clone());
        }
        asked.leave_to_the_report(answer);
    }
    let mut product = Streams { out: &mut **out, err: &mut io::sink(), is_terminal: *is_terminal };
    let left = product.product_worth(global.output.as_deref(), |out| {
        let mut writer = writer(global.output_format, global.output.is_none(), out);
        writer.begin(head)?;
        answers.iter().try_for_each(|answer| writer.answer(answer))?;
        writer.end()?;
        Ok(if tally.is_empty() { Worth::Nothing } else { Worth::Keeping })
    })?;
    Ok((tally, left))
}

fn put_into(groups: &mut Vec<Group>, by: TogetherBy, alone: DiagnosedAlone) {
    let actuator_id = alone.answer().actuator_id.clone();
    let session = match by {
        TogetherBy::Session => alone.session().map(str::to_owned),
        TogetherBy::Actuator => None,
    };
    let is_own = |group: &&mut Group| group.actuator_id == actuator_id && group.session == session;
    match groups.iter_mut().find(is_own) {
        Some(group) => group.members.push(alone),
        None => groups.push(Group { actuator_id, session, members: vec![alone] }),
    }
}

impl Group {
    fn answer(&self, batch: &Batch<'_>) -> Answer {
        let diagnosed = || -> Result<RecordDiagnosis> {
            let mut record = diagnose_together(&self.members)?;
            record.recording = self.name();
            record.actuator_id.clone_from(&self.actuator_id);
            record.date = self.date();
            let took_s = self.members.iter().map(|one| one.answer().elapsed_s);
            record.elapsed_s = took_s.sum();
            batch.finish(&mut record, &self.members)?;
            Ok(record)
        };
        match diagnosed() {
            Ok(record) => Answer::Diagnosed(Box::new(record)),
            Err(error) => Answer::Failed(Failure {
                recording: self.name(),
                actuator_id: self.actuator_id.clone(),
                date: self.date(),
                error: format!("{error:#}"),
            }),
        }
    }

    /// Name of the answer: of one recording its path.
    fn name(&self) -> String {
        if let [one] = &self.members[..] {
            return one.answer().recording.clone();
        }
        let of = self.actuator_id.as_ref().map(|id| format!(" of {id}")).unwrap_or_default();
        let session = self.session.as_ref().map(|one| format!(", {one}")).unwrap_or_default();
        format!("{} recordings{of}{session}", self.members.len())
    }

    /// When the last of them was taken.
    fn date(&self) -> Option<String> {
        self.members.iter().filter_map(|one| one.answer().date.clone()).max()
    }
}
