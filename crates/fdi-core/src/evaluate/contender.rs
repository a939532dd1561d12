//! What searches, and the experiments of the paper's Tables 2-8.

use std::convert::Infallible;

use gp_bayesopt::{Bounds, Population, PopulationOptions};

use super::{
    EvaluationError, EvaluationRequest, Protocol,
    high::HighMonitor,
    in_parallel,
    score::Trial,
    score::{fault_scores, levels_of, median},
    test_conditions,
};
use crate::{
    dataset::Condition,
    diagnose::{DiagnoseError, DiagnoseOptions, Diagnoser},
    emulator::Emulator,
    experiment::Experiment,
    report::{Method, MethodEvaluation},
    seed::{Purpose, RootSeed},
};

/// What searches in an experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Contender {
    /// The default method: generalised least squares with the learnt error of the monitor.
    Composite,
    /// The emulator of the reference signal; no simulation.
    Emulator,
    /// Expected improvement on the mask's scalar discrepancy.
    Ei,
    /// Upper confidence bound on it.
    Ucb,
    /// Two-step lookahead expected improvement on it.
    TwoStepEi,
    /// Genetic algorithm on it.
    Genetic,
    /// Particle swarm on it.
    Swarm,
    /// Differential evolution on it.
    DifferentialEvolution,
    /// Grey wolf optimiser on it.
    GreyWolves,
    /// CMA-ES on it.
    CmaEs,
}

impl Contender {
    /// Every contender.
    pub const ALL: [Self; 10] = [
        Self::Composite,
        Self::Emulator,
        Self::Ei,
        Self::Ucb,
        Self::TwoStepEi,
        Self::Genetic,
        Self::Swarm,
        Self::DifferentialEvolution,
        Self::GreyWolves,
        Self::CmaEs,
    ];

    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Composite => "composite",
            Self::Emulator => "emulator",
            Self::Ei => "ei",
            Self::Ucb => "ucb",
            Self::TwoStepEi => "two-step-ei",
            Self::Genetic => "ga",
            Self::Swarm => "pso",
            Self::DifferentialEvolution => "de",
            Self::GreyWolves => "gwo",
            Self::CmaEs => "cma-es",
        }
    }

    /// The contender of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|contender| contender.name() == name)
    }

    fn method(self) -> Option<Method> {
        match self {
            Self::Composite => Some(Method::Composite),
            Self::Ei => Some(Method::Ei),
            Self::Ucb => Some(Method::Ucb),
            Self::TwoStepEi => Some(Method::TwoStepEi),
            _ => None,
        }
    }

    fn population(self) -> Option<Population> {
        match self {
            Self::Genetic => Some(Population::Genetic),
            Self::Swarm => Some(Population::Swarm),
            Self::DifferentialEvolution => Some(Population::DifferentialEvolution),
            Self::GreyWolves => Some(Population::GreyWolves),
            Self::CmaEs => Some(Population::CmaEs),
            _ => None,
        }
    }
}

/// Evaluations that a population method may make unless told otherwise.
const POPULATION_EVALUATIONS: usize = 5000;

/// What an experiment is run with: made once, shared by the conditions.
struct Arena<'a> {
    request: &'a EvaluationRequest<'a>,
    diagnoser: Diagnoser,
    emulator: Option<Emulator>,
    high: Option<HighMonitor>,
}

/// A condition with its signal.
struct Test {
    condition: Condition,
    signal_a: Vec<f64>,
}

/// What one search found, before it is scored.
pub(super) struct Found {
    /// Coordinates looked for, free of bounds.
    pub(super) estimate: Vec<f64>,
    pub(super) discrepancy: f64,
    pub(super) evaluations: u64,
}

/// Runs every contender on every condition.
pub(super) fn run(
    request: &EvaluationRequest<'_>,
) -> Result<Vec<MethodEvaluation>, EvaluationError> {
    let experiment = request.protocol.experiment();
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
            Some(HighMonitor::learn(&bundle, emulator, &request.setting, request.jobs)?)
        }
        _ => None,
    };
    let arena = Arena { request, emulator, high, diagnoser: Diagnoser::new(bundle)? };
    request.contenders.iter().map(|&contender| arena.score(contender, &tests)).collect()
}

/// The conditions with what the sensors show of them.
fn tests(
    experiment: &Experiment,
    request: &EvaluationRequest<'_>,
) -> Result<Vec<Test>, EvaluationError> {
    let conditions = test_conditions(experiment, request)?;
    in_parallel(&conditions, request.jobs, |index, condition| {
        let seed = RootSeed(request.seed).derive(Purpose::SensorNoise, index as u64);
        let sensors = request.setting.sensors().map(|sensors| (sensors, seed));
        let signal_a = request.setting.signal(experiment, condition, sensors)?;
        Ok(Test { condition: *condition, signal_a })
    })
}

