//! The searches of the paper's Tables 2-8, one for each method and condition.

use std::convert::Infallible;

use fdi_core::{
    Condition, DiagnoseError, DiagnoseOptions, Diagnoser, Emulator, Experiment, HighFidelitySearch,
    HighFidelitySettings, Purpose, RootSeed, ScalarSearch, ema_sim::FAULT_COUNT, in_parallel,
    report::MethodEvaluation,
};
use gp_bayesopt::{Bounds, Population, PopulationOptions};

use crate::{
    contender::Contender,
    convergence::{History, Recorder, curve},
    protocol::Protocol,
    request::{EvaluationError, EvaluationRequest, test_conditions},
    score::{Trial, errors_percent, fault_scores, levels_of, median},
    search_view::{SearchSpace, SearchView},
};

/// Evaluations that a population method may make unless told otherwise.
const POPULATION_EVALUATIONS: usize = 5000;

/// The prepared parts of an experiment, made once and shared by the conditions.
pub(crate) struct Arena<'a> {
    request: &'a EvaluationRequest<'a>,
    /// View of the scalar searches.
    view: SearchView,
    diagnoser: Diagnoser,
    emulator: Option<Emulator>,
    high: Option<HighFidelitySearch>,
}

/// A condition with its signal.
pub(crate) struct Test {
    pub(crate) condition: Condition,
    signal_a: Vec<f64>,
}

/// The end of one search, before it is scored.
pub(crate) struct Found {
    /// Coordinates looked for, free of bounds.
    pub(crate) estimate: Vec<f64>,
    pub(crate) discrepancy: f64,
    evaluations: u64,
    pub(crate) history: History,
    /// Stated standard deviation of each level looked for, where there is one.
    std: Vec<f64>,
}

/// Runs every contender on every condition.
pub(crate) fn run(
    request: &EvaluationRequest<'_>,
) -> Result<Vec<MethodEvaluation>, EvaluationError> {
    let (arena, tests) = prepare(request)?;
    request.contenders.iter().map(|&contender| arena.score(contender, &tests)).collect()
}

/// Simulates the conditions and learns what the contenders know beforehand.
pub(crate) fn prepare<'a>(
    request: &'a EvaluationRequest<'a>,
) -> Result<(Arena<'a>, Vec<Test>), EvaluationError> {
    let experiment = request.protocol.experiment()?;
    let tests = tests(&experiment, request)?;
    let bundle = request.setting.bundle(&experiment, request.seed, request.jobs)?;
    let high = request.protocol == Protocol::High;
    let emulates = high || request.contenders.contains(&Contender::Emulator);
    let noise_a = request.setting.noise_a();
    let emulator =
        emulates.then(|| Emulator::learn(&bundle, request.setting.phase_rate_hz, noise_a));
    let emulator = emulator.transpose()?;
    let high = match &emulator {
        Some(emulator) if high => {
            let settings = HighFidelitySettings {
                imperfections: request.setting.imperfections,
                phase_rate_hz: request.setting.phase_rate_hz,
                noise_a,
                jobs: request.jobs,
            };
            Some(HighFidelitySearch::learn(&bundle, emulator, &settings)?)
        }
        _ => None,
    };
    let view = SearchView::of(SearchSpace::Linear { largest: request.largest_level });
    Ok((Arena { request, view, emulator, high, diagnoser: Diagnoser::new(bundle)? }, tests))
}

/// The conditions with what the sensors show of them.
fn tests(
    experiment: &Experiment,
    request: &EvaluationRequest<'_>,
) -> Result<Vec<Test>, EvaluationError> {
    let conditions = test_conditions(experiment, request)?;
    in_parallel(&conditions, request.jobs, |index, condition| {
        let seed = RootSeed(request.seed).derive(Purpose::SensorNoise, index as u64);
        let sensors = request.setting.seeded_sensors(seed);
        let signal_a = request.setting.signal(experiment, condition, sensors)?;
        Ok(Test { condition: *condition, signal_a })
    })
}

