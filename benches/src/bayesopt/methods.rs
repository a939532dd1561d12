//! The methods, each as a user would call it.

use gp_bayesopt::{
    Ask, Bounds, Confidence, Criterion, DerivativeFreeGaussNewton, Design, Fantasies,
    LevenbergMarquardt, Outcome, Population, PopulationOptions, SolveError, Study, StudyOptions,
};

use crate::bayesopt::{Level, Problem, Run, Tracker};

/// Where a method begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// A method that knows the nominal point, or draws its first points near it.
    Near,
    /// A method that knows the box alone.
    Blind,
}

/// A method of the tables.
#[derive(Clone, Copy, Debug)]
pub struct Method {
    /// Name in the tables.
    pub name: &'static str,
    /// Where it begins.
    pub start: Start,
    /// Evaluations allowed.
    pub budget: usize,
    solve: fn(&mut Tracker<'_>, &Problem, u64),
}

impl Method {
    /// This method with another budget.
    #[must_use]
    pub fn with_budget(self, budget: usize) -> Self {
        Self { budget, ..self }
    }
}

/// Every method, those that see the vector first.
pub const METHODS: &[Method] = &[
    Method { name: "lm", start: Start::Near, budget: 300, solve: lm },
    Method { name: "composite", start: Start::Near, budget: 80, solve: composite_near },
    Method { name: "composite", start: Start::Blind, budget: 80, solve: composite_blind },
    Method { name: "dfo", start: Start::Near, budget: 400, solve: dfo },
    Method { name: "dfo-restarts", start: Start::Blind, budget: 2000, solve: dfo_restarts },
    Method { name: "lm-restarts", start: Start::Blind, budget: 2000, solve: lm_restarts },
    Method { name: "ei", start: Start::Blind, budget: 100, solve: ei },
    Method { name: "ucb-printed", start: Start::Blind, budget: 100, solve: ucb_printed },
    Method { name: "ucb-srinivas", start: Start::Blind, budget: 100, solve: ucb_srinivas },
    Method { name: "two-step-ei", start: Start::Blind, budget: 100, solve: two_step },
    Method { name: "cma-es", start: Start::Near, budget: 60_000, solve: cma_near },
    Method { name: "cma-es", start: Start::Blind, budget: 60_000, solve: cma },
    Method { name: "pso", start: Start::Blind, budget: 60_000, solve: pso },
    Method { name: "de", start: Start::Blind, budget: 60_000, solve: de },
    Method { name: "gwo", start: Start::Blind, budget: 60_000, solve: gwo },
    Method { name: "ga", start: Start::Blind, budget: 60_000, solve: ga },
];

/// Norm of the residual that ends a run: far below every level of the tables.
const DONE: f64 = 1e-9;

/// Runs a method on the truth of a seed.
pub fn run(method: &Method, problem: &Problem, seed: usize) -> Run {
    let mut tracker = Tracker::new(problem, seed, method.budget);
    (method.solve)(&mut tracker, problem, seed as u64);
    tracker.finish()
}

/// One local run from some coordinates of the chart.
fn local(tracker: &mut Tracker<'_>, problem: &Problem, start: &[f64]) {
    let chart = &problem.chart;
    let solver = LevenbergMarquardt {
        max_evaluations: tracker.left().max(1),
        target: DONE,
        ..LevenbergMarquardt::default()
    };
    let residual = |z: &[f64]| tracker.residual(&(chart.to_point)(z));
    match solver.solve(residual, start, &chart.bounds) {
        Ok(_) | Err(SolveError::Evaluation { .. }) => {}
        Err(error) => panic!("{}: {error}", problem.name),
    }
}

/// Counts of `starts` local runs from a design on the whole box for each of the first `truths`: how
/// many end at the truth, and how many there were.
///
/// # Panics
/// When the problem has fewer truths.
pub fn local_runs_to_truth(problem: &Problem, truths: usize, starts: usize) -> (usize, usize) {
    let mut reached = 0;
    for seed in 0..truths {
        let design = Design::Sobol.points(&problem.chart.bounds, starts, seed as u64);
        for start in design.expect("a design") {
            let mut tracker = Tracker::new(problem, seed, LOCAL_BUDGET);
            local(&mut tracker, problem, &start);
            let run = tracker.finish();
            reached += usize::from(run.evaluations_to(Level::Mean(0.001)).is_some());
        }
    }
    (reached, truths * starts)
}

/// Evaluations of one of [`local_runs_to_truth`].
const LOCAL_BUDGET: usize = 300;

fn lm(tracker: &mut Tracker<'_>, problem: &Problem, _seed: u64) {
    local(tracker, problem, &problem.chart.start);
}

fn lm_restarts(tracker: &mut Tracker<'_>, problem: &Problem, seed: u64) {
    let starts = Design::Sobol.points(&problem.chart.bounds, 1000, seed).expect("a design");
    for start in starts {
        if tracker.best() <= DONE || tracker.left() == 0 {
            break;
        }
        local(tracker, problem, &start);
    }
}

/// The composite method with a design of `d + 1` points near the nominal one.
fn composite_near(tracker: &mut Tracker<'_>, problem: &Problem, seed: u64) {
    let design = near_design(problem, problem.bounds.dimension() + 1, seed);
    let mut options = StudyOptions::residual(problem.bounds.clone(), tracker.left());
    (options.design_points, options.seed, options.target) = (0, seed, DONE);
    let mut study = Study::new(options).expect("usable settings");
    for point in design {
        let Ok(residual) = tracker.residual(&point) else { return };
        study.tell_earlier(&point, Outcome::Residual(residual)).expect("a residual");
    }
    drive(&mut study, |x| tracker.residual(x).map(Outcome::Residual).ok());
}

fn composite_blind(tracker: &mut Tracker<'_>, problem: &Problem, seed: u64) {
    let mut options = StudyOptions::residual(problem.bounds.clone(), tracker.left());
    (options.seed, options.target) = (seed, DONE);
    let mut study = Study::new(options).expect("usable settings");
    drive(&mut study, |x| tracker.residual(x).map(Outcome::Residual).ok());
}

/// Asks and tells until the study or the budget ends.
fn drive(study: &mut Study, mut evaluate: impl FnMut(&[f64]) -> Option<Outcome>) {
    while let Ask::Evaluate(point) = study.ask().expect("a proposal") {
        let Some(outcome) = evaluate(&point) else { return };
        study.tell(&point, outcome).expect("an outcome of its kind");
    }
}

/// Scrambled Sobol' points, drawn to the lower limits.
pub(crate) fn near_design(problem: &Problem, count: usize, seed: u64) -> Vec<Vec<f64>> {
    let bounds: &Bounds = &problem.bounds;
    let mut points = Design::Sobol.points(bounds, count, seed).expect("a design");
    for point in &mut points {
        for (i, (exponent, extent)) in problem.near.iter().enumerate() {
            let share = (point[i] - bounds.lower()[i]) / bounds.width(i);
            point[i] = bounds.lower()[i] + extent * share.powf(*exponent) * bounds.width(i);
        }
    }
    points
}

fn scalar(tracker: &mut Tracker<'_>, problem: &Problem, seed: u64, criterion: Criterion) {
    let mut options = StudyOptions::scalar(problem.bounds.clone(), criterion, tracker.left());
    (options.design_points, options.seed) = (20, seed);
    let mut study = Study::new(options).expect("usable settings");
    drive(&mut study, |x| tracker.norm(x).map(Outcome::Value).ok());
}

fn ei(tracker: &mut Tracker<'_>, problem: &Problem, seed: u64) {
    scalar(tracker, problem, seed, Criterion::ExpectedImprovement);
}

fn ucb_printed(tracker: &mut Tracker<'_>, problem: &Problem, seed: u64) {
    scalar(tracker, problem, seed, Criterion::LowerConfidence(Confidence::Printed));
}

fn ucb_srinivas(tracker: &mut Tracker<'_>, problem: &Problem, seed: u64) {
    let confidence = Confidence::Srinivas { delta: 0.1 };
    scalar(tracker, problem, seed, Criterion::LowerConfidence(confidence));
}

fn two_step(tracker: &mut Tracker<'_>, problem: &Problem, seed: u64) {
    scalar(tracker, problem, seed, Criterion::TwoStep(Fantasies::GaussHermite(8)));
}

/// One derivative-free run from some coordinates of the chart.
fn local_dfo(tracker: &mut Tracker<'_>, problem: &Problem, start: &[f64], radius: f64) {
    let chart = &problem.chart;
    let solver = DerivativeFreeGaussNewton {
        initial_radius: radius,
        max_evaluations: tracker.left().max(1),
        target: DONE,
        ..DerivativeFreeGaussNewton::default()
    };
    let residual = |z: &[f64]| tracker.residual(&(chart.to_point)(z));
    match solver.solve(residual, start, &chart.bounds) {
        Ok(_) | Err(SolveError::Evaluation { .. }) => {}
        Err(error) => panic!("{}: {error}", problem.name),
    }
}

fn dfo(tracker: &mut Tracker<'_>, problem: &Problem, _seed: u64) {
    local_dfo(tracker, problem, &problem.chart.start, 0.02);
}

fn dfo_restarts(tracker: &mut Tracker<'_>, problem: &Problem, seed: u64) {
    let starts = Design::Sobol.points(&problem.chart.bounds, 1000, seed).expect("a design");
    for start in starts {
        if tracker.best() <= DONE || tracker.left() == 0 {
            break;
        }
        local_dfo(tracker, problem, &start, 0.1);
    }
}

fn population(
    tracker: &mut Tracker<'_>,
    problem: &Problem,
    method: Population,
    (start, seed): (Option<(Vec<f64>, f64)>, u64),
) {
    let max_evaluations = tracker.left();
    let options = PopulationOptions { max_evaluations, target: DONE, start, seed, members: None };
    method.minimise(|x| tracker.norm(x), &problem.bounds, &options).expect("a run");
}

fn cma_near(tracker: &mut Tracker<'_>, problem: &Problem, seed: u64) {
    let start = Some((problem.nominal.clone(), 0.02));
    population(tracker, problem, Population::CmaEs, (start, seed));
}

fn cma(tracker: &mut Tracker<'_>, problem: &Problem, seed: u64) {
    population(tracker, problem, Population::CmaEs, (None, seed));
}

fn pso(tracker: &mut Tracker<'_>, problem: &Problem, seed: u64) {
    population(tracker, problem, Population::Swarm, (None, seed));
}

fn de(tracker: &mut Tracker<'_>, problem: &Problem, seed: u64) {
    population(tracker, problem, Population::DifferentialEvolution, (None, seed));
}

fn gwo(tracker: &mut Tracker<'_>, problem: &Problem, seed: u64) {
    population(tracker, problem, Population::GreyWolves, (None, seed));
}

fn ga(tracker: &mut Tracker<'_>, problem: &Problem, seed: u64) {
    population(tracker, problem, Population::Genetic, (None, seed));
}
