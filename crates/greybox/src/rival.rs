//! An explanation among others: fitted to the recordings for it, judged on those that are not.

use ema_sim::{Effect, EffectId};

use crate::{
    elsewhere::elsewhere,
    error::GreyboxError,
    fit::{Fitted, fit, fit_near, sandwich, whitened},
    hypothesis::{Family, differs_by_record, numbers},
    noise::{Whitener, rms},
    problem::{PerRecord, Problem},
    scan::{Scored, Tried, log_tail},
    structure::{Number, Structure, set},
};

/// Length of the blocks whose likelihoods are compared, s.
const BLOCK_S: f64 = 0.5;

/// A block's gain counts as no more than so many times that of the median block.
const MOST_MEDIANS: f64 = 3.0;

/// Standard errors below what is expected of a rival that what cannot speak may show by chance.
const MUTE_STD_ERRORS: f64 = 2.0;

/// Standard errors from zero of a size that is there.
const SIZED_STD_ERRORS: f64 = 1.96;

/// A fitted structure with its noise and its record on what was not fitted.
#[derive(Clone, Debug)]
pub(crate) struct Judged {
    pub(crate) fitted: Fitted,
    /// The noise with the size of its own residual: each rival is judged with its own size, and
    /// none may take what is slow for noise.
    own: Whitener,
    /// Residual of the recordings held out, through the noise with which it was fitted.
    held_out: Vec<f64>,
    /// Log-likelihood of each block of the recordings held out.
    blocks: Vec<f64>,
    /// Log-likelihood of what was fitted.
    train: f64,
    /// Root mean square of the residual held out.
    pub(crate) holdout_rms: f64,
}

impl Judged {
    pub(crate) fn new(
        fitted: Fitted,
        (train, holdout): (&Problem<'_>, &Problem<'_>),
        noise: &Whitener,
    ) -> Result<Self, GreyboxError> {
        let own = noise.scaled(rms(&whitened(noise, &fitted.residuals)));
        let residuals = elsewhere(holdout, &fitted.structure, &fitted.values, &own)?;
        let likelihoods = |problem: &Problem<'_>, residuals: &PerRecord| -> Vec<f64> {
            // of the size that it has there: what was not fitted may be missed by more
            let there = noise.scaled(rms(&whitened(noise, residuals)));
            let of = |(prepared, residual): (&crate::problem::Prepared<'_>, &Vec<f64>)| {
                let block = libm::round(BLOCK_S * prepared.rate_hz()) as usize;
                there.log_likelihoods(residual, block)
            };
            problem.records.iter().zip(residuals).flat_map(of).collect()
        };
        let mut blocks = likelihoods(holdout, &residuals);
        // numbers fitted to the recordings held out are paid for
        let fitted_there = 2 * fitted.structure.by_record(&fitted.values).len();
        let price = 0.5 * fitted_there as f64 * holdout.records.len() as f64;
        if let Some(first) = blocks.first_mut() {
            *first -= price * libm::log(holdout.samples().max(1) as f64);
        }
        let train = likelihoods(train, &fitted.residuals).iter().sum();
        let holdout_rms = rms(&residuals.concat());
        let held_out = whitened(noise, &residuals);
        Ok(Self { fitted, own, held_out, blocks, train, holdout_rms })
    }

    /// Gain in log-likelihood over another on what neither was fitted to, and its standard
    /// error from the scatter of the blocks (Vuong 1989, Diebold and Mariano 1995).
    pub(crate) fn gain_over(&self, other: &Self) -> (f64, f64) {
        let mut gains: Vec<f64> =
            self.blocks.iter().zip(&other.blocks).map(|(a, b)| a - b).collect();
        // a few blocks where the effect shows most do not make the others' gain less sure
        let mut sorted = gains.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
        if median > 0.0 {
            for gain in &mut gains {
                *gain = gain.min(MOST_MEDIANS * median);
            }
        }
        let n = gains.len().max(1) as f64;
        let mean = gains.iter().sum::<f64>() / n;
        let variance =
            gains.iter().map(|g| (g - mean) * (g - mean)).sum::<f64>() / (n - 1.0).max(1.0);
        (mean * n, libm::sqrt(variance * n))
    }

    /// Energy of the difference between the two predictions of what was not fitted, in units of
    /// the noise: the gain is expected to be half of it, with its root for a standard error.
    pub(crate) fn energy_apart(&self, other: &Self) -> f64 {
        let apart = self.held_out.iter().zip(&other.held_out).map(|(a, b)| (a - b) * (a - b));
        apart.sum()
    }

    /// Whether what was not fitted speaks for this and against another by so many standard
    /// errors; or, where it `may_be_mute` and the two differ there by too little to be told apart
    /// so, whether the gain is what is expected of it.
    pub(crate) fn is_confirmed(&self, other: &Self, wanted: f64, may_be_mute: bool) -> bool {
        let (gain, std) = self.gain_over(other);
        let energy = self.energy_apart(other);
        let is_mute = energy < 4.0 * wanted * wanted;
        let least = 0.5 * energy - MUTE_STD_ERRORS * libm::sqrt(energy);
        gain > wanted * std || (may_be_mute && is_mute && gain > least)
    }

    /// Gain in evidence over another: log-likelihood of what was fitted less half a logarithm of
    /// the number of samples for each number more (Bayesian information criterion).
    pub(crate) fn evidence_over(&self, other: &Self, samples: usize) -> f64 {
        let numbers = self.fitted.values.len() as f64 - other.fitted.values.len() as f64;
        self.train - other.train - 0.5 * numbers * libm::log(samples as f64)
    }

    pub(crate) fn own_noise(&self) -> &Whitener {
        &self.own
    }
}

