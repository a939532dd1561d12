//! Recordings that begin otherwise than the bundle's test, diagnosed as if they did not and with
//! the start estimated.

use fdi_core::{
    Condition, Dataset, DatasetRequest, DiagnoseOptions, Diagnoser, Experiment, Purpose,
    ReferenceDesign, RootSeed,
    ema_sim::{Imperfections, InitialState, Scenario},
    in_parallel,
    report::{FaultEvaluation, NoticeCode, RecordDiagnosis},
};

use crate::{
    request::EvaluationError,
    score::{Trial, fault_scores, median},
    setting::EvaluationSetting,
};

/// How a recording begins.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Beginning {
    /// The command comes late in the recording by this, s.
    pub delay_s: f64,
    /// Place of the surface in its play, −1 to 1; the bundle's tests begin in the middle.
    pub side_ratio: f64,
    /// Integral part of the current set-point, A.
    pub speed_integral_a: f64,
    /// Integral part of the current loop's voltage.
    pub current_integral_v: f64,
}

/// Recordings of the chirp with sensor noise to evaluate.
#[derive(Clone, Copy, Debug)]
pub struct BeginningRequest<'a> {
    /// Name of each way to begin, and the way.
    pub beginnings: &'a [(&'a str, Beginning)],
    /// Test conditions for each.
    pub conditions: usize,
    /// The settings that the start is estimated with.
    pub estimated: &'a DiagnoseOptions,
    /// Sensors, electronics and what is known beforehand.
    pub setting: EvaluationSetting,
    /// Root seed.
    pub seed: u64,
    /// Threads.
    pub jobs: usize,
}

/// How recordings that begin in one way are diagnosed.
#[derive(Clone, Debug, PartialEq)]
pub struct BeginningScore {
    /// Name of the way.
    pub name: String,
    /// True where the start was estimated.
    pub estimated: bool,
    /// Errors of each fault.
    pub faults: Vec<FaultEvaluation>,
    /// Mean over `k1..k5`, `k6` cos and sin of squared error over stated variance, where the fit
    /// is adequate; the median over the recordings.
    pub chi2_median: Option<f64>,
    /// Mean over the recordings of the squared errors over their stated variances.
    pub chi2_mean: Option<f64>,
    /// Share of adequate fits.
    pub adequate_frac: f64,
    /// Share of answers with a notice that a level or the start is not as in the bundle.
    pub told_frac: f64,
    /// Median evaluations of the monitor.
    pub evaluations_median: f64,
}

/// Diagnoses recordings that begin in several ways, with the start taken as the bundle's and
/// estimated: two scores for each way.
///
/// # Errors
///
/// [`EvaluationError`] when the setting cannot be simulated or learnt from.
pub fn evaluate_beginnings(
    request: &BeginningRequest<'_>,
) -> Result<Vec<BeginningScore>, EvaluationError> {
    let experiment = Experiment::chirp();
    let bundle = request.setting.bundle(&experiment, request.seed, request.jobs)?;
    let diagnoser = Diagnoser::new(bundle)?;
    let conditions = Dataset::conditions(
        &experiment,
        &DatasetRequest {
            design: ReferenceDesign::Test,
            conditions: request.conditions,
            seed: request.seed,
            imperfections: request.setting.imperfections,
            jobs: request.jobs,
        },
    )?;
    let mut scores = Vec::new();
    for &(name, beginning) in request.beginnings {
        let recorded = record(request, &experiment, &conditions, &beginning)?;
        for estimated in [false, true] {
            let results = diagnose(request, &diagnoser, &recorded, estimated)?;
            scores.push(score(&experiment.sought_indices(), name, estimated, &results));
        }
    }
    Ok(scores)
}

/// A condition with the envelope that the sensors show of it.
struct Recorded<'a> {
    condition: &'a Condition,
    envelope_a: Vec<f64>,
}

/// A diagnosis, judged by the truth.
struct Judged {
    trial: Trial,
    /// Mean squared error over stated variance.
    chi2: f64,
    answer: RecordDiagnosis,
}

