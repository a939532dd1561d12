//! Evaluations, counted, with the error of the best point so far.

use crate::bayesopt::Problem;

/// An error level of the tables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Level {
    /// Mean of the inputs' relative errors.
    Mean(f64),
    /// Largest of the inputs' relative errors.
    Worst(f64),
}

/// One improvement of the best point.
#[derive(Clone, Copy, Debug)]
struct Improvement {
    evaluation: usize,
    mean: f64,
    worst: f64,
}

/// A simulator that counts and keeps the best point.
#[derive(Debug)]
pub struct Tracker<'a> {
    problem: &'a Problem,
    truth: &'a [f64],
    measured: Vec<f64>,
    budget: usize,
    evaluations: usize,
    best: f64,
    best_point: Vec<f64>,
    improvements: Vec<Improvement>,
}

/// The outcome of one run of a method.
#[derive(Clone, Debug)]
pub struct Run {
    improvements: Vec<Improvement>,
    /// Evaluations made.
    pub evaluations: usize,
    /// Smallest norm of the residual.
    pub best: f64,
}

/// The budget is spent.
#[derive(Debug)]
pub struct Spent;

impl std::fmt::Display for Spent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "budget spent")
    }
}

impl std::error::Error for Spent {}

impl<'a> Tracker<'a> {
    /// For the truth of a seed.
    pub fn new(problem: &'a Problem, seed: usize, budget: usize) -> Self {
        let truth = &problem.truths[seed];
        Self {
            problem,
            truth,
            measured: (problem.simulate)(truth),
            budget,
            evaluations: 0,
            best: f64::INFINITY,
            best_point: Vec::new(),
            improvements: Vec::new(),
        }
    }

    /// The residual at a point of the box.
    ///
    /// # Errors
    /// `Spent` once the budget is.
    pub fn residual(&mut self, point: &[f64]) -> Result<Vec<f64>, Spent> {
        if self.evaluations >= self.budget {
            return Err(Spent);
        }
        self.evaluations += 1;
        let simulated = (self.problem.simulate)(point);
        let residual: Vec<f64> = simulated.iter().zip(&self.measured).map(|(y, m)| y - m).collect();
        let norm = residual.iter().map(|r| r * r).sum::<f64>().sqrt();
        if norm < self.best {
            let errors = self.problem.errors(point, self.truth);
            (self.best, self.best_point) = (norm, point.to_vec());
            self.improvements.push(Improvement {
                evaluation: self.evaluations,
                mean: errors.iter().sum::<f64>() / errors.len() as f64,
                worst: errors.iter().fold(0.0, |m, e| f64::max(m, *e)),
            });
        }
        Ok(residual)
    }

    /// The norm of the residual at a point of the box.
    ///
    /// # Errors
    /// `Spent` once the budget is.
    pub fn norm(&mut self, point: &[f64]) -> Result<f64, Spent> {
        Ok(self.residual(point)?.iter().map(|r| r * r).sum::<f64>().sqrt())
    }

    /// Smallest norm so far.
    pub fn best(&self) -> f64 {
        self.best
    }

    /// Evaluations that are left.
    pub fn left(&self) -> usize {
        self.budget - self.evaluations
    }

    /// The record of the run.
    pub fn finish(self) -> Run {
        Run { improvements: self.improvements, evaluations: self.evaluations, best: self.best }
    }
}

impl Run {
    /// First evaluation from which the best point stays within a level; `None`
    /// when it never does.
    pub fn evaluations_to(&self, level: Level) -> Option<usize> {
        let within = |i: &Improvement| match level {
            Level::Mean(limit) => i.mean <= limit,
            Level::Worst(limit) => i.worst <= limit,
        };
        let after_last_outside =
            self.improvements.iter().rposition(|i| !within(i)).map_or(0, |i| i + 1);
        self.improvements.get(after_last_outside).map(|i| i.evaluation)
    }

    /// Mean relative error of the best point.
    pub fn mean_error(&self) -> f64 {
        self.improvements.last().map_or(f64::INFINITY, |i| i.mean)
    }
}
