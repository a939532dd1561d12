//! Answers for equally likely start angles, joined.

use crate::online::{outcome::Outcome, posterior::Posterior};

/// Joins the outcomes of equally likely start angles: what does not depend on the angle is
/// averaged by likelihood, its spread over the angles added; the rest is dropped.
pub(crate) fn mixture(sought: &[usize], mut outcomes: Vec<Outcome>) -> Option<Outcome> {
    let least = outcomes.iter().map(|outcome| outcome.cost).fold(f64::INFINITY, f64::min);
    let weights: Vec<f64> =
        outcomes.iter().map(|outcome| (-0.5 * (outcome.cost - least)).exp()).collect();
    let total: f64 = weights.iter().sum();
    let free: Vec<usize> =
        (0..sought.len()).filter(|&place| FREE_OF_ANGLE.contains(&sought[place])).collect();
    let mean: Vec<f64> = free
        .iter()
        .map(|&place| {
            let sum: f64 = outcomes
                .iter()
                .zip(&weights)
                .map(|(outcome, weight)| weight * outcome.posterior.estimate[place])
                .sum();
            sum / total
        })
        .collect();
    let covariance = nalgebra::DMatrix::from_fn(free.len(), free.len(), |i, j| {
        outcomes
            .iter()
            .zip(&weights)
            .map(|(outcome, weight)| {
                let posterior = &outcome.posterior;
                let away = |place: usize, k: usize| posterior.estimate[free[place]] - mean[k];
                weight * (posterior.covariance[(free[i], free[j])] + away(i, i) * away(j, j))
            })
            .sum::<f64>()
            / total
    });
    let best =
        (0..outcomes.len()).min_by(|&a, &b| outcomes[a].cost.total_cmp(&outcomes[b].cost))?;
    let mut best = outcomes.swap_remove(best);
    best.posterior = Posterior {
        indices: free.iter().map(|&place| sought[place]).collect(),
        estimate: mean,
        covariance,
        explained: None,
    };
    Some(best)
}

/// Coordinates that mean the same at any start angle: friction and backlash.
const FREE_OF_ANGLE: [usize; 2] = [0, 1];
