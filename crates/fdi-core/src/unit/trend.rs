//! Trends over units: coefficients of terms, and what each unit is off the trend of the others.
//!
//! # Source
//!
//! Ridge regression and leave-one-out residuals: Hastie, Tibshirani and Friedman, *The Elements of
//! Statistical Learning*, 3.4 and 7.10; shrinkage of each slope: James and Stein, Proc. 4th Berkeley
//! Symposium 1, 1961.

use inference::dot;
use nalgebra::DMatrix;

use crate::offline::error_model::{ErrorModelError, add_scaled};

/// Spreads beyond which a trend is not followed.
pub(crate) const FARTHEST: f64 = 4.0;
/// Machines of either play from which both have a covariance of their own.
pub(crate) const LEAST_MACHINES: usize = 100;
/// Weight of a slope of no error, in units drawn.
const RIDGE: f64 = 0.3;

/// A row a term or a unit.
pub(crate) type Rows = Vec<Vec<f64>>;

/// Coefficients of the trend, and what each unit's difference is off the trend of the others.
pub(crate) fn trend(
    terms: &[Vec<f64>],
    differences: &[Vec<f64>],
) -> Result<(Rows, Rows), ErrorModelError> {
    let (count, width) = (terms.len(), terms.first().map_or(1, Vec::len));
    if count < 2 * width {
        return Err(ErrorModelError::TooFewSignals { found: count, needed: width });
    }
    let design = DMatrix::from_fn(count, width, |row, term| terms[row][term]);
    let mut gram = design.tr_mul(&design);
    for term in 1..width {
        gram[(term, term)] += RIDGE;
    }
    let inverse = gram.cholesky().ok_or(ErrorModelError::DegenerateConditions)?.inverse();
    let pseudo = &inverse * design.transpose();
    let samples = differences[0].len();
    let sum = |weights: &mut dyn Iterator<Item = f64>, rows: &[Vec<f64>]| {
        let mut sum = vec![0.0; samples];
        for (weight, row) in weights.zip(rows) {
            add_scaled(&mut sum, weight, row);
        }
        sum
    };
    let coefficients: Rows =
        (0..width).map(|term| sum(&mut pseudo.row(term).iter().copied(), differences)).collect();
    let residual = |row: usize| {
        let leverage = design.row(row).transpose().dot(&pseudo.column(row));
        let fitted = sum(&mut terms[row].iter().copied(), &coefficients);
        let left_out = 1.0 / (1.0 - leverage).max(f64::EPSILON);
        differences[row].iter().zip(fitted).map(|(y, f)| left_out * (y - f)).collect()
    };
    let residuals: Rows = (0..count).map(residual).collect();
    let scatter = residuals.iter().map(|r| dot(r, r)).sum::<f64>() / count as f64;
    let shrunk = |(term, mut row): (usize, Vec<f64>)| {
        // of a slope that is nothing but noise nothing stays
        let noise = inverse[(term, term)] * scatter;
        let share = (1.0 - noise / dot(&row, &row).max(f64::MIN_POSITIVE)).max(0.0);
        if term > 0 {
            for value in &mut row {
                *value *= share;
            }
        }
        row
    };
    let coefficients = coefficients.into_iter().enumerate().map(shrunk).collect();
    Ok((coefficients, residuals))
}

/// [`trend`] of differences that are numbers of several units: the slopes of each number are shrunk by
/// its own noise.
pub(crate) fn trend_of_numbers(
    terms: &[Vec<f64>],
    differences: &[Vec<f64>],
) -> Result<(Rows, Rows), ErrorModelError> {
    let mut coefficients: Rows = vec![Vec::new(); terms.first().map_or(1, Vec::len)];
    let mut residuals: Rows = vec![Vec::new(); differences.len()];
    for number in 0..differences.first().map_or(0, Vec::len) {
        let own: Rows = differences.iter().map(|difference| vec![difference[number]]).collect();
        let (of_terms, of_units) = trend(terms, &own)?;
        for (all, own) in coefficients.iter_mut().zip(of_terms) {
            all.extend(own);
        }
        for (all, own) in residuals.iter_mut().zip(of_units) {
            all.extend(own);
        }
    }
    Ok((coefficients, residuals))
}