impl Arena<'_> {
    /// Changes the view of the scalar searches.
    pub(crate) fn seen(self, view: SearchView) -> Self {
        Self { view, ..self }
    }

    pub(crate) fn experiment(&self) -> &Experiment {
        &self.diagnoser.bundle().experiment
    }

    fn score(
        &self,
        contender: Contender,
        tests: &[Test],
    ) -> Result<MethodEvaluation, EvaluationError> {
        let sought = self.experiment().sought_indices();
        let now = || self.now_s();
        // what is prepared once for a noise level is not part of a diagnosis
        if let Some(first) = tests.first()
            && contender == Contender::Gls
        {
            self.find(contender, 0, first)?;
        }
        let trials = in_parallel(tests, self.request.jobs, |index, test| {
            let start_s = now();
            let mut found = self.find(contender, index, test)?;
            let trial = Trial {
                truth: test.condition.levels,
                found: levels_of(&sought, &found.estimate),
                discrepancy: found.discrepancy,
                evaluations: found.evaluations,
                wall_time_s: now() - start_s,
            };
            found.history.end_with(errors_percent(&sought, &trial.truth, &trial.found));
            let relative = predicted(&sought, &found.std, &trial.truth);
            Ok::<_, EvaluationError>(((trial, found.history), relative))
        })?;
        let (trials, relative): (Vec<_>, Vec<Option<Vec<f64>>>) = trials.into_iter().unzip();
        let (trials, histories): (Vec<Trial>, Vec<History>) = trials.into_iter().unzip();
        let faults = fault_scores(&sought, &trials);
        let medians = faults.iter().filter_map(|f| f.error_percent.map(|q| q.median));
        let average_percent = medians.sum::<f64>() / faults.len() as f64;
        let evaluations_median = median(trials.iter().map(|t| t.evaluations as f64));
        let timed = self.request.clock.is_some();
        let least = trials.iter().map(|t| t.wall_time_s).fold(f64::INFINITY, f64::min);
        Ok(MethodEvaluation {
            method: contender.name().to_owned(),
            average_percent,
            predicted_percent: average_of_medians(&relative),
            evaluations_median,
            discrepancy_median: Some(median(trials.iter().map(|t| t.discrepancy))),
            model_time_s: timed
                .then(|| self.model_time_s(contender))
                .transpose()?
                .map(|one_s| one_s * evaluations_median),
            wall_time_s: timed.then(|| median(trials.iter().map(|t| t.wall_time_s))),
            wall_time_min_s: timed.then_some(least),
            coverage_95: None,
            healthy: None,
            convergence: curve(&histories, timed),
            faults,
        })
    }

    /// One search.
    pub(crate) fn find(
        &self,
        contender: Contender,
        index: usize,
        test: &Test,
    ) -> Result<Found, EvaluationError> {
        let root = RootSeed(self.request.seed);
        let seed = root.derive(Purpose::Diagnosis, index as u64);
        if contender == Contender::Emulator {
            return self.emulate(&test.signal_a);
        }
        if let Some(population) = contender.population() {
            return self.search_population(population, test, seed);
        }
        let Some(method) = contender.method() else { return Err(self.no_such(contender)) };
        if let Some(search) = ScalarSearch::of(method, self.request.max_evaluations, seed) {
            return self.search_scalar(search, test);
        }
        let now = || self.now_s();
        let recorder = Recorder::new(&now);
        if self.high.is_some() && contender != Contender::Gls {
            return Err(self.no_such(contender));
        }
        if let (Some(high), Some(emulator)) = (&self.high, &self.emulator) {
            let found = high.diagnose(emulator, &test.signal_a, &|residual| {
                recorder.note(self.norm_on_mask(residual));
            });
            let found = found.ok_or(DiagnoseError::Undetermined)?;
            return Ok(Found {
                discrepancy: self.norm_on_mask(&found.residual_a),
                estimate: found.estimate,
                evaluations: found.evaluations,
                history: recorder.finish(),
                std: Vec::new(),
            });
        }
        let noise_a = Some(self.request.setting.noise_a());
        let max_evaluations = self.request.max_evaluations;
        let options = DiagnoseOptions {
            method,
            max_evaluations,
            noise_a,
            seed,
            ..DiagnoseOptions::default()
        };
        let signal = self.request.setting.observed(test.signal_a.clone());
        let found = self.diagnoser.diagnose_signal(&signal, &options, &|residual| {
            recorder.note(self.norm_on_mask(residual));
        })?;
        let answer = found.answer;
        let sought = self.experiment().sought_indices();
        let std = sought.iter().map(|&fault| answer.faults[fault].std.unwrap_or(f64::NAN));
        Ok(Found {
            std: std.collect(),
            estimate: found.estimate,
            discrepancy: answer.discrepancy,
            evaluations: answer.evaluations,
            history: recorder.finish(),
        })
    }

    fn now_s(&self) -> f64 {
        self.request.clock.map_or(0.0, |clock| clock())
    }

    fn no_such(&self, contender: Contender) -> EvaluationError {
        let (protocol, method) = (self.request.protocol.name(), contender.name());
        EvaluationError::NoSuchMethod { protocol, method }
    }

    fn emulate(&self, signal_a: &[f64]) -> Result<Found, EvaluationError> {
        let emulator = self.emulator.as_ref().ok_or(self.no_such(Contender::Emulator))?;
        let emulated = emulator.diagnose(signal_a).ok_or(DiagnoseError::Undetermined)?;
        let modelled = emulator.signal_a(&emulated.estimate);
        let discrepancy = self.on_mask(signal_a, &modelled);
        let (history, std) = (History::default(), Vec::new());
        Ok(Found { estimate: emulated.estimate, discrepancy, evaluations: 0, history, std })
    }

    /// `δ`: norm of the difference of two signals on the mask.
    fn on_mask(&self, a: &[f64], b: &[f64]) -> f64 {
        let mask = &self.diagnoser.bundle().mask;
        mask.iter().map(|&i| (a[i] - b[i]) * (a[i] - b[i])).sum::<f64>().sqrt()
    }

    /// Norm of a residual on the mask.
    fn norm_on_mask(&self, residual: &[f64]) -> f64 {
        let mask = &self.diagnoser.bundle().mask;
        mask.iter().map(|&i| residual[i] * residual[i]).sum::<f64>().sqrt()
    }

    /// Levels of a point of the unit box.
    fn levels(&self, sought: &[usize], unit: &[f64]) -> Vec<f64> {
        let direction = FAULT_COUNT - 1;
        let level = |fault: usize, u: f64| {
            if fault == direction { u } else { self.view.space.level(u) }
        };
        sought.iter().zip(unit).map(|(&fault, &u)| level(fault, u)).collect()
    }

    /// The discrepancy as a function of a point of the unit box, each evaluation noted.
    pub(crate) fn discrepancy<'r>(
        &'r self,
        test: &'r Test,
        recorder: &'r Recorder<'r>,
    ) -> Result<impl FnMut(&[f64]) -> f64 + 'r, EvaluationError> {
        let sought = self.experiment().sought_indices();
        let mut monitor = self.diagnoser.corrected_monitor()?;
        Ok(move |unit: &[f64]| {
            let levels = self.levels(&sought, unit);
            let at = self.experiment().sought_coordinates(&levels);
            let modelled = match &self.high {
                Some(high) => high.signal_a(&at),
                None => monitor.signal(&at),
            };
            let value = self.on_mask(&test.signal_a, &modelled);
            recorder.note_at(value, || {
                let point = self.experiment().sought_coordinates(&levels);
                errors_percent(&sought, &test.condition.levels, &levels_of(&sought, &point))
            });
            value
        })
    }

    /// The paper's search: Algorithm 1 on the scalar, with the learnt error of the monitor taken
    /// off.
    fn search_scalar(&self, search: ScalarSearch, test: &Test) -> Result<Found, EvaluationError> {
        let sought = self.experiment().sought_indices();
        let now = || self.now_s();
        let recorder = Recorder::new(&now);
        let mut value = self.discrepancy(test, &recorder)?;
        let found = search
            .minimise(&sought, |unit| self.view.scalar(value(unit)))
            .map_err(|error| EvaluationError::Search { reason: error.to_string() })?;
        drop(value);
        let history = recorder.finish();
        let discrepancy = history.least();
        let levels = self.levels(&sought, &found.levels);
        let estimate = self.experiment().sought_coordinates(&levels);
        let (evaluations, std) = (found.evaluations, Vec::new());
        Ok(Found { estimate, discrepancy, evaluations, history, std })
    }

    /// A population method on the same scalar and the same box as the paper's search, with the
    /// learnt error of the monitor taken off.
    fn search_population(
        &self,
        population: Population,
        test: &Test,
        seed: u64,
    ) -> Result<Found, EvaluationError> {
        let sought = self.experiment().sought_indices();
        let failed = |reason: String| EvaluationError::Search { reason };
        let bounds = Bounds::unit(sought.len()).map_err(|error| failed(error.to_string()))?;
        let options = PopulationOptions {
            max_evaluations: self.request.max_evaluations.unwrap_or(POPULATION_EVALUATIONS),
            seed,
            ..PopulationOptions::default()
        };
        let now = || self.now_s();
        let recorder = Recorder::new(&now);
        let mut discrepancy = self.discrepancy(test, &recorder)?;
        let value = |levels: &[f64]| Ok::<_, Infallible>(discrepancy(levels));
        let solution = population
            .minimise(value, &bounds, &options)
            .map_err(|error| failed(error.to_string()))?;
        drop(discrepancy);
        let levels = self.levels(&sought, &solution.point);
        Ok(Found {
            estimate: self.experiment().sought_coordinates(&levels),
            discrepancy: solution.value,
            evaluations: solution.evaluations as u64,
            history: recorder.finish(),
            std: Vec::new(),
        })
    }

    /// Least time of one evaluation of the monitor, s.
    fn model_time_s(&self, contender: Contender) -> Result<f64, EvaluationError> {
        const REPEATS: usize = 20;
        let Some(clock) = self.request.clock else { return Ok(0.0) };
        if contender == Contender::Emulator {
            return Ok(0.0);
        }
        let middle = vec![0.02; self.experiment().sought_indices().len()];
        let mut monitor = self.diagnoser.corrected_monitor()?;
        let mut least = f64::INFINITY;
        for _ in 0..REPEATS {
            let start_s = clock();
            let signal = match &self.high {
                Some(high) => high.signal_a(&middle),
                None => monitor.signal(&self.experiment().sought_coordinates(&middle)),
            };
            let taken_s = clock() - start_s;
            if !signal.is_empty() {
                least = least.min(taken_s);
            }
        }
        Ok(least)
    }
}

/// Median of a normal error's size over its standard deviation.
const MEDIAN_OVER_STD: f64 = 0.674_489_750_196_081_7;

/// Percentage errors that standard deviations predict; `None` where none are stated.
fn predicted(sought: &[usize], std: &[f64], truth: &[f64]) -> Option<Vec<f64>> {
    let relative = |(&fault, std): (&usize, &f64)| 100.0 * MEDIAN_OVER_STD * std / truth[fault];
    (!std.is_empty()).then(|| sought.iter().zip(std).map(relative).collect())
}

/// Mean over the faults of the median over searches; those that state none for a fault are left
/// out of its median.
fn average_of_medians(searches: &[Option<Vec<f64>>]) -> Option<f64> {
    let stated: Vec<&Vec<f64>> = searches.iter().flatten().collect();
    let faults = stated.first()?.len();
    let of_fault = |fault: usize| median(stated.iter().map(|s| s[fault]).filter(|p| p.is_finite()));
    Some((0..faults).map(of_fault).sum::<f64>() / faults as f64)
}
