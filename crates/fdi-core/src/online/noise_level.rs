//! The noise level on the phases: told, measured, or the one that makes a residual most likely.

use inference::NotPositiveDefinite;

use crate::{
    online::{
        error::DiagnoseError,
        likelihood::Likelihood,
        plan::Search,
        run::{Hypothesis, Run},
    },
    report::NoiseSource,
};

/// Natural logarithm of the factor by which a noise level may differ from the bundle's, one
/// standard deviation.
const NOISE_PRIOR_LN_STD: f64 = core::f64::consts::LN_2;

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
        let unit = self.learnt.unit_noise(rate_hz);
        let prepared = match self.plan.search {
            Search::Emulator => Some(self.learnt.emulator(rate_hz, prior_a)?),
            _ => None,
        };
        let (error, residual_a, evaluations) = if let Some(emulator) = &prepared {
            let found = emulator.diagnose(&self.observation.signal_a);
            let point = found.ok_or(DiagnoseError::Undetermined)?.estimate;
            (emulator.model(), self.less(emulator.signal_a(&point)), 0)
        } else {
            let likelihood = self.likelihood(hypothesis, prior_a)?;
            let fit = self.incipient_fit(hypothesis, &likelihood, prior_a)?;
            (&*hypothesis.error, fit.residual_a, fit.evaluations)
        };
        let level_a = self.likeliest_level(|level_a| {
            let whole_a = self.learnt.with_reference_noise(level_a);
            let factor = Likelihood::plain(error, &unit, whole_a, self.encoder())?;
            let white = factor.whiten(&residual_a);
            Ok::<_, NotPositiveDefinite>(
                white.iter().map(|z| z * z).sum::<f64>() + factor.log_determinant(),
            )
        })?;
        Ok((Noise { level_a, source: NoiseSource::Residual }, evaluations))
    }

    /// The noise level that is known without a fit: of the option, else of the metadata, else read
    /// off the recording.
    pub(crate) fn told_noise(&self, measured_a: Option<f64>) -> Option<Noise> {
        let told = [
            (self.plan.noise_a, NoiseSource::Flag),
            (self.observation.stated_noise_a, NoiseSource::Metadata),
            (measured_a, NoiseSource::OutOfBand),
        ];
        told.into_iter().find_map(|(level, source)| Some(Noise { level_a: level?, source }))
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
