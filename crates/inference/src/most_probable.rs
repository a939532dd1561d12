//! The most probable numbers behind whitened data, with normal priors on some of them.
//!
//! ```text
//! x̂ = argmin |z(x)|² + Σ (x_i − m_i)²/s_i²        z = L⁻¹·(y − f(x))
//! C = (JᵀJ + diag(1/s²))⁻¹                         J = L⁻¹·∂f/∂x
//! ```
//!
//! by Gauss and Newton's steps, shortened until the sum falls. What the data leave open the priors
//! decide; without a prior a number has to show in the data.
//!
//! # Source
//!
//! Nocedal and Wright, *Numerical Optimization*, 10.3; Laplace's approximation of the posterior.

use nalgebra::{DMatrix, DVector};

use crate::{banded::dot, symmetric::SymmetricMatrix};

/// Data as a function of numbers.
pub trait Whitened {
    /// Why the function cannot be had at a point.
    type Error;

    /// Data less what the numbers predict, as white numbers of unit variance.
    ///
    /// # Errors
    ///
    /// Where the function cannot be had.
    fn residual(&mut self, numbers: &[f64]) -> Result<Vec<f64>, Self::Error>;

    /// Derivatives of the prediction as white numbers, one row a number.
    ///
    /// # Errors
    ///
    /// Where the function cannot be had.
    fn slopes(&mut self, numbers: &[f64]) -> Result<Vec<Vec<f64>>, Self::Error>;

    /// True where no further step may be taken: a search then ends where it is, not converged.
    fn is_spent(&self) -> bool {
        false
    }
}

/// One number that is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unknown {
    /// Standard deviation of a normal prior about zero; `None`: a flat prior.
    pub prior_std: Option<f64>,
    /// Most that one step may move it.
    pub reach: f64,
}

/// End of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct MostProbable {
    /// The numbers.
    pub numbers: Vec<f64>,
    /// Covariance of the numbers, by the last slopes.
    pub covariance: SymmetricMatrix,
    /// Inverse of the covariance.
    pub information: SymmetricMatrix,
    /// White residual at the numbers.
    pub white: Vec<f64>,
    /// True where the search ended because nothing more was to be gained.
    pub converged: bool,
}

/// Steps at most; four to six are usual.
const MOST_STEPS: usize = 12;
/// A step below this share of each standard deviation ends the search, where it gains no more than
/// [`LEAST_FALL`]: of numbers that the data know together far better than each, a step that is small for
/// each may gain much.
const LEAST_STEP: f64 = 0.05;
/// A fall of the sum below this ends the search: a seventh of a standard deviation is one of 0.02.
const LEAST_FALL: f64 = 0.02;
/// Parts of a step that are tried.
const SHARES: [f64; 4] = [1.0, 0.4, 0.15, 0.05];

