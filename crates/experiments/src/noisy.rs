//! Sensor noise: errors against the Cramér-Rao bound, coverage, false alarms, detection.

use fdi_core::{
    Condition, DiagnoseOptions, Diagnoser, ErrorBound, ErrorBounds, Experiment, Purpose, RootSeed,
    SignalDiagnosis,
    ema_sim::{FAULT_COUNT, HealthState},
    in_parallel,
    report::{DetectionPoint, FaultEvaluation, MethodEvaluation},
};

use crate::{
    request::{EvaluationError, EvaluationRequest, test_conditions},
    score::{Trial, fault_scores, interval_holds, median},
    setting::EvaluationSetting,
};

/// Quantile of χ² with two degrees of freedom at 95 %.
const REGION_95: f64 = 5.991_464_547_107_979;
/// Parts that the range of levels is cut into for the curves of detection.
const DETECTION_BINS: usize = 12;
/// Largest level of a test condition.
const LARGEST_LEVEL: f64 = 0.05;
/// First of the streams of healthy recordings; those of the test conditions begin at 0.
const HEALTHY_STREAM: u64 = 1 << 40;
/// Where the eccentricity stands in the coordinates.
const ECCENTRICITY: [usize; 2] = [5, 6];

/// The diagnosis of one recording, beside the truth.
struct Sample {
    trial: Trial,
    found: SignalDiagnosis,
    /// Error of each coordinate looked for.
    error: Vec<f64>,
    bounds: ErrorBound,
}

/// Runs the test conditions and the healthy recordings.
pub(crate) fn run(
    request: &EvaluationRequest<'_>,
) -> Result<Vec<MethodEvaluation>, EvaluationError> {
    let experiment = request.protocol.experiment()?;
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

/// The diagnoser of every recording, with the bounds of its errors.
struct NoisyTrial<'a> {
    setting: EvaluationSetting,
    root: RootSeed,
    diagnoser: &'a Diagnoser,
    bounds: ErrorBounds<'a>,
}

impl<'a> NoisyTrial<'a> {
    fn new(
        request: &EvaluationRequest<'_>,
        diagnoser: &'a Diagnoser,
    ) -> Result<Self, EvaluationError> {
        let setting = request.setting;
        setting.seeded_sensors(0).ok_or(EvaluationError::NoNoise)?;
        let bounds = ErrorBounds::new(diagnoser, setting.phase_rate_hz, setting.noise_a())?;
        Ok(Self { setting, root: RootSeed(request.seed), diagnoser, bounds })
    }

    fn experiment(&self) -> &Experiment {
        &self.diagnoser.bundle().experiment
    }

    /// A recording with faults.
    fn sample(&self, index: u64, condition: &Condition) -> Result<Sample, EvaluationError> {
        let found = self.diagnose(index, condition)?;
        let truth = condition.coordinates();
        let sought = &found.indices;
        let error = found.estimate.iter().zip(sought).map(|(e, &i)| e - truth.0[i]).collect();
        let bounds = self.bounds.at(&truth)?;
        let trial = Trial::of(condition.levels, &found);
        Ok(Sample { trial, found, error, bounds })
    }

    /// Which faults are called detected on a healthy recording.
    fn healthy(&self, index: u64) -> Result<[bool; FAULT_COUNT], EvaluationError> {
        let stream = HEALTHY_STREAM + index;
        let condition = Condition {
            levels: HealthState::HEALTHY.levels(),
            start_angle_rad: 0.0,
            noise_seed: self.root.derive(Purpose::ControllerNoise, stream),
        };
        let found = self.diagnose(stream, &condition)?;
        Ok(std::array::from_fn(|fault| found.answer.faults[fault].detected == Some(true)))
    }

    fn diagnose(
        &self,
        stream: u64,
        condition: &Condition,
    ) -> Result<SignalDiagnosis, EvaluationError> {
        let seed = self.root.derive(Purpose::SensorNoise, stream);
        let sensors = self.setting.seeded_sensors(seed);
        let signal_a = self.setting.signal(self.experiment(), condition, sensors)?;
        let signal = self.setting.observed(signal_a);
        let noise_a = Some(self.setting.noise_a());
        let options = DiagnoseOptions { noise_a, ..DiagnoseOptions::default() };
        Ok(self.diagnoser.diagnose_signal(&signal, &options, &|_| {})?)
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
        method: "gls".to_owned(),
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
        |pick: fn(&ErrorBound) -> &Vec<f64>| median(samples.iter().map(|s| pick(&s.bounds)[place]));
    let ratio = |pick: fn(&ErrorBound) -> &Vec<f64>| {
        let squares = samples
            .iter()
            .flat_map(|s| places.clone().map(move |p| (s.error[p] / pick(&s.bounds)[p]).powi(2)));
        (squares.sum::<f64>() / (samples.len() * places.len()).max(1) as f64).sqrt()
    };
    fault.bound_std = Some(of(|bounds| &bounds.whole_std));
    fault.sensor_bound_std = Some(of(|bounds| &bounds.sensor_std));
    fault.phase_bound_std = Some(of(|bounds| &bounds.phase_std));
    fault.rmse_over_bound = Some(ratio(|bounds| &bounds.whole_std));
    fault.rmse_over_sensor_bound = Some(ratio(|bounds| &bounds.sensor_std));
}

impl Sample {
    /// Says if the fault's 95 % interval holds the truth; for `k6` its region with `k7`.
    fn holds(&self, index: usize) -> bool {
        if index != ECCENTRICITY[0] {
            return interval_holds(&self.found, &self.trial.truth, index);
        }
        let places = ECCENTRICITY.map(|e| self.found.indices.iter().position(|&i| i == e));
        let [Some(x), Some(y)] = places else { return false };
        self.distance2(x, y).is_some_and(|distance2| distance2 <= REGION_95)
    }

    /// `eᵀC⁻¹e` of the errors of two estimates; `None` where their covariance has no inverse.
    fn distance2(&self, x: usize, y: usize) -> Option<f64> {
        let c = |row: usize, column: usize| self.found.covariance[row][column];
        let determinant = c(x, x) * c(y, y) - c(y, x) * c(x, y);
        if determinant == 0.0 {
            return None;
        }
        let (xx, xy) = (c(y, y) / determinant, -c(x, y) / determinant);
        let (yx, yy) = (-c(y, x) / determinant, c(x, x) / determinant);
        let (ex, ey) = (self.error[x], self.error[y]);
        Some(ex * (xx * ex + xy * ey) + ey * (yx * ex + yy * ey))
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
            let found = inside
                .iter()
                .filter(|s| s.found.answer.faults[index].detected == Some(true))
                .count();
            (!inside.is_empty()).then(|| DetectionPoint {
                level: (bin as f64 + 0.5) * width,
                conditions: inside.len() as u64,
                detected_frac: found as f64 / inside.len() as f64,
            })
        })
        .collect()
}
