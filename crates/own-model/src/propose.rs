//! The test that tells sets of causes apart which recordings leave open.
//!
//! ```text
//! λ = dᵀ(I − J·(C⁻¹ + JᵀJ)⁻¹·Jᵀ)·d
//! ```
//!
//! with the white difference `d` of what two sets predict in a test, the white slopes `J` of the
//! second, and the covariance `C` of its sizes: what the second cannot imitate. `λ/2` is the gain of
//! likelihood that is expected where the first set is true.

use ema_sim::Geometry;
use inference::dot;
use nalgebra::{DMatrix, DVector};

use crate::{
    cause::menu,
    fit::{Fitted, whitened},
    model::{ModelError, OwnModel, Record, Recordings, Test},
    problem::{Problem, check},
    search::search,
};

/// Odds to the most probable set beyond which a set is no longer open: 100 to 1.
const OPEN: f64 = 4.605_170_185_988_092;
/// Most sets that are compared.
const MOST_SETS: usize = 5;
/// Step of a derivative in standard deviations of the posterior.
const STEP_OVER_STD: f64 = 0.3;

/// How well a test tells two sets of causes apart.
#[derive(Clone, Debug, PartialEq)]
pub struct SetSeparation {
    /// Causes of the first set and of the second; none: the model as it is.
    pub causes: [Vec<String>; 2],
    /// `λ`, the lesser of both ways round.
    pub separation: f64,
}

/// A test and what it would tell.
#[derive(Clone, Debug, PartialEq)]
pub struct ProposedTest {
    /// Name in answers.
    pub name: String,
    /// Each pair of open sets of which none holds the other.
    pub pairs: Vec<SetSeparation>,
}

impl ProposedTest {
    /// Separation of the pair that it tells apart least; `None` where nothing is open.
    pub fn least(&self) -> Option<f64> {
        self.pairs.iter().map(|pair| pair.separation).min_by(f64::total_cmp)
    }
}

/// Answer of [`propose`].
#[derive(Clone, Debug, PartialEq)]
pub struct OwnProposal {
    /// The tests, best first.
    pub tests: Vec<ProposedTest>,
    /// Runs of the model, one for each recording.
    pub runs: usize,
}

/// Rates tests by how well they tell open sets of causes apart.
///
/// # Errors
///
/// Those of [`explain`](crate::explain), and [`ModelError::NoCommand`].
pub fn propose(
    model: &dyn OwnModel,
    geometry: Geometry,
    recordings: Recordings<'_>,
    tests: &[(String, Test)],
) -> Result<OwnProposal, ModelError> {
    if tests.is_empty() {
        return Err(ModelError::NoCommand);
    }
    let problem = Problem::new(model, recordings)?;
    let menu = menu(model, geometry, &problem.scales)?;
    let sets = search(&problem, &menu)?;
    let most = sets[0].ln_weight;
    let open = sets.iter().filter(|set| most - set.ln_weight <= OPEN).take(MOST_SETS);
    let open: Vec<&Fitted> = open.map(|set| &set.fitted).collect();
    let mut proposed = Vec::new();
    let tests: Vec<Record> =
        tests.iter().map(|(name, test)| unmeasured(&problem, name, test)).collect();
    for test in &tests {
        check(test, problem.signals())?;
    }
    for test in &tests {
        proposed.push(proposal(&problem, &open, test)?);
    }
    let least = |test: &ProposedTest| test.least().unwrap_or(0.0);
    proposed.sort_by(|a, b| least(b).total_cmp(&least(a)));
    Ok(OwnProposal { tests: proposed, runs: problem.runs() })
}

/// A test as a recording whose signals are not known.
fn unmeasured(problem: &Problem<'_>, name: &str, test: &Test) -> Record {
    let signals = vec![vec![0.0; test.command.len()]; problem.signals().len()];
    Record { name: name.to_owned(), test: test.clone(), signals }
}

fn proposal(
    problem: &Problem<'_>,
    open: &[&Fitted],
    record: &Record,
) -> Result<ProposedTest, ModelError> {
    let seen = open.iter().map(|set| Seen::new(problem, record, set));
    let seen = seen.collect::<Result<Vec<Seen<'_>>, ModelError>>()?;
    let mut pairs = Vec::new();
    for (n, first) in seen.iter().enumerate() {
        for second in seen[n + 1..].iter().filter(|second| !nested(first.set, second.set)) {
            let separation = second.apart_from(first).min(first.apart_from(second));
            let names = |set: &Seen<'_>| set.set.causes.iter().map(|c| c.name.clone()).collect();
            pairs.push(SetSeparation { causes: [names(first), names(second)], separation });
        }
    }
    Ok(ProposedTest { name: record.name.clone(), pairs })
}

/// True where one set has all causes of the other: a small cause more is no question between two.
fn nested(a: &Fitted, b: &Fitted) -> bool {
    let (few, many) = if a.causes.len() <= b.causes.len() { (a, b) } else { (b, a) };
    few.causes.iter().all(|cause| many.causes.iter().any(|other| cause.name == other.name))
}

/// Predictions of a set in a test.
struct Seen<'a> {
    set: &'a Fitted,
    predicted: Vec<f64>,
    /// White slopes in standard deviations of the posterior.
    slopes: Vec<Vec<f64>>,
}

impl<'a> Seen<'a> {
    fn new(problem: &Problem<'_>, record: &Record, set: &'a Fitted) -> Result<Self, ModelError> {
        let records = core::slice::from_ref(record);
        let white = |values: &[f64]| -> Result<Vec<f64>, ModelError> {
            let residuals = problem.residuals(records, &set.causes, values)?;
            Ok(whitened(&residuals, &set.noise))
        };
        let predicted = white(&set.values)?;
        let mut slopes = Vec::new();
        for (place, std) in set.stds.iter().enumerate() {
            let mut moved = set.values.clone();
            moved[place] += STEP_OVER_STD * std;
            let there = white(&moved)?;
            slopes
                .push(predicted.iter().zip(there).map(|(a, b)| (a - b) / STEP_OVER_STD).collect());
        }
        Ok(Self { set, predicted, slopes })
    }

    /// `λ` of another set against this one.
    fn apart_from(&self, other: &Seen<'_>) -> f64 {
        let shared = self.predicted.len().min(other.predicted.len());
        // noises of other orders use up other numbers of samples at the start
        let tail = |all: &[f64]| all[all.len() - shared..].to_vec();
        let (a, b) = (tail(&self.predicted), tail(&other.predicted));
        let apart: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
        let slopes: Vec<Vec<f64>> = self.slopes.iter().map(|slope| tail(slope)).collect();
        let n = slopes.len();
        let prior = DMatrix::from_fn(n, n, |i, j| self.set.correlations[i][j]);
        let Some(inverse) = prior.try_inverse() else { return 0.0 };
        let matrix = DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] + dot(&slopes[i], &slopes[j]));
        let b = DVector::from_fn(n, |i, _| dot(&slopes[i], &apart));
        let Some(cholesky) = matrix.cholesky() else { return 0.0 };
        (dot(&apart, &apart) - b.dot(&cholesky.solve(&b))).max(0.0)
    }
}