/// Finds the most probable numbers from a start; `None` where neither data nor priors determine
/// them.
///
/// # Errors
///
/// Those of the function.
///
/// # Examples
///
/// A slope of 2 seen without noise, with a prior that expects none:
///
/// ```
/// use inference::{Unknown, Whitened, most_probable};
///
/// struct Line;
///
/// impl Whitened for Line {
///     type Error = std::convert::Infallible;
///
///     fn residual(&mut self, numbers: &[f64]) -> Result<Vec<f64>, Self::Error> {
///         Ok([1.0, 2.0].map(|x| (2.0 - numbers[0]) * x).to_vec())
///     }
///
///     fn slopes(&mut self, _: &[f64]) -> Result<Vec<Vec<f64>>, Self::Error> {
///         Ok(vec![vec![1.0, 2.0]])
///     }
/// }
///
/// let unknown = Unknown { prior_std: Some(1.0), reach: f64::INFINITY };
/// let found = most_probable(&mut Line, &[unknown], &[0.0])?.expect("a prior determines it");
/// // five parts of data beside one of prior
/// assert!((found.numbers[0] - 10.0 / 6.0).abs() < 1e-12);
/// assert!((found.covariance.at(0, 0) - 1.0 / 6.0).abs() < 1e-12);
/// # Ok::<_, std::convert::Infallible>(())
/// ```
pub fn most_probable<W: Whitened>(
    data: &mut W,
    unknowns: &[Unknown],
    start: &[f64],
) -> Result<Option<MostProbable>, W::Error> {
    let mut numbers = start.to_vec();
    let mut white = data.residual(&numbers)?;
    let mut converged = false;
    let (mut information, mut covariance);
    let mut steps = 0;
    loop {
        let slopes = data.slopes(&numbers)?;
        information = curvature(&slopes, unknowns);
        let Some(cholesky) = information.clone().cholesky() else { return Ok(None) };
        covariance = cholesky.inverse();
        let descent = DVector::from_fn(unknowns.len(), |i, _| {
            let prior = unknowns[i].prior_std.map_or(0.0, |std| numbers[i] / (std * std));
            dot(&slopes[i], &white) - prior
        });
        let step = &covariance * &descent;
        let size = |i: usize| step[i].abs() / covariance[(i, i)].sqrt();
        let gains_little = descent.dot(&step) < LEAST_FALL;
        if gains_little && (0..unknowns.len()).all(|i| size(i) < LEAST_STEP) {
            converged = true;
            break;
        }
        if steps == MOST_STEPS || data.is_spent() {
            break;
        }
        steps += 1;
        let reach = |i: usize| unknowns[i].reach / step[i].abs().max(f64::MIN_POSITIVE);
        let within = (0..unknowns.len()).map(reach).fold(1.0, f64::min);
        let before = sum(&white, unknowns, &numbers);
        let mut fall = None;
        for share in SHARES {
            let moved: Vec<f64> =
                numbers.iter().zip(step.iter()).map(|(x, d)| x + share * within * d).collect();
            let residual = data.residual(&moved)?;
            let after = sum(&residual, unknowns, &moved);
            if after < before {
                fall = Some(before - after);
                (numbers, white) = (moved, residual);
                break;
            }
        }
        match fall {
            // kinks of the function stop a search that is as good as at its end
            None => {
                converged = true;
                break;
            }
            Some(fall) if fall < LEAST_FALL => {
                converged = true;
                break;
            }
            Some(_) => {}
        }
    }
    let matrix = |of: &DMatrix<f64>| SymmetricMatrix::from_fn(of.nrows(), |i, j| of[(i, j)]);
    Ok(Some(MostProbable {
        numbers,
        covariance: matrix(&covariance),
        information: matrix(&information),
        white,
        converged,
    }))
}

/// `JᵀJ + diag(1/s²)`.
fn curvature(slopes: &[Vec<f64>], unknowns: &[Unknown]) -> DMatrix<f64> {
    let count = slopes.len();
    let mut curvature = DMatrix::zeros(count, count);
    for i in 0..count {
        for j in 0..=i {
            let product = dot(&slopes[i], &slopes[j]);
            curvature[(i, j)] = product;
            curvature[(j, i)] = product;
        }
        if let Some(std) = unknowns[i].prior_std {
            curvature[(i, i)] += 1.0 / (std * std);
        }
    }
    curvature
}

