//! Sensor noise: errors against the Cramér-Rao bound, coverage, false alarms, detection.

use ema_sim::{FAULT_COUNT, FaultCoordinates, HealthState, PhaseSensors, PhysicalFaults};
use nalgebra::{DMatrix, Vector2};

use super::{
    EvaluationError, EvaluationRequest, in_parallel,
    score::Trial,
    score::{fault_scores, levels_of, median},
    setting::EvaluationSetting,
    test_conditions,
};
use crate::{
    diagnose::Diagnoser,
    offline::{dataset::Condition, estimator::information, factor::Factor},
    online::cache::ErrorId,
    online::error::DiagnoseError,
    online::options::DiagnoseOptions,
    online::{likelihood::Likelihood, posterior::Posterior},
    report::{DetectionPoint, FaultEvaluation, MethodEvaluation, RecordDiagnosis},
    seed::{Purpose, RootSeed},
    simulation::{experiment::Experiment, resampling::resampled},
    statistics::central,
};

/// Differences for the bound's derivatives.
const STEP: f64 = 1e-3;
/// Quantile of χ² with two degrees of freedom at 95 %.
const REGION_95: f64 = 5.991_464_547_107_979;
/// Phases that carry the current at any time, each with noise of its own.
const CONDUCTING_PHASES: f64 = 2.0;
/// Parts that the range of levels is cut into for the curves of detection.
const DETECTION_BINS: usize = 12;
/// Largest level of a test condition.
const LARGEST_LEVEL: f64 = 0.05;
/// First of the streams of healthy recordings; those of the test conditions begin at 0.
const HEALTHY_STREAM: u64 = 1 << 40;
/// Where the eccentricity stands in the coordinates.
const ECCENTRICITY: [usize; 2] = [5, 6];

/// What one recording gave.
struct Sample {
    trial: Trial,
    answer: RecordDiagnosis,
    posterior: Posterior,
    /// Error of each coordinate looked for.
    error: Vec<f64>,
    bounds: Bounds3,
}

/// Bounds of each coordinate looked for.
struct Bounds3 {
    /// Sensor noise and the monitor's error.
    whole: Vec<f64>,
    /// Sensor noise on the filtered envelope.
    sensor: Vec<f64>,
    /// Sensor noise on the raw phase currents.
    phase: Vec<f64>,
}

/// Runs the test conditions and the healthy recordings.
pub(super) fn run(
    request: &EvaluationRequest<'_>,
) -> Result<Vec<MethodEvaluation>, EvaluationError> {
    let experiment = request.protocol.experiment();
    let bundle = request.setting.bundle(&experiment, request.seed, request.jobs)?;
    let conditions = test_conditions(&experiment, request)?;
    let diagnoser = Diagnoser::new(bundle)?;
    let trial = NoisyTrial::new(request, &diagnoser)?;
    let samples =
        in_parallel(&conditions, request.jobs, |i, condition| trial.sample(i as u64, condition))?;
    let indices: Vec<u64> = (0..request.healthy as u64).collect();
    let alarms = in_parallel(&indices, request.jobs, |_, &index| trial.healthy(index))?;
    Ok(vec![summary(&experiment.sought_indices(), &samples, &alarms)])
}

/// What every recording is diagnosed with.
struct NoisyTrial<'a> {
    setting: EvaluationSetting,
    root: RootSeed,
    diagnoser: &'a Diagnoser,
    sensors: PhaseSensors,
    likelihood: std::sync::Arc<Likelihood>,
    sensor_factor: Factor,
}

impl<'a> NoisyTrial<'a> {
    fn new(
        request: &EvaluationRequest<'_>,
        diagnoser: &'a Diagnoser,
    ) -> Result<Self, EvaluationError> {
        let setting = request.setting;
        let sensors = setting.sensors().ok_or(EvaluationError::NoNoise)?;
        let noise_a = setting.noise_a();
        let likelihood =
            diagnoser.learnt.likelihood(ErrorId::Incipient, setting.phase_rate_hz, noise_a)?;
        let unit = diagnoser.learnt.unit_noise(setting.phase_rate_hz);
        let sensor_factor =
            Factor::new(unit.scaled(noise_a * noise_a), None).map_err(DiagnoseError::from)?;
        let root = RootSeed(request.seed);
        Ok(Self { setting, root, diagnoser, sensors, likelihood, sensor_factor })
    }