/// One more effect, fitted and judged.
#[derive(Clone, Debug)]
pub(crate) struct Rival {
    pub(crate) id: EffectId,
    pub(crate) family: usize,
    pub(crate) judged: Judged,
    /// Fall of the objective against the structure without it, nats.
    pub(crate) fall: f64,
    /// Logarithm of the chance of that fall, for all questions of the catalogue together.
    pub(crate) log_p: f64,
    pub(crate) gain: f64,
    pub(crate) gain_std: f64,
    /// Of the predictions with and without it of what was not fitted.
    pub(crate) energy_apart: f64,
    pub(crate) evidence: f64,
    /// Whether a number of the effect stands on a bound.
    pub(crate) on_bound: bool,
    asked: Asked,
}

/// What a rival has to pay for.
#[derive(Clone, Copy, Debug)]
struct Asked {
    /// Sizes of the effect, and its sizes and shapes together.
    sizes: usize,
    numbers: usize,
    /// Shapes among which those tried were chosen.
    looked_at: f64,
    /// Questions of the catalogue.
    questions: f64,
}

impl Rival {
    /// What speaks for it, in nats: held out and fitted together.
    pub(crate) fn score(&self) -> f64 {
        self.gain + self.evidence
    }

    /// How it did, in words.
    pub(crate) fn line(&self, families: &[Family]) -> String {
        format!(
            "  rival {} {:?}: fall {:.1}, log p {:.1}, gain {:.1} ± {:.1} of {:.1}, evidence {:.1}, \
             bound {}, rms {:.5}",
            self.id.info().symbol,
            families[self.family].sizes,
            self.fall,
            self.log_p,
            self.gain,
            self.gain_std,
            0.5 * self.energy_apart,
            self.evidence,
            self.on_bound,
            self.judged.holdout_rms
        )
    }

    /// Whether one of its sizes is off zero by more than it is uncertain; of a settled one.
    pub(crate) fn is_off_zero(&self, train: &Problem<'_>, whitener: &Whitener) -> bool {
        let fitted = &self.judged.fitted;
        let covariance = sandwich(fitted, train, whitener);
        let places = fitted.structure.places_of_effect(fitted.structure.effects.len() - 1);
        let is_off = |&p: &usize| {
            fitted.values[p].abs() > SIZED_STD_ERRORS * libm::sqrt(covariance[(p, p)].max(0.0))
        };
        places.iter().take(self.asked.sizes).any(is_off)
    }

    /// The same with its fit ended by sensitivities taken anew.
    pub(crate) fn settled(
        self,
        current: &Judged,
        (train, holdout): (&Problem<'_>, &Problem<'_>),
        whitener: &Whitener,
    ) -> Result<Self, GreyboxError> {
        let Fitted { structure, values, .. } = self.judged.fitted;
        let judged = Judged::new(
            fit(train, structure.started_at(&values), whitener)?,
            (train, holdout),
            whitener,
        )?;
        Ok(Self::of((self.id, self.family), judged, current, train.samples(), self.asked))
    }

