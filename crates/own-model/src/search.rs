//! Sets of causes, grown from the best ones and compared by their evidence.

use crate::{
    cause::Cause,
    fit::{Fitted, fit},
    model::ModelError,
    problem::Problem,
    scan::candidates,
};

/// Most causes at once.
const MOST_CAUSES: usize = 3;
/// Chance beforehand that some cause acts beside those of a set.
const CHANCE_OF_A_CAUSE: f64 = 0.5;

/// A set of causes with its probability among those that were compared.
#[derive(Clone, Debug)]
pub(crate) struct Rated {
    pub(crate) fitted: Fitted,
    /// Logarithm of evidence times prior.
    pub(crate) ln_weight: f64,
    pub(crate) probability: f64,
}

impl Rated {
    pub(crate) fn has(&self, name: &str) -> bool {
        self.fitted.causes.iter().any(|cause| cause.name == name)
    }
}

/// Fits sets of causes, the set of none first, and rates them; most probable first.
pub(crate) fn search(problem: &Problem<'_>, menu: &[Cause]) -> Result<Vec<Rated>, ModelError> {
    let none = fit(problem, &[], &vec![0.0; problem.rough.len()])?;
    let mut sets = Sets { problem, names: names(menu), rated: Vec::new() };
    sets.add(none);
    let mut best = 0;
    for _ in 0..MOST_CAUSES {
        let base = sets.rated[best].fitted.clone();
        sets.grow(&base, menu)?;
        let next = sets.best();
        // nothing more helps, or another set of as many causes was better: its end is known too
        if next == best {
            break;
        }
        best = next;
    }
    sets.exchange(best, menu)?;
    Ok(sets.told())
}

/// Distinct names of causes.
fn names(menu: &[Cause]) -> usize {
    let mut names: Vec<&str> = menu.iter().map(|cause| cause.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    names.len()
}

/// Sets that were fitted.
struct Sets<'a> {
    problem: &'a Problem<'a>,
    names: usize,
    rated: Vec<Rated>,
}

impl Sets<'_> {
    fn add(&mut self, fitted: Fitted) {
        let per_cause = libm::log(CHANCE_OF_A_CAUSE / self.names as f64);
        let shapes = |cause: &Cause| libm::log(cause.shapes as f64);
        let prior: f64 = fitted.causes.iter().map(|cause| per_cause - shapes(cause)).sum();
        let ln_weight = fitted.ln_evidence + prior;
        self.rated.push(Rated { fitted, ln_weight, probability: 0.0 });
    }

    /// Fits a set with each cause more that is worth it.
    fn grow(&mut self, base: &Fitted, menu: &[Cause]) -> Result<(), ModelError> {
        for candidate in candidates(self.problem, base, menu)? {
            let mut causes = base.causes.clone();
            causes.push(candidate.cause);
            if !self.knows(&causes) {
                let fitted = fit(self.problem, &causes, &candidate.start)?;
                self.add(fitted);
            }
        }
        Ok(())
    }

    /// Fits a set of several causes with each of them left out, and with others in its place.
    fn exchange(&mut self, best: usize, menu: &[Cause]) -> Result<(), ModelError> {
        let whole = self.rated[best].fitted.clone();
        if whole.causes.len() < 2 {
            return Ok(());
        }
        for out in 0..whole.causes.len() {
            let mut causes = whole.causes.clone();
            causes.remove(out);
            let known = self.rated.iter().find(|rated| same(&rated.fitted.causes, &causes));
            let less = if let Some(rated) = known {
                rated.fitted.clone()
            } else {
                let sizes = self.problem.sizes(&causes).len();
                let less = fit(self.problem, &causes, &vec![0.0; sizes])?;
                self.add(less.clone());
                less
            };
            self.grow(&less, menu)?;
        }
        Ok(())
    }

    fn knows(&self, causes: &[Cause]) -> bool {
        self.rated.iter().any(|rated| same(&rated.fitted.causes, causes))
    }

    fn best(&self) -> usize {
        let weights = self.rated.iter().enumerate();
        weights.max_by(|a, b| a.1.ln_weight.total_cmp(&b.1.ln_weight)).map_or(0, |(n, _)| n)
    }

    /// All sets with their probabilities, most probable first.
    fn told(mut self) -> Vec<Rated> {
        let most = self.rated.iter().map(|r| r.ln_weight).fold(f64::NEG_INFINITY, f64::max);
        let all: f64 = self.rated.iter().map(|r| libm::exp(r.ln_weight - most)).sum();
        for rated in &mut self.rated {
            rated.probability = libm::exp(rated.ln_weight - most) / all;
        }
        self.rated.sort_by(|a, b| b.ln_weight.total_cmp(&a.ln_weight));
        self.rated
    }
}

/// True where two sets have the same causes in the same shapes.
fn same(a: &[Cause], b: &[Cause]) -> bool {
    a.len() == b.len() && a.iter().all(|cause| b.iter().any(|other| cause.is(other)))
}
