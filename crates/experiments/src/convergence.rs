//! How the discrepancy falls with evaluations and with time (Figs 6-8 of the FREEDOM paper).

use std::cell::RefCell;

use fdi_core::report::ConvergencePoint;

use crate::score::{median, quartiles};

/// A search after one of its evaluations.
#[derive(Clone, Debug)]
struct Step {
    /// Seconds from the start.
    time_s: f64,
    /// Least discrepancy so far, A.
    least: f64,
    /// Percentage error of each fault looked for at the point with that discrepancy; empty where
    /// the point is not known.
    errors_percent: Vec<f64>,
}

impl Step {
    fn point(&self, evaluations: usize) -> SearchPoint {
        let errors = &self.errors_percent;
        SearchPoint {
            evaluations,
            time_s: self.time_s,
            discrepancy_a: self.least,
            error_percent: errors.iter().sum::<f64>() / errors.len() as f64,
        }
    }
}

/// A scalar search on its way: what its best point so far is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchPoint {
    /// Evaluations made.
    pub evaluations: usize,
    /// Time since the start, s; 0 without a clock.
    pub time_s: f64,
    /// Least discrepancy so far, A.
    pub discrepancy_a: f64,
    /// Mean over the faults of eq. 20 of the FREEDOM paper at the point with that discrepancy, %.
    pub error_percent: f64,
}

/// The steps of one search.
#[derive(Clone, Debug, Default)]
pub(crate) struct History {
    steps: Vec<Step>,
}

/// Writes a history while a search runs.
pub(crate) struct Recorder<'a> {
    clock: &'a dyn Fn() -> f64,
    start_s: f64,
    history: RefCell<History>,
}

impl<'a> Recorder<'a> {
    pub(crate) fn new(clock: &'a dyn Fn() -> f64) -> Self {
        Self { clock, start_s: clock(), history: RefCell::default() }
    }

    /// Notes the discrepancy of an evaluation at a point that is not known.
    pub(crate) fn note(&self, discrepancy: f64) {
        self.note_at(discrepancy, Vec::new);
    }

    /// Notes the discrepancy of an evaluation, and the errors of its point if it is the best.
    pub(crate) fn note_at(&self, discrepancy: f64, errors_percent: impl FnOnce() -> Vec<f64>) {
        let time_s = (self.clock)() - self.start_s;
        let steps = &mut self.history.borrow_mut().steps;
        let step = match steps.last() {
            Some(last) if last.least <= discrepancy => Step { time_s, ..last.clone() },
            _ => Step { time_s, least: discrepancy, errors_percent: errors_percent() },
        };
        steps.push(step);
    }

    pub(crate) fn finish(self) -> History {
        self.history.into_inner()
    }
}

impl History {
    /// The least discrepancy of all.
    pub(crate) fn least(&self) -> f64 {
        self.steps.last().map_or(f64::NAN, |step| step.least)
    }

    /// States the errors that the search ends with.
    pub(crate) fn end_with(&mut self, errors_percent: Vec<f64>) {
        if let Some(last) = self.steps.last_mut() {
            last.errors_percent = errors_percent;
        }
    }

    /// The search after some evaluations, its end for more: time, discrepancy and errors.
    pub(crate) fn point_after(&self, evaluations: usize) -> Option<SearchPoint> {
        let made = evaluations.min(self.steps.len());
        self.after(evaluations).map(|step| step.point(made))
    }

    /// Evaluations made.
    pub(crate) fn len(&self) -> usize {
        self.steps.len()
    }

    /// The search after some evaluations; its end for more.
    fn after(&self, evaluations: usize) -> Option<&Step> {
        self.steps.get(evaluations.checked_sub(1)?).or(self.steps.last())
    }
}

/// Quartiles over searches after 1, 2, 3, 4, 6, 8, 12, 16, … evaluations, up to the longest.
pub(crate) fn curve(histories: &[History], timed: bool) -> Vec<ConvergencePoint> {
    let longest = histories.iter().map(|history| history.steps.len()).max().unwrap_or(0);
    checkpoints(longest)
        .into_iter()
        .map(|evaluations| {
            let at: Vec<&Step> =
                histories.iter().filter_map(|history| history.after(evaluations)).collect();
            let faults = at.iter().map(|step| step.errors_percent.len()).min().unwrap_or(0);
            let error = |fault| quartiles(at.iter().map(|s| s.errors_percent[fault]).collect());
            ConvergencePoint {
                evaluations: evaluations as u64,
                time_s: timed.then(|| median(at.iter().map(|step| step.time_s))),
                discrepancy: quartiles(at.iter().map(|step| step.least).collect()),
                errors_percent: (0..faults).map(error).collect(),
            }
        })
        .collect()
}

/// Powers of two and one and a half times these, ending at `longest`.
fn checkpoints(longest: usize) -> Vec<usize> {
    let powers = (0..usize::BITS - 1).map(|power| 1usize << power);
    let mut points: Vec<usize> = powers
        .take_while(|&point| point < longest)
        .flat_map(|point| [point, point + point / 2])
        .filter(|&point| point < longest)
        .collect();
    points.dedup();
    if longest > 0 {
        points.push(longest);
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checkpoints_grow_by_half_and_end_at_the_longest() {
        assert!(checkpoints(0).is_empty());
        assert_eq!(checkpoints(1), [1]);
        assert_eq!(checkpoints(10), [1, 2, 3, 4, 6, 8, 10]);
    }

    #[test]
    fn the_least_so_far_is_kept() {
        let recorder = Recorder::new(&|| 0.0);
        for discrepancy in [3.0, 5.0, 1.0] {
            recorder.note(discrepancy);
        }
        let points = curve(&[recorder.finish()], false);
        let medians: Vec<f64> = points.iter().map(|point| point.discrepancy.median).collect();
        assert_eq!(medians, [3.0, 3.0, 1.0]);
        assert_eq!(points[0].time_s, None);
        assert!(points[0].errors_percent.is_empty());
    }

    #[test]
    fn errors_are_those_of_the_best_point_so_far() {
        let recorder = Recorder::new(&|| 0.0);
        for (discrepancy, error) in [(3.0, 10.0), (5.0, 1.0), (1.0, 4.0)] {
            recorder.note_at(discrepancy, || vec![error]);
        }
        let points = curve(&[recorder.finish()], false);
        let errors: Vec<f64> = points.iter().map(|point| point.errors_percent[0].median).collect();
        assert_eq!(errors, [10.0, 10.0, 4.0]);
    }
}