    fn experiment(&self) -> &Experiment {
        &self.diagnoser.bundle().experiment
    }

    /// A recording with faults.
    fn sample(&self, index: u64, condition: &Condition) -> Result<Sample, EvaluationError> {
        let (answer, posterior) = self.diagnose(index, condition)?;
        let truth = condition.coordinates();
        let sought = &posterior.indices;
        let error = posterior.estimate.iter().zip(sought).map(|(e, &i)| e - truth.0[i]).collect();
        let bounds = self.bounds(&truth)?;
        let trial = Trial {
            truth: condition.levels,
            found: levels_of(sought, &posterior.estimate),
            discrepancy: answer.discrepancy,
            evaluations: answer.evaluations,
            wall_time_s: 0.0,
        };
        Ok(Sample { trial, answer, posterior, error, bounds })
    }

    /// Which faults are called detected on a healthy recording.
    fn healthy(&self, index: u64) -> Result<[bool; FAULT_COUNT], EvaluationError> {
        let stream = HEALTHY_STREAM + index;
        let condition = Condition {
            levels: HealthState::HEALTHY.levels(),
            start_angle_rad: 0.0,
            noise_seed: self.root.derive(Purpose::ControllerNoise, stream),
        };
        let (answer, _) = self.diagnose(stream, &condition)?;
        Ok(std::array::from_fn(|fault| answer.faults[fault].detected == Some(true)))
    }

    fn diagnose(
        &self,
        stream: u64,
        condition: &Condition,
    ) -> Result<(RecordDiagnosis, Posterior), EvaluationError> {
        let seed = self.root.derive(Purpose::SensorNoise, stream);
        let sensors = Some((self.sensors, seed));
        let signal_a = self.setting.signal(self.experiment(), condition, sensors)?;
        let observation = self.setting.observation(signal_a);
        let noise_a = Some(self.setting.noise_a());
        let options = DiagnoseOptions { noise_a, ..DiagnoseOptions::default() };
        Ok(self.diagnoser.diagnose_observation(&observation, &options)?)
    }

    /// The bounds at the truth.
    fn bounds(&self, truth: &FaultCoordinates) -> Result<Bounds3, EvaluationError> {
        let experiment = self.experiment();
        let sought = experiment.sought_indices();
        let centre: Vec<f64> = sought.iter().map(|&i| truth.0[i]).collect();
        let mut monitor = experiment.monitor(0.0)?;
        let raw = experiment.low_fidelity(&experiment.scenario)?;
        let raw_hz = experiment.actuator.controller.sample_hz;
        let mut signal = |point: &[f64]| self.diagnoser.learnt.monitored(&mut monitor, point);
        let jacobian = central::differences(&centre, STEP, &mut signal);
        let mut current = |point: &[f64]| {
            let mut all = FaultCoordinates([0.0; FAULT_COUNT]);
            for (&index, &value) in sought.iter().zip(point) {
                all.0[index] = value;
            }
            let mut current_a = Vec::new();
            raw.simulate_current(&PhysicalFaults::from(&all), &mut current_a);
            resampled(&current_a, raw_hz, self.setting.phase_rate_hz)
        };
        let phases = central::differences(&centre, STEP, &mut current);
        let noise_a = self.setting.noise_a();
        let order = sought.len();
        let phase = DMatrix::from_fn(order, order, |i, j| {
            CONDUCTING_PHASES * crate::statistics::banded::dot(&phases[i], &phases[j])
                / (noise_a * noise_a)
        });
        let std = |covariance: Option<DMatrix<f64>>| -> Result<Vec<f64>, EvaluationError> {
            let covariance = covariance.ok_or(DiagnoseError::Undetermined)?;
            Ok(covariance.diagonal().iter().map(|v| v.sqrt()).collect())
        };
        Ok(Bounds3 {
            whole: std(self.likelihood.bound(&jacobian))?,
            sensor: std(information(&self.sensor_factor, &jacobian).try_inverse())?,
            phase: std(phase.try_inverse())?,
        })
    }
}