    /// Fits a scored effect on top of a fitted structure, from its shape and size in the scan.
    pub(crate) fn new(
        (scored, tried, family): (&Scored, &Tried, &Family),
        current: &Judged,
        (train, holdout): (&Problem<'_>, &Problem<'_>),
        whitener: &Whitener,
        (travel, questions): (f64, f64),
        bar: f64,
    ) -> Result<Self, GreyboxError> {
        let shapes = family.free_shapes();
        let start_at = || -> Effect {
            let mut effect = tried.plain.clone();
            if differs_by_record(effect.id()) {
                return effect;
            }
            for ((place, size), found) in tried.sizes.iter().zip(&scored.sizes) {
                let (least, _) = effect.id().info().parameters[*place].bounds();
                let found = if *found <= least { *size } else { *found };
                set(&mut effect, *place, found);
            }
            effect
        };
        let numbered = |effect: &Effect, scale: f64| -> Vec<Number> {
            let mut numbers = numbers(effect, &tried.sizes, &shapes, travel);
            if differs_by_record(effect.id()) {
                let records = train.records.len();
                let sizes = numbers.iter_mut().zip(&scored.sizes).enumerate();
                for (n, (number, found)) in sizes {
                    number.in_record = Some((n % records, scale * found));
                }
            }
            numbers
        };
        let nominal = &current.fitted.structure;
        let near = nominal.clone().started_at(&current.fitted.values);
        let at_size = |scale: f64| -> Effect {
            let mut effect = tried.plain.clone();
            if differs_by_record(effect.id()) {
                return effect;
            }
            for (place, size) in &tried.sizes {
                set(&mut effect, *place, scale * size);
            }
            effect
        };
        let mut trials: Vec<(&Structure, Effect)> = vec![(&near, start_at())];
        if current.fitted.objective > POOR_PER_SAMPLE * train.samples() as f64 {
            // damage and tolerances have been bent to fit what they cannot: start without them
            trials.extend(SIZES.map(|scale| (nominal, at_size(scale))));
        }
        let known = &current.fitted.sensitivities;
        let mut best: Option<Fitted> = None;
        for (base, effect) in trials {
            let numbers = numbered(&effect, 1.0);
            if best.as_ref().is_some_and(|b| b.objective < GOOD_PER_SAMPLE * train.samples() as f64)
            {
                break;
            }
            let structure = base.with_effect(effect, &numbers);
            let fitted = fit_near(train, structure, whitener, known, bar)?;
            if best.as_ref().is_none_or(|b| fitted.objective < b.objective) {
                best = Some(fitted);
            }
        }
        if best.as_ref().is_none_or(|b| b.objective > current.fitted.objective) {
            // from too far off: once more from nearly nothing
            let effect = at_size(1.0);
            let numbers = numbered(&effect, 0.1);
            let structure = near.with_effect(effect, &numbers);
            best = Some(fit_near(train, structure, whitener, known, bar)?);
        }
        let Some(fitted) = best else { return Err(GreyboxError::NoTraining) };
        let asked = Asked {
            sizes: tried.sizes.len(),
            numbers: tried.sizes.len() + shapes.len(),
            looked_at: family.screened(),
            questions,
        };
        let judged = Judged::new(fitted, (train, holdout), whitener)?;
        Ok(Self::of((tried.plain.id(), scored.family), judged, current, train.samples(), asked))
    }

    /// A fit judged against the structure without the effect, which is its last.
    fn of(
        (id, family): (EffectId, usize),
        judged: Judged,
        current: &Judged,
        samples: usize,
        asked: Asked,
    ) -> Self {
        let fitted = &judged.fitted;
        let fall = current.fitted.objective - fitted.objective;
        let chance = log_tail(2.0 * fall, asked.numbers);
        let places = fitted.structure.places_of_effect(fitted.structure.effects.len() - 1);
        let bound = |&p: &usize| {
            let free = &fitted.structure.free[p];
            let near = 1e-3 * (free.most - free.least).min(fitted.values[p].abs().max(free.step));
            fitted.values[p] - free.least <= near || free.most - fitted.values[p] <= near
        };
        let on_bound = places.iter().take(asked.sizes).any(bound);
        let (gain, gain_std) = judged.gain_over(current);
        let looked = libm::log(asked.looked_at);
        Self {
            id,
            family,
            fall,
            log_p: (chance + looked + libm::log(asked.questions)).min(0.0),
            gain,
            gain_std,
            energy_apart: judged.energy_apart(current),
            evidence: judged.evidence_over(current, samples) - looked,
            on_bound,
            asked,
            judged,
        }
    }
}

/// Half the mean square of the whitened residual from which a fit is poor.
const POOR_PER_SAMPLE: f64 = 5.0;
/// The same at which no other start is worth trying: noise alone leaves a half.
pub(crate) const GOOD_PER_SAMPLE: f64 = 0.75;
/// Multiples of the size tried from which a fit starts where the model without it is poor.
const SIZES: [f64; 2] = [3.0, 30.0];
