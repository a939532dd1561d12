//! Recordings of the bench, diagnosed with what its data sheet tells and with recordings of it as
//! new.

use fdi_core::{
    Bundle, Condition, Dataset, DatasetRequest, DiagnoseOptions, Diagnoser, EnvelopeSignal,
    Experiment, ExperimentError, Purpose, ReferenceDesign, RootSeed, SignalDiagnosis,
    ema_sim::{Actuator, HealthState, Imperfections, model_file::Model, presets::BENCH},
    in_parallel,
    report::FaultEvaluation,
};

use crate::{
    request::EvaluationError,
    score::{Trial, fault_scores, interval_holds, median},
    setting::EvaluationSetting,
};

/// Streams of the reference recordings and of the healthy ones.
const REFERENCE_STREAM: u64 = 1 << 41;
const HEALTHY_STREAM: u64 = 1 << 40;

/// Knowledge of the machine beforehand, besides recordings of it as new.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Beforehand<'a> {
    /// High-fidelity signals of the machine itself.
    Itself,
    /// High-fidelity signals of a machine that differs from it.
    Sheet(&'a Actuator),
    /// The low-fidelity model of the machine and its noise, without a high-fidelity signal.
    LowFidelity,
}

/// Recordings of the preset `bench` on the sine to evaluate.
#[derive(Clone, Copy, Debug)]
pub struct ReferenceRequest<'a> {
    /// Knowledge of the machine beforehand.
    pub beforehand: Beforehand<'a>,
    /// Numbers of recordings of the machine as new; a score for each.
    pub references: &'a [usize],
    /// Test conditions.
    pub conditions: usize,
    /// Healthy recordings, on which false alarms are counted.
    pub healthy: usize,
    /// Sensors, electronics and number of signals.
    pub setting: EvaluationSetting,
    /// Root seed.
    pub seed: u64,
    /// Threads.
    pub jobs: usize,
}

impl ReferenceRequest<'_> {
    /// 20 mA on each phase sample at 10 kHz, real electronics, 40 + 20 signals for two faults.
    pub const SETTING: EvaluationSetting = EvaluationSetting {
        imperfections: Imperfections::REAL,
        sensor_noise_a: 0.020,
        phase_rate_hz: 10_000.0,
        snapshots: 40,
        sparse_snapshots: 20,
    };
}

/// How recordings are diagnosed.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceScore {
    /// Recordings of the machine as new.
    pub references: usize,
    /// Errors of each fault, coverage of its intervals and false alarms.
    pub faults: Vec<FaultEvaluation>,
    /// Share of adequate fits, over test conditions and healthy recordings.
    pub adequate_frac: f64,
    /// Median evaluations of the monitor.
    pub evaluations_median: f64,
}

/// Diagnoses recordings of the bench, with each number of references.
///
/// # Errors
///
/// [`EvaluationError`] when the setting cannot be simulated or learnt from.
pub fn evaluate_references(
    request: &ReferenceRequest<'_>,
) -> Result<Vec<ReferenceScore>, EvaluationError> {
    let machine = bench(&BENCH)?;
    let bundle = match request.beforehand {
        Beforehand::Itself => request.setting.bundle(&machine, request.seed, request.jobs)?,
        Beforehand::Sheet(actuator) => {
            request.setting.bundle(&bench(actuator)?, request.seed, request.jobs)?
        }
        Beforehand::LowFidelity => low_fidelity_bundle(request, &machine)?,
    };
    let conditions = conditions(request, &machine, ReferenceDesign::Test, request.conditions)?;
    let observed = in_parallel(&conditions, request.jobs, |index, condition| {
        observe(request, &machine, index as u64, condition)
    })?;
    let most = request.references.iter().copied().max().unwrap_or(0);
    let references = as_new(request, &machine, REFERENCE_STREAM, most)?;
    let quiet = as_new(request, &machine, HEALTHY_STREAM, request.healthy)?;
    let score = |&count: &usize| {
        let diagnoser = Diagnoser::new(bundle.clone())?;
        let diagnoser = match count {
            0 => diagnoser,
            _ => diagnoser.referred_to_signals(&references[..count])?,
        };
        let of = |observed: &[EnvelopeSignal]| {
            in_parallel(observed, request.jobs, |_, one| diagnose(&diagnoser, one))
        };
        Ok(scored(&machine, count, &conditions, &of(&observed)?, &of(&quiet)?))
    };
    request.references.iter().map(score).collect()
}

