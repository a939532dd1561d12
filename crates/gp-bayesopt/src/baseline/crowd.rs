//! A population that evaluates a counted function, shared by all methods.

use crate::{bounds::Bounds, random::Stream, stop::StopReason};

/// How a population method runs.
#[derive(Clone, Debug, PartialEq)]
pub struct PopulationOptions {
    /// Members; `None`: the method's usual number.
    pub members: Option<usize>,
    /// Evaluations allowed.
    pub max_evaluations: usize,
    /// Value that ends the run.
    pub target: f64,
    /// Mean and standard deviation (as fractions of the intervals) of the
    /// first CMA-ES population; `None`: the middle of the box and 0.3. The
    /// other methods draw uniformly over the box.
    pub start: Option<(Vec<f64>, f64)>,
    /// Seed.
    pub seed: u64,
}

impl Default for PopulationOptions {
    fn default() -> Self {
        Self {
            members: None,
            max_evaluations: 10_000,
            target: f64::NEG_INFINITY,
            start: None,
            seed: 0,
        }
    }
}

/// Why a method ended.
pub(super) enum Ended<E> {
    Stop(StopReason),
    Error(E),
}

/// The counted function in unit coordinates.
pub(super) struct Crowd<'a, F> {
    pub(super) function: F,
    pub(super) bounds: &'a Bounds,
    pub(super) options: &'a PopulationOptions,
    pub(super) evaluations: usize,
    pub(super) best: Option<(Vec<f64>, f64)>,
}

impl<F> Crowd<'_, F> {
    pub(super) fn dimension(&self) -> usize {
        self.bounds.dimension()
    }

    /// The value at a point of the unit cube; NaN becomes the worst.
    pub(super) fn value<E>(&mut self, unit: &[f64]) -> Result<f64, Ended<E>>
    where
        F: FnMut(&[f64]) -> Result<f64, E>,
    {
        if self.best.as_ref().is_some_and(|(_, value)| *value <= self.options.target) {
            return Err(Ended::Stop(StopReason::TargetReached));
        }
        if self.evaluations >= self.options.max_evaluations {
            return Err(Ended::Stop(StopReason::BudgetSpent));
        }
        self.evaluations += 1;
        let point = self.bounds.at_unit(unit);
        let value = (self.function)(&point).map_err(Ended::Error)?;
        if value.is_nan() {
            return Ok(f64::INFINITY);
        }
        if self.best.as_ref().is_none_or(|(_, best)| value < *best) {
            self.best = Some((point, value));
        }
        Ok(value)
    }

    /// Uniform points of the unit cube.
    pub(super) fn uniform(&self, stream: &mut Stream, members: usize) -> Vec<Vec<f64>> {
        let d = self.dimension();
        (0..members).map(|_| (0..d).map(|_| stream.uniform()).collect()).collect()
    }

    /// The values of many points.
    pub(super) fn values<E>(&mut self, units: &[Vec<f64>]) -> Result<Vec<f64>, Ended<E>>
    where
        F: FnMut(&[f64]) -> Result<f64, E>,
    {
        units.iter().map(|unit| self.value(unit)).collect()
    }
}

/// Indices in rising order of value.
pub(super) fn ranking(values: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    order
}
