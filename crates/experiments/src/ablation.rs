//! Diagnoses that look at fewer numbers than the whole signal, and the error that this leaves.

use fdi_core::{
    Bundle, Condition, Dataset, DatasetRequest, DiagnoseError, DiagnoseOptions, Diagnoser,
    Experiment, Purpose, ReferenceDesign, RootSeed, SignalDiagnosis,
    ema_sim::{EnvelopeFilter, FAULT_COUNT},
    in_parallel,
    reduction::CompressionConfig,
    report::FaultEvaluation,
};

use crate::{
    request::EvaluationError,
    score::{Trial, errors_percent, fault_scores, interval_holds, levels_of, median},
    setting::EvaluationSetting,
};

/// Resamples of the conditions that an interval of a ratio of errors rests on.
const RESAMPLES: usize = 1000;
/// The middle share of the resamples that is stated.
const MIDDLE: [f64; 2] = [0.025, 0.975];

/// The numbers that a diagnosis looks at.
#[derive(Clone, Debug, PartialEq)]
pub enum Compression {
    /// Every sample of the envelope at the rate of the phases, without the filter.
    Raw,
    /// Every sample of the filtered envelope.
    Full,
    /// Numbers that a compression of the filtered envelope keeps, fitted to the reference signals.
    Map(Box<CompressionConfig>),
}

/// Diagnoses of the paper's test conditions by compressions.
#[derive(Clone, Copy, Debug)]
pub struct AblationRequest<'a> {
    /// Electronics, sensors and what is known beforehand.
    pub setting: EvaluationSetting,
    /// Test conditions.
    pub conditions: usize,
    /// Compressions, one score each.
    pub compressions: &'a [Compression],
    /// Root seed; conditions, noise and the reference signals derive theirs from it.
    pub seed: u64,
    /// Threads.
    pub jobs: usize,
}

/// Diagnoses of all test conditions by one compression.
#[derive(Clone, Debug, PartialEq)]
pub struct AblationScore {
    /// Numbers looked at.
    pub numbers: usize,
    /// Errors of `k1` to `k7`.
    pub faults: Vec<FaultEvaluation>,
    /// Mean over the faults of the median of eq. 20, %.
    pub average_percent: f64,
    /// Share of the 95 % intervals of `k1` to `k6` that hold the truth.
    pub coverage_95: f64,
    /// Median over the conditions of the stated standard deviations of `k1` to `k5`.
    pub std: Vec<f64>,
    /// Conditions of which nothing could be said; each counts as all faults absent.
    pub undetermined: usize,
    /// Percentage error of `k1` to `k7`, a row a condition.
    errors_percent: Vec<Vec<f64>>,
}

/// Diagnoses the conditions with each of what may be looked at.
///
/// The signals, the noise, the learnt error and the estimator (generalised least squares) are the
/// same for all: the errors differ by what the compression leaves out.
///
/// # Errors
///
/// [`EvaluationError`] when the setting cannot be simulated or learnt from, or a compression cannot
/// be fitted.
pub fn evaluate_compressions(
    request: &AblationRequest<'_>,
) -> Result<Vec<AblationScore>, EvaluationError> {
    let filtered = Experiment::chirp();
    let rate_hz = request.setting.phase_rate_hz;
    // a low-pass far above every frequency leaves a signal as it is
    let filter = EnvelopeFilter { corner_hz: f64::INFINITY, output_hz: rate_hz };
    let raw = Experiment { filter, ..filtered.clone() };
    let filtered = World::new(request, &filtered)?;
    let score = |compression: &Compression| match compression {
        Compression::Raw => {
            let world = World::new(request, &raw)?;
            world.score(&Diagnoser::new(world.bundle.clone())?, world.samples())
        }
        Compression::Full => {
            filtered.score(&Diagnoser::new(filtered.bundle.clone())?, filtered.samples())
        }
        Compression::Map(config) => {
            let diagnoser = Diagnoser::with_compression(filtered.bundle.clone(), config)?;
            filtered.score(&diagnoser, config.count)
        }
    };
    request.compressions.iter().map(score).collect()
}

/// The test conditions as an experiment shows them, and what is learnt beforehand.
struct World<'a> {
    request: &'a AblationRequest<'a>,
    bundle: Bundle,
    conditions: Vec<Condition>,
    signals_a: Vec<Vec<f64>>,
}

impl<'a> World<'a> {
    fn new(
        request: &'a AblationRequest<'a>,
        experiment: &Experiment,
    ) -> Result<Self, EvaluationError> {
        let AblationRequest { setting, seed, jobs, .. } = *request;
        let bundle = setting.bundle(experiment, seed, jobs)?;
        let imperfections = setting.imperfections;
        let design = ReferenceDesign::Test;
        let drawn =
            DatasetRequest { design, conditions: request.conditions, seed, imperfections, jobs };
        let conditions = Dataset::conditions(experiment, &drawn)?;
        let signals_a = in_parallel(&conditions, jobs, |index, condition| {
            let noise = RootSeed(seed).derive(Purpose::SensorNoise, index as u64);
            setting.signal(experiment, condition, setting.seeded_sensors(noise))
        })?;
        Ok(Self { request, bundle, conditions, signals_a })
    }

    fn samples(&self) -> usize {
        self.bundle.experiment.samples()
    }

    /// Diagnoses every condition.
    fn score(
        &self,
        diagnoser: &Diagnoser,
        numbers: usize,
    ) -> Result<AblationScore, EvaluationError> {
        let setting = &self.request.setting;
        let noise_a = Some(setting.noise_a());
        let options = DiagnoseOptions { noise_a, ..DiagnoseOptions::default() };
        let found = in_parallel(&self.signals_a, self.request.jobs, |_, signal_a| {
            let signal = setting.observed(signal_a.clone());
            match diagnoser.diagnose_signal(&signal, &options, &|_| {}) {
                Err(DiagnoseError::Undetermined) => Ok(None),
                other => Ok::<_, EvaluationError>(Some(other?)),
            }
        })?;
        let sought = self.bundle.experiment.sought_indices();
        Ok(AblationScore::of(&sought, numbers, &self.conditions, &found))
    }
}

