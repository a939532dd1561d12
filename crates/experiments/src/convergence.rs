//! How the discrepancy falls with evaluations and with time (Figs 6-8 of the FREEDOM paper).

use std::cell::RefCell;

use fdi_core::report::ConvergencePoint;

use crate::score::{median, quartiles};

/// Least discrepancy so far at each evaluation of one search.
#[derive(Clone, Debug, Default)]
pub(crate) struct History {
    /// One entry an evaluation: seconds from the start, least discrepancy so far, A.
    steps: Vec<(f64, f64)>,
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

    /// Notes the discrepancy of an evaluation.
    pub(crate) fn note(&self, discrepancy: f64) {
        let time_s = (self.clock)() - self.start_s;
        let steps = &mut self.history.borrow_mut().steps;
        let least = steps.last().map_or(discrepancy, |(_, least)| least.min(discrepancy));
        steps.push((time_s, least));
    }

    pub(crate) fn finish(self) -> History {
        self.history.into_inner()
    }
}

impl History {
    /// The least discrepancy of all.
    pub(crate) fn least(&self) -> f64 {
        self.steps.last().map_or(f64::NAN, |(_, least)| *least)
    }

    /// The least discrepancy after some evaluations, and when; that of the end for more.
    fn after(&self, evaluations: usize) -> Option<(f64, f64)> {
        self.steps.get(evaluations.checked_sub(1)?).or(self.steps.last()).copied()
    }
}

/// Quartiles over searches after 1, 2, 3, 4, 6, 8, 12, 16, … evaluations, up to the longest.
pub(crate) fn curve(histories: &[History], timed: bool) -> Vec<ConvergencePoint> {
    let longest = histories.iter().map(|history| history.steps.len()).max().unwrap_or(0);
    checkpoints(longest)
        .into_iter()
        .map(|evaluations| {
            let at: Vec<(f64, f64)> =
                histories.iter().filter_map(|history| history.after(evaluations)).collect();
            let discrepancy = quartiles(at.iter().map(|(_, least)| *least).collect());
            ConvergencePoint {
                evaluations: evaluations as u64,
                time_s: timed.then(|| median(at.iter().map(|(time_s, _)| *time_s))),
                discrepancy,
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
    }
}
