//! Which causes are worth a fit: the evidence that each would add if the model were linear in it.
//!
//! ```text
//! ΔlnZ = ½·bᵀ(I + JᵀJ)⁻¹b − ½·ln det(I + JᵀJ), with the cause's slopes less without them
//! ```
//!
//! with white residuals `z`, white slopes `J` and `b = Jᵀz`. It is asked twice: with the noise that
//! the residual itself shows, which takes what is smooth for noise, and with white noise, which does
//! not.

use inference::dot;
use nalgebra::{DMatrix, DVector};

use crate::{
    cause::{Cause, Size},
    fit::{Fitted, inward, values, white_noise, whitened},
    model::ModelError,
    problem::{Problem, Residuals},
};

/// Step of the sizes that are fitted already, in standard deviations of the prior.
const STEP: f64 = 0.05;
/// Causes that are fitted of those that a scan puts first, for each of its two noises.
pub(crate) const FITTED: usize = 4;

/// A cause that may be added, and where its fit begins.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    pub(crate) cause: Cause,
    /// Start of all sizes, in units of their priors.
    pub(crate) start: Vec<f64>,
}

/// Change of the residuals with one size, in units of its prior.
type Slope = Residuals;

/// The causes that would explain most of what a fit leaves, best first for each noise.
pub(crate) fn candidates(
    problem: &Problem<'_>,
    fitted: &Fitted,
    menu: &[Cause],
) -> Result<Vec<Candidate>, ModelError> {
    let known = slopes(problem, fitted, None, STEP)?;
    let new = menu.iter().filter(|cause| !has(fitted, cause));
    let mut scanned = Vec::new();
    for cause in new {
        for step in cause.sizes[0].trials {
            let slopes = slopes(problem, fitted, Some(cause), *step)?;
            let finite = |slope: &Slope| slope.iter().flatten().flatten().all(|x| x.is_finite());
            if slopes.iter().all(finite) {
                scanned.push((cause, slopes));
            }
        }
    }
    let mut chosen: Vec<Candidate> = Vec::new();
    for noise in [fitted.noise.clone(), white_noise(problem, &fitted.residuals)] {
        let known: Vec<Vec<f64>> = known.iter().map(|slope| whitened(slope, &noise)).collect();
        let white = whitened(&fitted.residuals, &noise);
        let base = linear(&known, &white).0;
        let mut rated: Vec<(f64, Candidate)> = Vec::new();
        for (cause, slopes) in &scanned {
            let own = slopes.iter().map(|slope| whitened(slope, &noise));
            let all: Vec<Vec<f64>> = known.iter().cloned().chain(own).collect();
            let (evidence, step) = linear(&all, &white);
            let start = start(problem, fitted, cause, &step);
            let gain = evidence - base - libm::log(cause.shapes as f64);
            rated.push((gain, Candidate { cause: (*cause).clone(), start }));
        }
        rated.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut names: Vec<String> = Vec::new();
        for (_, candidate) in rated {
            let name = &candidate.cause.name;
            if names.len() == FITTED {
                break;
            }
            if !names.contains(name) {
                names.push(name.clone());
                if !chosen.iter().any(|earlier| earlier.cause.is(&candidate.cause)) {
                    chosen.push(candidate);
                }
            }
        }
    }
    Ok(chosen)
}

/// True where a cause is in a set already.
fn has(fitted: &Fitted, cause: &Cause) -> bool {
    fitted.causes.iter().any(|other| other.is(cause))
}

/// Slopes of the residuals: of the sizes that are fitted, or of a cause beside them.
fn slopes(
    problem: &Problem<'_>,
    fitted: &Fitted,
    cause: Option<&Cause>,
    step: f64,
) -> Result<Vec<Slope>, ModelError> {
    let mut causes = fitted.causes.clone();
    causes.extend(cause.cloned());
    let sizes = problem.sizes(&causes);
    let from = if cause.is_some() { fitted.values.len() } else { 0 };
    let mut at = fitted.values.clone();
    at.extend(sizes[at.len()..].iter().map(|size| size.base));
    let units: Vec<f64> = sizes.iter().zip(&at).map(|(s, x)| (x - s.base) / s.std).collect();
    let slope = |place: usize| {
        let step = inward(&sizes[place], units[place], step);
        let mut moved = units.clone();
        moved[place] += step;
        let there = problem.residuals(problem.train, &causes, &values(&sizes, &moved))?;
        Ok(quotient(&fitted.residuals, &there, step))
    };
    (from..sizes.len()).map(slope).collect()
}

/// Change of predictions over a step.
fn quotient(here: &Residuals, there: &Residuals, step: f64) -> Slope {
    let of_record =
        |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(|(a, b)| (a - b) / step).collect();
    let of_signal =
        |(a, b): (&Vec<Vec<f64>>, &Vec<Vec<f64>>)| a.iter().zip(b).map(of_record).collect();
    here.iter().zip(there).map(of_signal).collect()
}

/// Evidence of slopes with unit priors, and the most probable step.
fn linear(slopes: &[Vec<f64>], white: &[f64]) -> (f64, Vec<f64>) {
    let n = slopes.len();
    let matrix =
        DMatrix::from_fn(n, n, |i, j| dot(&slopes[i], &slopes[j]) + if i == j { 1.0 } else { 0.0 });
    let b = DVector::from_fn(n, |i, _| dot(&slopes[i], white));
    let Some(cholesky) = matrix.cholesky() else { return (f64::NEG_INFINITY, vec![0.0; n]) };
    let step = cholesky.solve(&b);
    let ln_det: f64 = cholesky.l().diagonal().iter().map(|x| 2.0 * libm::log(*x)).sum();
    (0.5 * (b.dot(&step) - ln_det), step.iter().copied().collect())
}

/// Where the fit of a fit's causes and one more begins.
fn start(problem: &Problem<'_>, fitted: &Fitted, cause: &Cause, step: &[f64]) -> Vec<f64> {
    let mut causes = fitted.causes.clone();
    causes.push(cause.clone());
    let sizes = problem.sizes(&causes);
    let unit = |(place, size): (usize, &Size)| {
        let before = fitted.values.get(place).map_or(0.0, |x| (x - size.base) / size.std);
        // a linear step is believed as far as the prior is
        let value = (before + step[place].clamp(-1.0, 1.0)) * size.std + size.base;
        (value.clamp(size.least, size.most) - size.base) / size.std
    };
    sizes.iter().enumerate().map(unit).collect()
}