/// `|z|² + Σ (x/s)²`; infinite where the prediction is not a number.
fn sum(white: &[f64], unknowns: &[Unknown], numbers: &[f64]) -> f64 {
    let prior = unknowns
        .iter()
        .zip(numbers)
        .map(|(unknown, x)| unknown.prior_std.map_or(0.0, |std| (x / std) * (x / std)));
    let sum = dot(white, white) + prior.sum::<f64>();
    if sum.is_nan() { f64::INFINITY } else { sum }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `y = exp(−a·t) + b` at ten times.
    struct Decay {
        seen: Vec<f64>,
        evaluations: usize,
        most_evaluations: usize,
    }

    impl Decay {
        fn of(numbers: [f64; 2], most_evaluations: usize) -> Self {
            Self { seen: Self::predicted(&numbers), evaluations: 0, most_evaluations }
        }

        fn predicted(numbers: &[f64]) -> Vec<f64> {
            (0..10).map(|t| (-numbers[0] * f64::from(t)).exp() + numbers[1]).collect()
        }
    }

    impl Whitened for Decay {
        type Error = core::convert::Infallible;

        fn residual(&mut self, numbers: &[f64]) -> Result<Vec<f64>, Self::Error> {
            self.evaluations += 1;
            let predicted = Self::predicted(numbers);
            Ok(self.seen.iter().zip(predicted).map(|(y, f)| 1e3 * (y - f)).collect())
        }

        fn slopes(&mut self, numbers: &[f64]) -> Result<Vec<Vec<f64>>, Self::Error> {
            let of_rate = (0..10).map(|t| -1e3 * f64::from(t) * (-numbers[0] * f64::from(t)).exp());
            Ok(vec![of_rate.collect(), vec![1e3; 10]])
        }

        fn is_spent(&self) -> bool {
            self.evaluations >= self.most_evaluations
        }
    }

    const FREE: Unknown = Unknown { prior_std: None, reach: 0.3 };

    #[test]
    fn a_bent_function_is_followed_to_the_truth() {
        let mut data = Decay::of([0.7, 0.2], usize::MAX);
        let found = most_probable(&mut data, &[FREE; 2], &[0.1, 0.0]).unwrap().unwrap();
        assert!(found.converged && data.evaluations < 20, "{found:?}");
        assert!((found.numbers[0] - 0.7).abs() < 1e-4, "{found:?}");
        assert!((found.numbers[1] - 0.2).abs() < 1e-4, "{found:?}");
    }

    /// The sum of two numbers, seen to a thousandth.
    struct Total;

    impl Whitened for Total {
        type Error = core::convert::Infallible;

        fn residual(&mut self, numbers: &[f64]) -> Result<Vec<f64>, Self::Error> {
            Ok(vec![-1e3 * (numbers[0] + numbers[1])])
        }

        fn slopes(&mut self, _: &[f64]) -> Result<Vec<Vec<f64>>, Self::Error> {
            Ok(vec![vec![1e3]; 2])
        }
    }

    #[test]
    fn numbers_that_are_known_together_are_found_from_nearby() {
        let unknown = Unknown { prior_std: Some(1.0), reach: f64::INFINITY };
        // ten standard deviations of the sum, and a hundredth of that of each number
        let found = most_probable(&mut Total, &[unknown; 2], &[0.01, 0.0]).unwrap().unwrap();
        assert!(found.converged && found.white[0].abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn a_search_whose_evaluations_are_spent_has_not_converged() {
        let mut data = Decay::of([0.7, 0.2], 2);
        let found = most_probable(&mut data, &[FREE; 2], &[0.1, 0.0]).unwrap().unwrap();
        assert!(!found.converged, "{found:?}");
        assert!((found.numbers[0] - 0.7).abs() > 1e-2, "{found:?}");
        // one step may try shorter ones
        assert!(data.evaluations <= 1 + SHARES.len(), "{}", data.evaluations);
        // at its end from the start it has, whatever it may spend
        let mut data = Decay::of([0.7, 0.2], 0);
        assert!(most_probable(&mut data, &[FREE; 2], &[0.7, 0.2]).unwrap().unwrap().converged);
    }

    #[test]
    fn the_data_leave_to_the_prior_what_they_do_not_show() {
        let mut data = Decay::of([0.7, 0.2], usize::MAX);
        let known = Unknown { prior_std: Some(1e-6), ..FREE };
        let found = most_probable(&mut data, &[known, FREE], &[0.0, 0.0]).unwrap().unwrap();
        assert!(found.numbers[0].abs() < 1e-3, "{found:?}");
        // anti-test: another prior gives another answer
        let open = Unknown { prior_std: Some(1.0), ..FREE };
        let found = most_probable(&mut data, &[open, FREE], &[0.0, 0.0]).unwrap().unwrap();
        assert!(found.numbers[0] > 0.69, "{found:?}");
    }

    #[test]
    fn what_nothing_determines_has_no_answer() {
        struct Blind;
        impl Whitened for Blind {
            type Error = core::convert::Infallible;
            fn residual(&mut self, _: &[f64]) -> Result<Vec<f64>, Self::Error> {
                Ok(vec![1.0; 3])
            }
            fn slopes(&mut self, _: &[f64]) -> Result<Vec<Vec<f64>>, Self::Error> {
                Ok(vec![vec![0.0; 3]])
            }
        }
        assert_eq!(most_probable(&mut Blind, &[FREE], &[0.0]).unwrap(), None);
    }
}
