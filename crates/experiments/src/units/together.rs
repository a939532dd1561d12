//! Units that are learnt, then recorded several times and diagnosed together.

use std::sync::Arc;

use fdi_core::{
    DiagnoseOptions, DiagnosedAlone, Diagnoser, Purpose, RootSeed, ToleranceUse, diagnose_together,
    ema_sim::FaultCoordinates,
    in_parallel,
    report::{NoticeCode, RecordDiagnosis},
};

use super::{
    hidden::HiddenDamage,
    learnt::{Days, Owned},
    score::{UnitsScore, scored},
};
use crate::request::EvaluationError;

/// One line of the study: units at full tolerances that are recorded several times.
#[derive(Clone, Copy, Debug)]
pub struct TogetherLine {
    /// Recordings of each unit as new, each of a day of its own.
    pub references: usize,
    /// Later days on which it is recorded.
    pub days: usize,
    /// Recordings of each of these.
    pub each: usize,
    /// Half-width of the winding's temperature over days, K.
    pub half_width_k: f64,
    /// Standard deviation of the winding's temperature as read, K; `None`: it is not read.
    pub reading_std_k: Option<f64>,
    /// Damage on the later days.
    pub damage: HiddenDamage,
    /// True where the damage is there on the last day alone: no state of health explains the days.
    pub only_last: bool,
    /// Units.
    pub units: usize,
}

/// Scores of a line.
#[derive(Clone, Debug)]
pub struct TogetherResult {
    /// The line.
    pub line: TogetherLine,
    /// Answers to the recordings together.
    pub together: UnitsScore,
    /// Answers to the last recording by itself.
    pub last: UnitsScore,
    /// Units whose recordings are said to disagree.
    pub disagree: usize,
}

/// Answers to a unit.
struct Judged {
    damage: FaultCoordinates,
    together: Option<RecordDiagnosis>,
    last: Option<RecordDiagnosis>,
}

/// Learns the units of a line and diagnoses their later recordings together.
///
/// # Errors
///
/// [`EvaluationError`] when a machine cannot be simulated.
pub fn evaluate_together(
    diagnoser: &Diagnoser,
    line: &TogetherLine,
    seed: u64,
    jobs: usize,
) -> Result<TogetherResult, EvaluationError> {
    let indices: Vec<u64> = (0..line.units as u64).collect();
    let judged = in_parallel(&indices, jobs, |_, &index| {
        judged(diagnoser, line, RootSeed(seed).derive(Purpose::Units, index))
    })?;
    let answers = |of: fn(&Judged) -> Option<&RecordDiagnosis>| {
        let pairs: Vec<_> = judged.iter().map(|one| (&one.damage, of(one))).collect();
        scored(&pairs)
    };
    let together = judged.iter().filter_map(|one| one.together.as_ref());
    let disagrees =
        |answer: &&RecordDiagnosis| answer.notice(NoticeCode::RecordingsDisagree).is_some();
    Ok(TogetherResult {
        line: *line,
        together: answers(|one| one.together.as_ref()),
        last: answers(|one| one.last.as_ref()),
        disagree: together.filter(disagrees).count(),
    })
}

fn judged(
    diagnoser: &Diagnoser,
    line: &TogetherLine,
    seed: u64,
) -> Result<Judged, EvaluationError> {
    let experiment = &diagnoser.bundle().experiment;
    let TogetherLine { half_width_k, reading_std_k, .. } = *line;
    let days = Days { half_width_k, reading_std_k, has_voltage: false, load_within_n_m: 0.0 };
    let mut unit = Owned::drawn(experiment, days, 1.0, seed);
    let references = unit.records_as_new(line.references)?;
    let damage = line.damage.draw(&mut unit.chance);
    let sound = FaultCoordinates([0.0; 7]);
    let mut recordings = Vec::new();
    for day in 1..=line.days {
        let is_damaged = !line.only_last || day == line.days;
        let of_day = if is_damaged { damage } else { sound };
        recordings.extend(unit.record_several(of_day, line.each)?);
    }
    let options = DiagnoseOptions { tolerance: ToleranceUse::Model, ..DiagnoseOptions::default() };
    let learnt = if references.is_empty() {
        None
    } else {
        match diagnoser.learn_unit(&references, &options) {
            Ok(unit) => Some(Arc::new(unit)),
            Err(_) => return Ok(Judged { damage, together: None, last: None }),
        }
    };
    let options = DiagnoseOptions { unit: learnt, ..options };
    let alone = recordings.iter().map(|one| diagnoser.diagnose_alone(one, &options));
    let alone: Vec<DiagnosedAlone> = alone.filter_map(Result::ok).collect();
    let last = alone.last().map(|one| one.answer().clone());
    Ok(Judged { damage, together: diagnose_together(&alone).ok(), last })
}
