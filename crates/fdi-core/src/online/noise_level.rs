//! The noise level on the phases: told, measured, or the one that makes a residual most likely.

use crate::{
    online::{
        cache::ErrorId,
        error::DiagnoseError,
        grid_factor::NoiseShares,
        noise_grid::LevelKey,
        plan::Search,
        run::{Hypothesis, Run},
    },
    report::NoiseSource,
};

/// Natural logarithm of the factor by which a noise level may differ from the bundle's, one
/// standard deviation.
const NOISE_PRIOR_LN_STD: f64 = core::f64::consts::LN_2;
/// Most steps of a search for the level; four are usual.
const MOST_SCORINGS: usize = 20;
/// Largest and smallest step of `ln σ`.
const MOST_LN_STEP: f64 = 1.0;
const LEAST_LN_STEP: f64 = 1e-3;
/// Largest distance of `ln σ` from the prior's.
const MOST_LN_RATIO: f64 = 3.0;

/// A noise level with where it is from.
#[derive(Clone, Copy)]
pub(crate) struct Noise {
    pub(crate) level_a: f64,
    pub(crate) source: NoiseSource,
}

impl Run<'_> {
    /// The noise level: told by the user or the metadata, read off the recording, or else what
    /// makes the residual most likely, with the bundle's level as a prior.
    pub(crate) fn noise(&self, hypothesis: &Hypothesis) -> Result<(Noise, u64), DiagnoseError> {
        if let Some(noise) = self.told_noise(self.observation.measured_noise_a) {
            return Ok((noise, 0));
        }
        let prior_a = self.learnt.bundle.noise_a;
        let rate_hz = self.observation.phase_rate_hz;
        let (error_id, residual_a, evaluations) = if let Search::Emulator = self.plan.search {
            let level = self.learnt.level(prior_a);
            let emulator = self.learnt.emulator(rate_hz, level)?;
            let found = emulator.nearest(&self.observation.signal_a, level.excess_a2());
            let point = found.ok_or(DiagnoseError::Undetermined)?;
            (ErrorId::Signal, self.less(emulator.signal_a(&point)), 0)
        } else {
            let likelihood = self.likelihood(hypothesis, prior_a)?;
            let fit = self.incipient_fit(hypothesis, &likelihood, prior_a)?;
            (hypothesis.error_id, fit.residual_a, fit.evaluations)
        };
        let level_a = self.level_of(error_id, &residual_a)?;
        Ok((Noise { level_a, source: NoiseSource::Residual }, evaluations))
    }

    /// The noise level that makes a residual most likely, with the bundle's level as a prior, A.
    ///
    /// Fisher's scoring in `u = ln σ`, with `F = −2·ln L + (u − u_p)²/s_p²`:
    ///
    /// ```text
    /// dF/du = 2·σ²·(tr K − zᵀ·K·z + δ·(2·zᵀ·K²·z − tr K²)) + 2·(u − u_p)/s_p²
    /// E d²F/du² = 4·σ⁴·tr K² + 2/s_p²
    /// ```
    ///
    /// with `z`, `K` and `δ` those of the nearest level of the noise grid (`grid_factor`).
    fn level_of(&self, error_id: ErrorId, residual_a: &[f64]) -> Result<f64, DiagnoseError> {
        let prior_a = self.learnt.bundle.noise_a;
        let precision = 2.0 / (NOISE_PRIOR_LN_STD * NOISE_PRIOR_LN_STD);
        let mut known: Option<(LevelKey, NoiseShares, NoiseShares)> = None;
        let mut ln_ratio: f64 = 0.0;
        for _ in 0..MOST_SCORINGS {
            let level_a = prior_a * ln_ratio.exp();
            let at = self.learnt.level(level_a);
            let (found, expected) = match known {
                Some((key, found, expected)) if key == at.key() => (found, expected),
                _ => {
                    let rate_hz = self.observation.phase_rate_hz;
                    let likelihood = self.learnt.likelihood(error_id, rate_hz, level_a)?;
                    let whole = likelihood.grid().whole();
                    (whole.shares(residual_a), whole.expected_shares())
                }
            };
            known = Some((at.key(), found, expected));
            let variance_a2 = level_a * level_a;
            let bend = at.excess_a2() * (2.0 * found.second - expected.second);
            let slope =
                2.0 * variance_a2 * (expected.first - found.first + bend) + precision * ln_ratio;
            let curvature = 4.0 * variance_a2 * variance_a2 * expected.second + precision;
            let step = (-slope / curvature).clamp(-MOST_LN_STEP, MOST_LN_STEP);
            ln_ratio = (ln_ratio + step).clamp(-MOST_LN_RATIO, MOST_LN_RATIO);
            if step.abs() < LEAST_LN_STEP {
                break;
            }
        }
        Ok(prior_a * ln_ratio.exp())
    }

    /// The noise level that is known without a fit: of the option, else of the metadata, else read
    /// off the recording. What filling and resampling samples have missed is added.
    pub(crate) fn told_noise(&self, measured_a: Option<f64>) -> Option<Noise> {
        let told = [
            (self.plan.noise_a, NoiseSource::Flag),
            (self.observation.stated_noise_a, NoiseSource::Metadata),
            (measured_a, NoiseSource::OutOfBand),
        ];
        let missed_a = self.observation.resampling_error_a;
        let with_missed = |(level, source): (Option<f64>, NoiseSource)| {
            Some(Noise { level_a: level?.hypot(missed_a), source })
        };
        told.into_iter().find_map(with_missed)
    }

    /// The noise level of least cost, `-2·ln` of the likelihood, with the bundle's level as a prior,
    /// A.
    pub(crate) fn likeliest_level<E>(
        &self,
        mut cost: impl FnMut(f64) -> Result<f64, E>,
    ) -> Result<f64, E> {
        let prior_a = self.learnt.bundle.noise_a;
        let with_prior = |ln_ratio: f64| -> Result<f64, E> {
            let prior = ln_ratio / NOISE_PRIOR_LN_STD;
            Ok(cost(prior_a * ln_ratio.exp())? + prior * prior)
        };
        Ok(prior_a * least(with_prior, -3.0, 3.0)?.exp())
    }
}

/// Least point of a function with one valley, by golden section to a thousandth.
fn least<E>(mut cost: impl FnMut(f64) -> Result<f64, E>, low: f64, high: f64) -> Result<f64, E> {
    const GOLDEN: f64 = 0.618_033_988_749_894_8;
    let (mut low, mut high) = (low, high);
    let (mut a, mut b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
    let (mut cost_a, mut cost_b) = (cost(a)?, cost(b)?);
    while high - low > 1e-2 {
        if cost_a < cost_b {
            (high, b, cost_b) = (b, a, cost_a);
            a = high - GOLDEN * (high - low);
            cost_a = cost(a)?;
        } else {
            (low, a, cost_a) = (a, b, cost_b);
            b = low + GOLDEN * (high - low);
            cost_b = cost(b)?;
        }
    }
    Ok(0.5 * (low + high))
}
