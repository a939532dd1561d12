//! Answers to recordings of hidden machines, beside those to their twins: recordings of the same
//! machines as the bundle expects them.

use fdi_core::{
    Condition, Dataset, DatasetError, DatasetRequest, Experiment, ReferenceDesign,
    ema_sim::{Converter, FAULT_COUNT, Imperfections, PhaseSensors},
    report::{RecordDiagnosis, Verdict},
};

use crate::score::median;

/// Sensors of the recordings: 20 mA, 12 bits over ±20 A.
pub(crate) const SENSORS: PhaseSensors =
    PhaseSensors { noise_a: 0.020, converter: Some(Converter::DEFAULT) };
/// Levels that are scored: k1 to k5; the eccentricity has none where it is absent.
const SCORED: usize = 5;
/// No damage; the direction of no eccentricity means nothing.
const SOUND: [f64; FAULT_COUNT] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5];

/// Machines without damage, then as many at conditions of the design `test`, numbered from 0.
pub(crate) fn sound_and_damaged(
    experiment: &Experiment,
    machines: usize,
    seed: u64,
    jobs: usize,
) -> Result<Vec<(usize, Condition)>, DatasetError> {
    let damaged = Dataset::conditions(
        experiment,
        &DatasetRequest {
            design: ReferenceDesign::Test,
            conditions: machines,
            seed,
            imperfections: Imperfections::REAL,
            jobs,
        },
    )?;
    let sound = damaged.iter().map(|one| Condition { levels: SOUND, ..*one });
    Ok(sound.chain(damaged.iter().copied()).enumerate().collect())
}

/// Answer to one recording, and what was true of its machine.
pub(crate) struct Answered {
    pub(crate) truth: [f64; FAULT_COUNT],
    /// `None` where the recording was refused.
    pub(crate) answer: Option<RecordDiagnosis>,
}

/// Answers to recordings of one kind.
#[derive(Clone, Debug, PartialEq)]
pub struct AnswersScore {
    /// Recordings of machines without damage, and of damaged ones.
    pub recordings: [usize; 2],
    /// Machines without damage that are called faulty.
    pub false_alarms: usize,
    /// Machines without damage that are called healthy.
    pub healthy: usize,
    /// Damaged machines that are called faulty.
    pub faulty: usize,
    /// Recordings that are called inadequate.
    pub inadequate: usize,
    /// Recordings that are refused.
    pub refused: usize,
    /// Intervals of 95 % of k1 to k5 that hold the truth, and all of them.
    pub held: (usize, usize),
    /// Standard deviation of k1 to k5 over that of the twin: median and largest.
    pub width: (f64, f64),
}

impl AnswersScore {
    /// Scores answers, each beside that to its twin.
    pub(crate) fn of(answered: &[(&Answered, &Answered)]) -> Self {
        let is_sound = |one: &Answered| one.truth == SOUND;
        let count = |holds: &dyn Fn(&Answered, &RecordDiagnosis) -> bool| {
            let answers = answered.iter().filter_map(|(one, _)| Some((one, one.answer.as_ref()?)));
            answers.filter(|(one, answer)| holds(one, answer)).count()
        };
        let of = |verdict: Verdict, sound: bool| {
            count(&|one, answer| answer.verdict == verdict && is_sound(one) == sound)
        };
        let (mut held, mut all, mut widths) = (0, 0, Vec::new());
        for (one, twin) in answered {
            let (Some(answer), Some(twin)) = (&one.answer, &twin.answer) else { continue };
            for fault in 0..SCORED {
                let (found, as_bundled) = (&answer.faults[fault], &twin.faults[fault]);
                let Some([low, high]) = found.interval_95 else { continue };
                all += 1;
                held += usize::from((low..=high).contains(&one.truth[fault]));
                widths.extend(found.std.zip(as_bundled.std).map(|(own, twin)| own / twin));
            }
        }
        let sound = answered.iter().filter(|(one, _)| is_sound(one)).count();
        Self {
            recordings: [sound, answered.len() - sound],
            false_alarms: of(Verdict::Faulty, true),
            healthy: of(Verdict::Healthy, true),
            faulty: of(Verdict::Faulty, false),
            inadequate: count(&|_, answer| answer.verdict == Verdict::ModelInadequate),
            refused: answered.iter().filter(|(one, _)| one.answer.is_none()).count(),
            held: (held, all),
            width: (
                median(widths.iter().copied()),
                widths.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            ),
        }
    }

    /// Share of the intervals that hold the truth, percent.
    pub fn held_percent(&self) -> f64 {
        let (held, all) = self.held;
        100.0 * held as f64 / all.max(1) as f64
    }
}