fn summary(
    sought: &[usize],
    samples: &[Sample],
    alarms: &[[bool; FAULT_COUNT]],
) -> MethodEvaluation {
    let trials: Vec<Trial> = samples.iter().map(|sample| sample.trial.clone()).collect();
    let mut faults = fault_scores(sought, &trials);
    let (mut held, mut asked) = (0, 0);
    for (place, fault) in faults.iter_mut().enumerate() {
        let index = sought[place];
        describe(fault, place, index, samples);
        if index == ECCENTRICITY[1] {
            continue;
        }
        let holds = samples.iter().filter(|sample| sample.holds(index)).count();
        held += holds;
        asked += samples.len();
        fault.coverage_95 = Some(holds as f64 / samples.len().max(1) as f64);
        fault.false_alarms = Some(alarms.iter().filter(|alarm| alarm[index]).count() as u64);
        fault.detection = detection(index, samples);
    }
    let medians = faults.iter().filter_map(|f| f.error_percent.map(|q| q.median));
    MethodEvaluation {
        method: "composite".to_owned(),
        average_percent: medians.sum::<f64>() / faults.len() as f64,
        predicted_percent: None,
        evaluations_median: median(trials.iter().map(|trial| trial.evaluations as f64)),
        discrepancy_median: Some(median(trials.iter().map(|trial| trial.discrepancy))),
        model_time_s: None,
        wall_time_s: None,
        wall_time_min_s: None,
        coverage_95: Some(f64::from(held as u32) / asked.max(1) as f64),
        healthy: Some(alarms.len() as u64),
        convergence: Vec::new(),
        faults,
    }
}

/// Errors against bounds; `k6` over both components of the eccentricity.
fn describe(fault: &mut FaultEvaluation, place: usize, index: usize, samples: &[Sample]) {
    let places = if index == ECCENTRICITY[0] { place..place + 2 } else { place..place + 1 };
    let of =
        |pick: fn(&Bounds3) -> &Vec<f64>| median(samples.iter().map(|s| pick(&s.bounds)[place]));
    let ratio = |pick: fn(&Bounds3) -> &Vec<f64>| {
        let squares = samples
            .iter()
            .flat_map(|s| places.clone().map(move |p| (s.error[p] / pick(&s.bounds)[p]).powi(2)));
        (squares.sum::<f64>() / (samples.len() * places.len()).max(1) as f64).sqrt()
    };
    fault.bound_std = Some(of(|bounds| &bounds.whole));
    fault.sensor_bound_std = Some(of(|bounds| &bounds.sensor));
    fault.phase_bound_std = Some(of(|bounds| &bounds.phase));
    fault.rmse_over_bound = Some(ratio(|bounds| &bounds.whole));
    fault.rmse_over_sensor_bound = Some(ratio(|bounds| &bounds.sensor));
}

impl Sample {
    /// Whether the fault's 95 % interval holds the truth; for `k6` its region with `k7`.
    fn holds(&self, index: usize) -> bool {
        if index != ECCENTRICITY[0] {
            let truth = self.trial.truth[index];
            return self.answer.faults[index]
                .interval_95
                .is_some_and(|[low, high]| (low..=high).contains(&truth));
        }
        let places = ECCENTRICITY.map(|e| self.posterior.indices.iter().position(|&i| i == e));
        let [Some(x), Some(y)] = places else { return false };
        let covariance = self.posterior.covariance.select_rows(&[x, y]).select_columns(&[x, y]);
        let error = Vector2::new(self.error[x], self.error[y]);
        covariance.try_inverse().is_some_and(|inverse| {
            let distance2 = error.dot(&Vector2::new(
                inverse[(0, 0)] * error.x + inverse[(0, 1)] * error.y,
                inverse[(1, 0)] * error.x + inverse[(1, 1)] * error.y,
            ));
            distance2 <= REGION_95
        })
    }
}

/// Probability of detection against the level, all other faults at any level of the design.
fn detection(index: usize, samples: &[Sample]) -> Vec<DetectionPoint> {
    let width = LARGEST_LEVEL / DETECTION_BINS as f64;
    (0..DETECTION_BINS)
        .filter_map(|bin| {
            let range = bin as f64 * width..(bin + 1) as f64 * width;
            let inside: Vec<&Sample> =
                samples.iter().filter(|s| range.contains(&s.trial.truth[index])).collect();
            let found =
                inside.iter().filter(|s| s.answer.faults[index].detected == Some(true)).count();
            (!inside.is_empty()).then(|| DetectionPoint {
                level: (bin as f64 + 0.5) * width,
                conditions: inside.len() as u64,
                detected_frac: found as f64 / inside.len() as f64,
            })
        })
        .collect()
}
