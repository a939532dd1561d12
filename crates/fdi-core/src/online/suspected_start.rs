//! Another start of the test, suspected from the residual of a diagnosis.
//!
//! Changes of the signal by a delay, another side of the play or a charged integrator are fitted to
//! the residual beside the faults, to first order and without a run of the low-fidelity model.
//!
//! # Source
//!
//! `docs/decisions/0067-another-start-of-the-test.md`.

use inference::dot;
use nalgebra::{DMatrix, DVector};

use crate::{
    online::{beginning::delay_in_words, error::DiagnoseError, likelihood::Likelihood, run::Run},
    report::{Notice, NoticeCode},
};

/// Standard deviations from zero at which another start is told.
const SUSPECT: f64 = 4.0;

impl Run<'_> {
    /// Notice where a delay, another side of the play or a charged integrator is found in
    /// what is left of the signal, to first order.
    pub(crate) fn suspected_start(
        &self,
        likelihood: &Likelihood,
        slopes: &[Vec<f64>],
        residual_a: &[f64],
    ) -> Result<Vec<Notice>, DiagnoseError> {
        let effects = self.learnt.start_effects()?;
        let rate_hz = self.experiment().filter.output_hz;
        let delay = delay_effect(&self.observation.signal_a, residual_a, rate_hz);
        let order = slopes.len();
        let columns: Vec<&Vec<f64>> = slopes.iter().chain([&delay]).chain(effects.iter()).collect();
        let left = residual_a.to_vec();
        let whole = columns.iter().copied().chain([&left]);
        let white = likelihood.whiten_each(whole);
        let mut strongest: Option<(usize, f64)> = None;
        for extra in order..columns.len() {
            let Some((value, std)) = apart(&white[..order], &white[extra], &white[columns.len()])
            else {
                continue;
            };
            let distance = (value / std).abs();
            if distance > SUSPECT && strongest.is_none_or(|(_, most)| distance > most) {
                strongest = Some((extra, distance));
            }
        }
        let Some((extra, _)) = strongest else { return Ok(Vec::new()) };
        let mut joint = slopes.to_vec();
        joint.push(columns[extra].clone());
        let joint = likelihood.slopes(joint);
        let (Some(covariance), Some(step)) =
            (likelihood.estimate_covariance(&joint), joint.step(&white[columns.len()]))
        else {
            return Ok(Vec::new());
        };
        let distance = step[order].abs() / covariance[(order, order)].sqrt();
        if distance <= SUSPECT {
            return Ok(Vec::new());
        }
        let moved = step.rows(0, order).amax();
        Ok(vec![suspicion(extra - order, step[order], distance, moved)])
    }
}

/// Change of the signal at an answer by a unit of delay, 1 s: differences over a sample to
/// either side, which half of the filter's corner loses a seventh of.
fn delay_effect(signal_a: &[f64], residual_a: &[f64], rate_hz: f64) -> Vec<f64> {
    let modelled: Vec<f64> = signal_a.iter().zip(residual_a).map(|(y, r)| y - r).collect();
    let last = modelled.len().saturating_sub(1);
    let rise = |n: usize| modelled[(n + 1).min(last)] - modelled[n.saturating_sub(1)];
    (0..=last).map(|n| -0.5 * rate_hz * rise(n)).collect()
}

/// Coefficient of one white column beside others in a white residual, and its standard deviation;
/// `None` where the others leave nothing of it.
fn apart(others: &[Vec<f64>], column: &[f64], left: &[f64]) -> Option<(f64, f64)> {
    let order = others.len();
    let gram = DMatrix::from_fn(order, order, |i, j| dot(&others[i], &others[j]));
    let project = |vector: &[f64]| {
        DVector::from_iterator(order, others.iter().map(|other| dot(other, vector)))
    };
    let cholesky = gram.cholesky()?;
    let shared = project(column);
    let weights = cholesky.solve(&shared);
    let information = dot(column, column) - weights.dot(&shared);
    let gradient = dot(column, left) - weights.dot(&project(left));
    (information > 0.0).then(|| (gradient / information, information.sqrt().recip()))
}

/// Notice of a start that is suspected: of a delay, of the side, of the integrator.
fn suspicion(which: usize, value: f64, distance: f64, moved: f64) -> Notice {
    let (what, option) = match which {
        0 => (format!("{} ms", delay_in_words(value)), "--max-delay-s"),
        1 => ("the surface began elsewhere in its play".to_owned(), "--free-start"),
        _ => (format!("the integrator began at {value:.2} A"), "--free-start"),
    };
    let message = format!(
        "the recording is explained better ({distance:.0} standard deviations) if {what}: levels \
         would change by up to {moved:.4}; `{option}` estimates it with the faults"
    );
    Notice { code: NoticeCode::StartSuspected, message }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn what_is_apart_of_a_column_is_found() {
        let others = [vec![1.0, 0.0, 0.0, 0.0], vec![0.0, 1.0, 0.0, 0.0]];
        let column = [5.0, -7.0, 2.0, 0.0];
        let left = [1.0, 1.0, 3.0, 9.0];
        let (value, std) = apart(&others, &column, &left).unwrap();
        assert_abs_diff_eq!(value, 1.5, epsilon = 1e-12);
        assert_abs_diff_eq!(std, 0.5, epsilon = 1e-12);
        assert!(apart(&others, &[1.0, 2.0, 0.0, 0.0], &left).is_none());
    }
}
