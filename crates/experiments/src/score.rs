//! Scores: eq. 20 of the FREEDOM paper and its statistics.

use fdi_core::{
    SignalDiagnosis,
    ema_sim::{FAULT_COUNT, FaultCoordinates},
    report::{FaultEvaluation, FaultId, Quartiles},
};

/// One search, ended.
#[derive(Clone, Debug)]
pub(crate) struct Trial {
    /// `k1..k7` that were there.
    pub(crate) truth: [f64; FAULT_COUNT],
    /// `k1..k7` that were found.
    pub(crate) found: [f64; FAULT_COUNT],
    /// `δ*`, eq. 21: norm of the residual on the mask, A.
    pub(crate) discrepancy: f64,
    pub(crate) evaluations: u64,
    pub(crate) wall_time_s: f64,
}

impl Trial {
    /// A diagnosis of a condition, its time not taken.
    pub(crate) fn of(truth: [f64; FAULT_COUNT], found: &SignalDiagnosis) -> Self {
        Self {
            truth,
            found: levels_of(&found.indices, &found.estimate),
            discrepancy: found.answer.discrepancy,
            evaluations: found.answer.evaluations,
            wall_time_s: 0.0,
        }
    }
}

/// Says if the 95 % interval of a fault's level holds the truth; nothing said holds nothing.
pub(crate) fn interval_holds(
    found: &SignalDiagnosis,
    truth: &[f64; FAULT_COUNT],
    fault: usize,
) -> bool {
    let interval = found.answer.faults[fault].interval_95;
    interval.is_some_and(|[low, high]| (low..=high).contains(&truth[fault]))
}

/// The levels of an estimate that is free of bounds, cut to those that exist.
pub(crate) fn levels_of(sought: &[usize], estimate: &[f64]) -> [f64; FAULT_COUNT] {
    let mut all = FaultCoordinates([0.0; FAULT_COUNT]);
    for (&index, &value) in sought.iter().zip(estimate) {
        all.0[index] = if index < 5 { value.clamp(0.0, 1.0) } else { value };
    }
    let radius = all.0[5].hypot(all.0[6]);
    if radius > 1.0 {
        all.0[5] /= radius;
        all.0[6] /= radius;
    }
    all.levels()
}

/// `|k − k̃|`, on the circle for `k7`.
pub(crate) fn absolute_error(fault: usize, truth: f64, found: f64) -> f64 {
    let error = (found - truth).abs();
    if fault == FAULT_COUNT - 1 { error.min(1.0 - error) } else { error }
}

/// Percentage error of each fault looked for, eq. 20.
pub(crate) fn errors_percent(sought: &[usize], truth: &[f64], found: &[f64]) -> Vec<f64> {
    let percent =
        |&fault: &usize| 100.0 * absolute_error(fault, truth[fault], found[fault]) / truth[fault];
    sought.iter().map(percent).collect()
}

/// Errors of the faults looked for, over trials.
pub(crate) fn fault_scores(sought: &[usize], trials: &[Trial]) -> Vec<FaultEvaluation> {
    sought
        .iter()
        .map(|&fault| {
            let errors =
                trials.iter().map(|t| absolute_error(fault, t.truth[fault], t.found[fault]));
            let absolute: Vec<f64> = errors.collect();
            let percent =
                absolute.iter().zip(trials).map(|(e, t)| 100.0 * e / t.truth[fault]).collect();
            FaultEvaluation {
                error_percent: Some(quartiles(percent)),
                error_abs: Some(quartiles(absolute)),
                ..FaultEvaluation::of(FaultId::ALL[fault])
            }
        })
        .collect()
}

/// Quartiles and maximum.
pub(crate) fn quartiles(mut values: Vec<f64>) -> Quartiles {
    values.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| quantile(&values, share);
    Quartiles { median: at(0.5), p25: at(0.25), p75: at(0.75), max: at(1.0) }
}

/// The median; 0 of nothing.
pub(crate) fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    quartiles(values.into_iter().collect()).median
}

/// A quantile of sorted values, straight between them.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return 0.0 };
    let place = share * last as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(last);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn quartiles_of_five() {
        let q = quartiles(vec![5.0, 1.0, 3.0, 2.0, 4.0]);
        assert_eq!([q.p25, q.median, q.p75, q.max], [2.0, 3.0, 4.0, 5.0]);
    }

    #[test]
    fn direction_errors_go_round_the_circle() {
        assert_abs_diff_eq!(absolute_error(6, 0.98, 0.03), 0.05, epsilon = 1e-12);
        assert_abs_diff_eq!(absolute_error(5, 0.98, 0.03), 0.95, epsilon = 1e-12);
    }

    #[test]
    fn levels_cut_what_cannot_be() {
        let levels = levels_of(&[0, 5, 6], &[-0.01, 0.03, 0.04]);
        assert_eq!(levels[0], 0.0);
        assert_abs_diff_eq!(levels[5], 0.05, epsilon = 1e-12);
    }
}