impl Arena<'_> {
    fn experiment(&self) -> &Experiment {
        &self.diagnoser.bundle().experiment
    }

    fn score(
        &self,
        contender: Contender,
        tests: &[Test],
    ) -> Result<MethodEvaluation, EvaluationError> {
        let sought = self.experiment().sought_indices();
        let now = || self.request.clock.map_or(0.0, |clock| clock());
        // what is prepared once for a noise level is not part of a diagnosis
        if let Some(first) = tests.first()
            && contender == Contender::Composite
        {
            self.find(contender, 0, first)?;
        }
        let trials = in_parallel(tests, self.request.jobs, |index, test| {
            let start_s = now();
            let found = self.find(contender, index, test)?;
            Ok::<_, EvaluationError>(Trial {
                truth: test.condition.levels,
                found: levels_of(&sought, &found.estimate),
                discrepancy: found.discrepancy,
                evaluations: found.evaluations,
                wall_time_s: now() - start_s,
            })
        })?;
        let faults = fault_scores(&sought, &trials);
        let medians = faults.iter().filter_map(|f| f.error_percent.map(|q| q.median));
        let average_percent = medians.sum::<f64>() / faults.len() as f64;
        let evaluations_median = median(trials.iter().map(|t| t.evaluations as f64));
        let timed = self.request.clock.is_some();
        let least = trials.iter().map(|t| t.wall_time_s).fold(f64::INFINITY, f64::min);
        Ok(MethodEvaluation {
            method: contender.name().to_owned(),
            average_percent,
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
            faults,
        })
    }

    /// One search.
    fn find(
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
        if let Some(high) = &self.high {
            return match (contender, &self.emulator) {
                (Contender::Composite, Some(emulator)) => high.diagnose(emulator, &test.signal_a),
                _ => Err(self.no_such(contender)),
            };
        }
        if let Some(population) = contender.population() {
            return self.search_population(population, &test.signal_a, seed);
        }
        let Some(method) = contender.method() else { return Err(self.no_such(contender)) };
        let noise_a = Some(self.request.setting.noise_a());
        let max_evaluations = self.request.max_evaluations;
        let options = DiagnoseOptions { method, max_evaluations, noise_a, seed };
        let observation = self.request.setting.observation(test.signal_a.clone());
        let (answer, posterior) = self.diagnoser.diagnose_observation(&observation, &options)?;
        Ok(Found {
            estimate: posterior.estimate,
            discrepancy: answer.discrepancy,
            evaluations: answer.evaluations,
        })
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
        Ok(Found { estimate: emulated.estimate, discrepancy, evaluations: 0 })
    }

    /// `δ`: norm of the difference of two signals on the mask.
    fn on_mask(&self, a: &[f64], b: &[f64]) -> f64 {
        let mask = &self.diagnoser.bundle().mask;
        mask.iter().map(|&i| (a[i] - b[i]) * (a[i] - b[i])).sum::<f64>().sqrt()
    }

    /// A population method on the same scalar and the same box as the paper's search, with the
    /// learnt error of the monitor taken off.
    fn search_population(
        &self,
        population: Population,
        signal_a: &[f64],
        seed: u64,
    ) -> Result<Found, EvaluationError> {
        let sought = self.experiment().sought_indices();
        let mut monitor = self.experiment().monitor(0.0)?;
        let failed = |reason: String| EvaluationError::Search { reason };
        let bounds = Bounds::unit(sought.len()).map_err(|error| failed(error.to_string()))?;
        let options = PopulationOptions {
            max_evaluations: self.request.max_evaluations.unwrap_or(POPULATION_EVALUATIONS),
            seed,
            ..PopulationOptions::default()
        };
        let value = |levels: &[f64]| {
            let modelled = self.diagnoser.monitored(&mut monitor, levels);
            Ok::<_, Infallible>(self.on_mask(signal_a, &modelled))
        };
        let solution = population
            .minimise(value, &bounds, &options)
            .map_err(|error| failed(error.to_string()))?;
        Ok(Found {
            estimate: crate::diagnose::coordinates_of(&sought, &solution.point),
            discrepancy: solution.value,
            evaluations: solution.evaluations as u64,
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
        let mut monitor = self.experiment().monitor(0.0)?;
        let mut least = f64::INFINITY;
        for _ in 0..REPEATS {
            let start_s = clock();
            let signal = match &self.high {
                Some(high) => high.signal(&middle),
                None => self.diagnoser.monitored(&mut monitor, &middle),
            };
            let taken_s = clock() - start_s;
            if !signal.is_empty() {
                least = least.min(taken_s);
            }
        }
        Ok(least)
    }
}