impl AblationScore {
    fn of(
        sought: &[usize],
        numbers: usize,
        conditions: &[Condition],
        found: &[Option<SignalDiagnosis>],
    ) -> Self {
        let trial = |(condition, found): (&Condition, &Option<SignalDiagnosis>)| match found {
            Some(found) => Trial::of(condition.levels, found),
            None => Trial {
                truth: condition.levels,
                found: levels_of(sought, &vec![0.0; sought.len()]),
                discrepancy: f64::NAN,
                evaluations: 0,
                wall_time_s: 0.0,
            },
        };
        let trials: Vec<Trial> = conditions.iter().zip(found).map(trial).collect();
        let faults = fault_scores(sought, &trials);
        let errors = |trial: &Trial| errors_percent(sought, &trial.truth, &trial.found);
        let errors_percent: Vec<Vec<f64>> = trials.iter().map(errors).collect();
        let all: Vec<usize> = (0..conditions.len()).collect();
        let std = |fault: usize| {
            let stated = found.iter().flatten().filter_map(|one| one.answer.faults[fault].std);
            median(stated)
        };
        Self {
            numbers,
            average_percent: average_of(&errors_percent, &all),
            coverage_95: coverage(conditions, found),
            std: (0..ECCENTRICITY).map(std).collect(),
            undetermined: found.iter().filter(|one| one.is_none()).count(),
            faults,
            errors_percent,
        }
    }

    /// Average error over that of another score of the same conditions, with the interval that
    /// holds 95 % of the ratios when the conditions are drawn again.
    pub fn ratio_to(&self, other: &Self, seed: u64) -> (f64, [f64; 2]) {
        let conditions = self.errors_percent.len();
        let ratio = |drawn: &[usize]| {
            average_of(&self.errors_percent, drawn) / average_of(&other.errors_percent, drawn)
        };
        let root = RootSeed(seed);
        let mut ratios: Vec<f64> = (0..RESAMPLES)
            .map(|sample| {
                let index = |place: usize| (sample * conditions + place) as u64;
                let draw = |place| root.derive(Purpose::Diagnosis, index(place)) as usize;
                let drawn: Vec<usize> = (0..conditions).map(|p| draw(p) % conditions).collect();
                ratio(&drawn)
            })
            .collect();
        ratios.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| ratios[(share * (RESAMPLES - 1) as f64).round() as usize];
        let all: Vec<usize> = (0..conditions).collect();
        (ratio(&all), MIDDLE.map(at))
    }
}

/// Faults before the eccentricity, whose levels have intervals of their own.
const ECCENTRICITY: usize = 5;

/// Mean over the faults of the median over some conditions, %.
fn average_of(errors_percent: &[Vec<f64>], conditions: &[usize]) -> f64 {
    let faults = errors_percent.first().map_or(0, Vec::len);
    let median_of = |fault: usize| median(conditions.iter().map(|&c| errors_percent[c][fault]));
    (0..faults).map(median_of).sum::<f64>() / faults as f64
}

/// Share of the intervals of `k1` to `k6` that hold the truth; nothing said holds nothing.
fn coverage(conditions: &[Condition], found: &[Option<SignalDiagnosis>]) -> f64 {
    let intervals = FAULT_COUNT - 1;
    let held = |(condition, found): (&Condition, &Option<SignalDiagnosis>)| {
        let held = |&fault: &usize| {
            found.as_ref().is_some_and(|one| interval_holds(one, &condition.levels, fault))
        };
        (0..intervals).filter(held).count()
    };
    let held: usize = conditions.iter().zip(found).map(held).sum();
    held as f64 / (intervals * conditions.len()).max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use fdi_core::{
        ema_sim::Imperfections,
        reduction::{Encoding as Kept, Placement},
    };

    fn scores(seed: u64, jobs: usize) -> Vec<AblationScore> {
        let points = CompressionConfig {
            encoding: Kept::Points(Placement::Uniform),
            ..CompressionConfig::default()
        };
        let compressions = [Compression::Full, Compression::Map(Box::new(points))];
        let setting = EvaluationSetting {
            imperfections: Imperfections::NONE,
            sensor_noise_a: 0.020,
            phase_rate_hz: 10_000.0,
            snapshots: 40,
            sparse_snapshots: 0,
        };
        evaluate_compressions(&AblationRequest {
            setting,
            conditions: 8,
            compressions: &compressions,
            seed,
            jobs,
        })
        .unwrap()
    }

    #[test]
    fn fewer_numbers_leave_larger_errors() {
        let found = scores(3, 2);
        assert_eq!([found[0].numbers, found[1].numbers], [1000, 30]);
        let (ratio, [low, high]) = found[1].ratio_to(&found[0], 0);
        assert!(ratio > 1.0 && low <= ratio && ratio <= high, "{low} {ratio} {high}");
        let wider = found[1].std.iter().zip(&found[0].std).all(|(few, all)| few > all);
        assert!(wider, "{found:?}");
    }

    #[test]
    fn scores_depend_on_the_seed_and_not_on_threads() {
        assert_eq!(scores(3, 1), scores(3, 2));
        assert_ne!(scores(3, 1), scores(4, 1));
    }

    #[test]
    fn a_score_equals_itself() {
        let found = scores(3, 2);
        assert_eq!(found[0].ratio_to(&found[0], 0), (1.0, [1.0, 1.0]));
    }
}