/// Recordings of the machine as new.
fn as_new(
    request: &ReferenceRequest<'_>,
    experiment: &Experiment,
    first_stream: u64,
    count: usize,
) -> Result<Vec<EnvelopeSignal>, EvaluationError> {
    let streams: Vec<u64> = (0..count as u64).map(|index| first_stream + index).collect();
    in_parallel(&streams, request.jobs, |_, &stream| {
        observe(request, experiment, stream, &healthy(request, stream))
    })
}

/// The bench's test with a machine.
fn bench(actuator: &Actuator) -> Result<Experiment, ExperimentError> {
    Experiment::sine().of_model("bench", &Model::from(*actuator))
}

fn conditions(
    request: &ReferenceRequest<'_>,
    experiment: &Experiment,
    design: ReferenceDesign,
    conditions: usize,
) -> Result<Vec<Condition>, EvaluationError> {
    let (imperfections, seed) = (request.setting.imperfections, request.seed);
    let request = DatasetRequest { design, conditions, seed, imperfections, jobs: request.jobs };
    Ok(Dataset::conditions(experiment, &request)?)
}

/// The machine as new, with a stream of noise.
fn healthy(request: &ReferenceRequest<'_>, stream: u64) -> Condition {
    Condition {
        levels: HealthState::HEALTHY.levels(),
        start_angle_rad: 0.0,
        noise_seed: RootSeed(request.seed).derive(Purpose::ControllerNoise, stream),
    }
}

fn observe(
    request: &ReferenceRequest<'_>,
    experiment: &Experiment,
    stream: u64,
    condition: &Condition,
) -> Result<EnvelopeSignal, EvaluationError> {
    let seed = RootSeed(request.seed).derive(Purpose::SensorNoise, stream);
    let sensors = request.setting.seeded_sensors(seed);
    let signal_a = request.setting.signal(experiment, condition, sensors)?;
    Ok(request.setting.observed(signal_a))
}

fn diagnose(
    diagnoser: &Diagnoser,
    observation: &EnvelopeSignal,
) -> Result<SignalDiagnosis, EvaluationError> {
    Ok(diagnoser.diagnose_signal(observation, &DiagnoseOptions::default(), &|_| {})?)
}

/// A bundle whose signals are those of the low-fidelity model with the noise of the electronics:
/// what it says of the monitor's error is that noise alone.
fn low_fidelity_bundle(
    request: &ReferenceRequest<'_>,
    experiment: &Experiment,
) -> Result<Bundle, EvaluationError> {
    let ReferenceRequest { setting, seed, .. } = *request;
    let imperfections = setting.imperfections;
    let mut datasets = Vec::new();
    for (design, count) in [
        (ReferenceDesign::Incipient, setting.snapshots),
        (ReferenceDesign::Sparse, setting.sparse_snapshots),
    ] {
        let conditions = conditions(request, experiment, design, count)?;
        let signals_a = in_parallel(&conditions, request.jobs, |_, condition| {
            let angle_rad = condition.start_angle_rad;
            let mut noisy =
                experiment.noisy_monitor(angle_rad, imperfections, condition.noise_seed)?;
            Ok::<_, EvaluationError>(noisy.signal(&condition.coordinates()))
        })?;
        datasets.push(Dataset { design, seed, imperfections, conditions, signals_a });
    }
    Ok(Bundle::build(experiment, datasets, setting.noise_a(), RootSeed(seed))?)
}

fn scored(
    experiment: &Experiment,
    references: usize,
    conditions: &[Condition],
    diagnosed: &[SignalDiagnosis],
    quiet: &[SignalDiagnosis],
) -> ReferenceScore {
    let sought = experiment.sought_indices();
    let trials: Vec<Trial> = diagnosed
        .iter()
        .zip(conditions)
        .map(|(found, condition)| Trial::of(condition.levels, found))
        .collect();
    let mut faults = fault_scores(&sought, &trials);
    for (fault, &index) in faults.iter_mut().zip(&sought) {
        let held = diagnosed
            .iter()
            .zip(conditions)
            .filter(|(one, condition)| interval_holds(one, &condition.levels, index));
        fault.coverage_95 = Some(held.count() as f64 / diagnosed.len().max(1) as f64);
        let alarms = quiet.iter().filter(|one| one.answer.faults[index].detected == Some(true));
        fault.false_alarms = Some(alarms.count() as u64);
    }
    let all = diagnosed.iter().chain(quiet);
    let adequate = all.clone().filter(|one| one.answer.fit.adequate).count();
    ReferenceScore {
        references,
        faults,
        adequate_frac: adequate as f64 / all.count().max(1) as f64,
        evaluations_median: median(trials.iter().map(|trial| trial.evaluations as f64)),
    }
}
