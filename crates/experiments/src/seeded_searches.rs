//! Scalar searches by seed, so that methods can be compared in pairs.

use fdi_core::{ema_sim::FAULT_COUNT, in_parallel};

use crate::{
    contender::Contender,
    convergence::{Recorder, SearchPoint},
    request::{EvaluationError, EvaluationRequest},
    score::{errors_percent, levels_of},
    search_view::{SearchSpace, SearchView},
    trials::{Arena, Test, prepare},
};

/// Levels of the design `test`: `0.002 + 0.048·u`.
const LEAST_TEST_LEVEL: f64 = 0.002;
const TEST_LEVELS: f64 = 0.048;

/// A scalar search that has ended.
#[derive(Clone, Debug, PartialEq)]
pub struct SeededSearch {
    /// The method.
    pub contender: Contender,
    /// Levels of the faults looked for that were found.
    pub levels: Vec<f64>,
    /// Eq. 20 of the FREEDOM paper for each of them, %.
    pub errors_percent: Vec<f64>,
    /// The search on its way: after each number of evaluations that was asked for, and at its end.
    pub points: Vec<SearchPoint>,
}

/// The searches of one seed: one condition, one initial design, every method.
#[derive(Clone, Debug, PartialEq)]
pub struct SearchesOfSeed {
    /// Index of the condition in the design.
    pub index: usize,
    /// The levels that were there.
    pub truth: Vec<f64>,
    /// One for each method, in the order of the request.
    pub searches: Vec<SeededSearch>,
}

/// Discrepancies around the truth of a condition.
#[derive(Clone, Debug, PartialEq)]
pub struct DiscrepancyRay {
    /// Index of the condition in the design.
    pub index: usize,
    /// `δ` at the truth, A.
    pub at_truth_a: f64,
    /// `δ` of the machine without faults, A.
    pub at_healthy_a: f64,
    /// `δ` at `truth + s·(corner − truth)` for each asked share `s`, A.
    pub along_a: Vec<f64>,
}

/// An experiment prepared for scalar searches by seed.
///
/// The seed of a search is its condition's index under the root seed of the request: condition,
/// noise and initial design are then the same for every method.
pub struct SeededSearches<'a> {
    arena: Arena<'a>,
    tests: Vec<Test>,
    request: &'a EvaluationRequest<'a>,
}

impl std::fmt::Debug for SeededSearches<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SeededSearches").field("request", self.request).finish_non_exhaustive()
    }
}

impl<'a> SeededSearches<'a> {
    /// Simulates the conditions and learns what is known beforehand.
    ///
    /// # Errors
    ///
    /// [`EvaluationError`] when the setting cannot be simulated or learnt from.
    pub fn prepare(request: &'a EvaluationRequest<'a>) -> Result<Self, EvaluationError> {
        let (arena, tests) = prepare(request)?;
        Ok(Self { arena, tests, request })
    }

    /// Changes the view: searches with another view of the scalar.
    #[must_use]
    pub fn seen(self, view: SearchView) -> Self {
        Self { arena: self.arena.seen(view), ..self }
    }

    /// Searches with every method at some conditions, each noted after `marks` evaluations.
    ///
    /// The methods of a condition run one after the other on one thread.
    ///
    /// # Errors
    ///
    /// [`EvaluationError`] when a search fails or a method is none of a scalar.
    ///
    /// # Panics
    ///
    /// When there is no condition of an index.
    pub fn run(
        &self,
        indices: &[usize],
        marks: &[usize],
    ) -> Result<Vec<SearchesOfSeed>, EvaluationError> {
        in_parallel(indices, self.request.jobs, |_, &index| {
            let test = &self.tests[index];
            let sought = self.arena.experiment().sought_indices();
            let mut searches = Vec::new();
            for &contender in self.request.contenders {
                let found = self.arena.find(contender, index, test)?;
                let history = &found.history;
                let levels = levels_of(&sought, &found.estimate);
                let ends = history.point_after(history.len());
                let marks = marks.iter().filter(|&&mark| mark < history.len());
                searches.push(SeededSearch {
                    contender,
                    errors_percent: errors_percent(&sought, &test.condition.levels, &levels),
                    levels: sought.iter().map(|&fault| levels[fault]).collect(),
                    points: marks
                        .filter_map(|&mark| history.point_after(mark))
                        .chain(ends)
                        .collect(),
                });
            }
            let truth = sought.iter().map(|&fault| test.condition.levels[fault]).collect();
            Ok(SearchesOfSeed { index, truth, searches })
        })
    }

    /// Discrepancies on the way from the truth of each condition to a point of the domain `[0, 1]`, by
    /// shares of it.
    ///
    /// The points are the uniform numbers that the conditions were drawn from, each the next
    /// condition's; `k7` stays.
    ///
    /// # Errors
    ///
    /// [`EvaluationError`] when the monitor cannot be made.
    pub fn rays(self, shares: &[f64]) -> Result<Vec<DiscrepancyRay>, EvaluationError> {
        let whole = self.seen(SearchView::of(SearchSpace::Linear { largest: 1.0 }));
        let indices: Vec<usize> = (0..whole.tests.len()).collect();
        in_parallel(&indices, whole.request.jobs, |_, &index| whole.ray(index, shares))
    }

    fn ray(&self, index: usize, shares: &[f64]) -> Result<DiscrepancyRay, EvaluationError> {
        let test = &self.tests[index];
        let sought = self.arena.experiment().sought_indices();
        let of = |test: &Test| -> Vec<f64> {
            sought.iter().map(|&fault| test.condition.levels[fault]).collect()
        };
        let truth = of(test);
        let mut target: Vec<f64> = of(&self.tests[(index + 1) % self.tests.len()])
            .iter()
            .map(|level| (level - LEAST_TEST_LEVEL) / TEST_LEVELS)
            .collect();
        let direction = sought.iter().position(|&fault| fault == FAULT_COUNT - 1);
        if let Some(place) = direction {
            target[place] = truth[place];
        }
        let recorder = Recorder::new(&|| 0.0);
        let mut discrepancy = self.arena.discrepancy(test, &recorder)?;
        let mut along = |share: f64| {
            let point: Vec<f64> =
                truth.iter().zip(&target).map(|(from, to)| from + share * (to - from)).collect();
            discrepancy(&point)
        };
        let at_truth_a = along(0.0);
        let along_a = shares.iter().map(|&share| along(share)).collect();
        let mut healthy = vec![0.0; truth.len()];
        if let Some(place) = direction {
            healthy[place] = truth[place];
        }
        let at_healthy_a = discrepancy(&healthy);
        Ok(DiscrepancyRay { index, at_truth_a, at_healthy_a, along_a })
    }
}
