//! Least squares over a few columns.

use nalgebra::{DMatrix, DVector};

/// Share of a column's own size below which the others make it up.
const LEAST_OWN: f64 = 1e-9;

/// Coefficients of columns that are nearest to a signal, with the share of its energy left.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Fit {
    /// One for each column.
    pub(super) coefficients: Vec<f64>,
    /// Energy of the residual over that of the signal about its mean.
    pub(super) left: f64,
}

impl Fit {
    /// Fits columns to a signal; `None` where there is nothing to fit or columns are alike.
    pub(super) fn new(signal: &[f64], columns: &[Vec<f64>]) -> Option<Self> {
        let count = columns.len();
        let energy = spread(signal);
        if signal.len() < 4 * count || energy <= 0.0 {
            return None;
        }
        let sizes: Vec<f64> = columns.iter().map(|c| libm::sqrt(dot(c, c))).collect();
        if sizes.iter().any(|size| *size <= 0.0 || !size.is_finite()) {
            return None;
        }
        let normal = DMatrix::from_fn(count, count, |a, b| {
            dot(&columns[a], &columns[b]) / (sizes[a] * sizes[b])
        });
        let right = DVector::from_fn(count, |a, _| dot(&columns[a], signal) / sizes[a]);
        let factor = normal.cholesky()?;
        if factor.l_dirty().diagonal().iter().any(|own| own * own < LEAST_OWN) {
            return None;
        }
        let solved = factor.solve(&right);
        let coefficients: Vec<f64> = solved.iter().zip(&sizes).map(|(c, size)| c / size).collect();
        let fit = Self { coefficients, left: 0.0 };
        let residual = fit.residual(signal, columns);
        Some(Self { left: dot(&residual, &residual) / energy, ..fit })
    }

    /// Signal less what the columns make of it.
    pub(super) fn residual(&self, signal: &[f64], columns: &[Vec<f64>]) -> Vec<f64> {
        let made = |n: usize| -> f64 {
            self.coefficients.iter().zip(columns).map(|(c, column)| c * column[n]).sum()
        };
        signal.iter().enumerate().map(|(n, y)| y - made(n)).collect()
    }
}

/// Energy of a signal about its mean.
pub(super) fn spread(signal: &[f64]) -> f64 {
    let mean = signal.iter().sum::<f64>() / signal.len().max(1) as f64;
    signal.iter().map(|x| (x - mean) * (x - mean)).sum()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The place of a minimum: the best of a grid, refined by golden sections between its neighbours.
pub(super) fn least(
    from: f64,
    to: f64,
    steps: usize,
    finest: f64,
    mut cost: impl FnMut(f64) -> f64,
) -> (f64, f64) {
    let step = (to - from) / steps as f64;
    let mut best = (from, f64::INFINITY);
    for n in 0..=steps {
        let at = from + step * n as f64;
        let here = cost(at);
        if here < best.1 {
            best = (at, here);
        }
    }
    let (mut low, mut high) = (best.0 - step, best.0 + step);
    while high - low > finest {
        let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        let (cost_a, cost_b) = (cost(a), cost(b));
        for (at, here) in [(a, cost_a), (b, cost_b)] {
            if here < best.1 {
                best = (at, here);
            }
        }
        if cost_a < cost_b {
            high = b;
        } else {
            low = a;
        }
    }
    best
}

/// Golden section.
const GOLDEN: f64 = 0.618_033_988_749_895;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fit_gives_coefficients_and_what_is_left() {
        let columns = vec![(0..40).map(f64::from).collect::<Vec<_>>(), vec![1.0; 40]];
        let signal: Vec<f64> = (0..40).map(|n| 3.0 * f64::from(n) - 2.0).collect();
        let fit = Fit::new(&signal, &columns).unwrap();
        assert!(
            (fit.coefficients[0] - 3.0).abs() < 1e-9 && (fit.coefficients[1] + 2.0).abs() < 1e-8
        );
        assert!(fit.left < 1e-12);
        assert!(Fit::new(&signal, &[columns[0].clone(), columns[0].clone()]).is_none());
        assert!(Fit::new(&[1.0; 40], &columns).is_none());
    }

    #[test]
    fn a_minimum_is_found_between_the_steps_of_a_grid() {
        let (at, _) = least(-0.02, 0.02, 16, 1e-5, |x| (x - 0.0031) * (x - 0.0031));
        assert!((at - 0.0031).abs() < 1e-5);
    }
}