/// Simulates every condition, begun in one way.
fn record<'a>(
    request: &BeginningRequest<'_>,
    experiment: &Experiment,
    conditions: &'a [Condition],
    beginning: &Beginning,
) -> Result<Vec<Recorded<'a>>, EvaluationError> {
    let scenario = Scenario {
        backlash_side_ratio: beginning.side_ratio,
        initial: InitialState {
            speed_integral_a: beginning.speed_integral_a,
            current_integral_v: beginning.current_integral_v,
            ..InitialState::default()
        },
        ..experiment.scenario.clone()
    };
    let begun = Experiment { scenario, ..experiment.clone() };
    let indexed: Vec<(usize, &Condition)> = conditions.iter().enumerate().collect();
    in_parallel(&indexed, request.jobs, |_, &(index, condition)| {
        let seed = RootSeed(request.seed).derive(Purpose::SensorNoise, index as u64);
        let sensors = request.setting.seeded_sensors(seed);
        let delay_s = beginning.delay_s;
        let envelope_a = request.setting.delayed_envelope(&begun, condition, sensors, delay_s)?;
        Ok(Recorded { condition, envelope_a })
    })
}

/// Diagnoses the recordings, the start taken as the bundle's or estimated.
fn diagnose(
    request: &BeginningRequest<'_>,
    diagnoser: &Diagnoser,
    recorded: &[Recorded<'_>],
    estimated: bool,
) -> Result<Vec<Judged>, EvaluationError> {
    let noise_a = Some(request.setting.noise_a());
    let options = if estimated { request.estimated.clone() } else { DiagnoseOptions::default() };
    let options = DiagnoseOptions { noise_a, ..options };
    let rate_hz = request.setting.phase_rate_hz;
    in_parallel(recorded, request.jobs, |_, Recorded { condition, envelope_a }| {
        let signal_a = diagnoser.bundle().experiment.filtered_envelope(envelope_a, rate_hz);
        let observed = request.setting.observed(signal_a).with_envelope(envelope_a.clone());
        let found = diagnoser.diagnose_signal(&observed, &options, &|_| {})?;
        let truth = condition.coordinates();
        let squares = found.indices.iter().enumerate().map(|(place, &fault)| {
            let error = found.estimate[place] - truth.0[fault];
            error * error / found.covariance[place][place]
        });
        let chi2 = squares.sum::<f64>() / found.indices.len() as f64;
        let trial = Trial::of(condition.levels, &found);
        Ok(Judged { trial, chi2, answer: found.answer })
    })
}

/// Notices that an answer may be wrong by more than it states.
const LIMITS: [NoticeCode; 7] = [
    NoticeCode::OutsideTraining,
    NoticeCode::StartAngleNotLearnt,
    NoticeCode::PhasesSampledSlowly,
    NoticeCode::NoiseAboveBundle,
    NoticeCode::NoiseHidesLevels,
    NoticeCode::StartEstimated,
    NoticeCode::StartSuspected,
];

fn score(sought: &[usize], name: &str, estimated: bool, results: &[Judged]) -> BeginningScore {
    let count = results.len().max(1) as f64;
    let share = |holds: &dyn Fn(&RecordDiagnosis) -> bool| {
        results.iter().filter(|one| holds(&one.answer)).count() as f64 / count
    };
    let adequate = results.iter().filter(|one| one.answer.fit.adequate);
    let believed: Vec<f64> = adequate.map(|one| one.chi2).collect();
    let trials: Vec<Trial> = results.iter().map(|one| one.trial.clone()).collect();
    BeginningScore {
        name: name.to_owned(),
        estimated,
        faults: fault_scores(sought, &trials),
        chi2_median: (!believed.is_empty()).then(|| median(believed.iter().copied())),
        chi2_mean: (!believed.is_empty())
            .then(|| believed.iter().sum::<f64>() / believed.len() as f64),
        adequate_frac: share(&|answer| answer.fit.adequate),
        told_frac: share(&|answer| {
            answer.notices.iter().any(|notice| LIMITS.contains(&notice.code))
        }),
        evaluations_median: median(trials.iter().map(|trial| trial.evaluations as f64)),
    }
}

/// The setting of recordings with real electronics and noise of the sensors.
impl BeginningRequest<'_> {
    /// 20 mA on each phase sample at 10 kHz, real electronics, 100 + 100 reference signals: what
    /// the embedded bundle of the chirp is learnt on.
    pub const SETTING: EvaluationSetting = EvaluationSetting {
        imperfections: Imperfections::REAL,
        sensor_noise_a: 0.020,
        phase_rate_hz: 10_000.0,
        snapshots: 100,
        sparse_snapshots: 100,
    };
}
