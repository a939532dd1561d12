//! An explanation among others: fitted to the recordings for it, judged on those that are not.

use ema_sim::{Effect, EffectId};
use inference::{Whitener, chi_squared_log_tail, rms};
use nalgebra::DMatrix;

use crate::{
    error::GreyboxError,
    fit::{Fitted, fit, fit_near, sandwich, whitened},
    gain::{Block, Gain, block_length, in_blocks},
    hypothesis::{Family, differs_by_record, numbers},
    known::HeldOut,
    plausible::Plausible,
    problem::{PerRecord, Prepared, Problem, Split},
    scan::Scored,
    structure::{Number, Structure, set},
    trial::Tried,
};

/// A fitted structure with its noise and its record on what was not fitted.
#[derive(Clone, Debug)]
pub(crate) struct Judged {
    pub(crate) fitted: Fitted,
    /// The noise with the size of its own residual: each rival is judged with its own size, and
    /// none may take what is slow for noise.
    own: Whitener,
    pub(crate) held_out: HeldOut,
    /// Recordings held out in blocks.
    blocks: Vec<Block>,
    /// Log-likelihood of what was fitted.
    train: f64,
    /// Least standard deviations of the numbers; none where slopes tell them.
    least_stds: Vec<f64>,
}

impl Judged {
    pub(crate) fn new(
        fitted: Fitted,
        split: Split<'_>,
        noise: &Whitener,
    ) -> Result<Self, GreyboxError> {
        let Split { train, holdout } = split;
        let own = noise.scaled(rms(&whitened(noise, &fitted.residuals)));
        let held_out = HeldOut::new(holdout, &fitted, &own, noise)?;
        let size = held_out.size;
        // of the size that it has there: what was not fitted may be missed by more
        let there = noise.scaled(size);
        let white = in_blocks(holdout, &held_out.residuals, noise);
        // numbers fitted to the recordings held out explain noise by a half each, and as much less
        // of what they were not fitted to
        let fitted_there =
            2 * fitted.structure.by_record(&fitted.values).len() * holdout.records.len();
        let price = (fitted_there as f64 + held_out.price_nats) / white.len().max(1) as f64;
        let block = |(white, likelihood)| Block { white, log_likelihood: likelihood - price, size };
        let there = likelihoods(holdout, &held_out.residuals, &there);
        let blocks = white.into_iter().zip(there).map(block).collect();
        let train = likelihoods(train, &fitted.residuals, &own).iter().sum();
        Ok(Self { fitted, own, held_out, blocks, train, least_stds: Vec::new() })
    }

    /// Gain in log-likelihood over another on what neither was fitted to.
    pub(crate) fn gain_over(&self, other: &Self) -> Gain {
        Gain::over(&self.blocks, &other.blocks)
    }

    /// Tells whether it has numbers that the other has not and that are fitted to what is held out:
    /// a gain
    /// there is then half of the difference, whatever is right.
    pub(crate) fn fits_more_there(&self, other: &Self) -> bool {
        let count = |judged: &Self| judged.fitted.structure.by_record(&judged.fitted.values).len();
        count(self) > count(other)
    }

    /// Gain in log-likelihood over another on what both were fitted to.
    pub(crate) fn fit_over(&self, other: &Self) -> f64 {
        self.train - other.train
    }

    /// Gain in evidence over another: log-likelihood of what was fitted less half a logarithm of
    /// the number of samples for each number more (Bayesian information criterion).
    pub(crate) fn evidence_over(&self, other: &Self, samples: usize) -> f64 {
        let numbers = self.numbers() as f64 - other.numbers() as f64;
        self.fit_over(other) - 0.5 * numbers * libm::log(samples as f64)
    }

    /// The fit with standard deviations of its numbers that are no smaller than these.
    pub(crate) fn with_least_stds(self, least_stds: Vec<f64>) -> Self {
        Self { least_stds, ..self }
    }

    /// Covariance of the fitted numbers by their scatter ([`sandwich`]), and no smaller than what
    /// is held out leaves of it, and than fits without damage do.
    pub(crate) fn covariance(&self, train: &Problem<'_>, noise: &Whitener) -> DMatrix<f64> {
        self.no_surer(sandwich(&self.fitted, train, noise))
    }

    /// A covariance by their scatter, made no smaller than what is held out leaves of it, and than fits
    /// without damage do.
    pub(crate) fn no_surer(&self, mut covariance: DMatrix<f64>) -> DMatrix<f64> {
        let held_out = self.fitted.structure.same_everywhere().into_iter();
        let held_out = held_out.zip(self.held_out.stds.iter().copied());
        let least_stds = self.least_stds.iter().copied().enumerate();
        for (place, least) in held_out.chain(least_stds) {
            let std = libm::sqrt(covariance[(place, place)].max(0.0));
            if std > 0.0 && least > std {
                covariance.row_mut(place).scale_mut(least / std);
                covariance.column_mut(place).scale_mut(least / std);
            } else if std == 0.0 {
                covariance[(place, place)] = least * least;
            }
        }
        covariance
    }

    /// How many numbers were fitted.
    pub(crate) fn numbers(&self) -> usize {
        self.fitted.values.len()
    }

    pub(crate) fn own_noise(&self) -> &Whitener {
        &self.own
    }
}

/// Log-likelihood of residuals, by blocks of each recording.
fn likelihoods(problem: &Problem<'_>, residuals: &PerRecord, noise: &Whitener) -> Vec<f64> {
    let of = |(prepared, residual): (&Prepared<'_>, &Vec<f64>)| {
        noise.log_likelihoods(residual, block_length(prepared))
    };
    problem.records.iter().zip(residuals).flat_map(of).collect()
}

/// An effect that a scan proposes for a fit.
#[derive(Clone, Copy)]
pub(crate) struct Shortlisted<'a> {
    pub(crate) scored: &'a Scored,
    pub(crate) tried: &'a Tried,
    pub(crate) family: &'a Family,
    /// Bounds of its sizes.
    pub(crate) plausible: Plausible,
    /// Questions of the catalogue.
    pub(crate) questions: f64,
}

impl Shortlisted<'_> {
    pub(crate) fn asked(&self) -> Asked {
        let sizes = self.tried.sizes.len();
        Asked {
            sizes,
            numbers: sizes + self.family.free_shapes().len(),
            looked_at: self.family.screened(),
            questions: self.questions,
        }
    }
}

/// One more effect, fitted and judged.
#[derive(Clone, Debug)]
pub(crate) struct Rival {
    pub(crate) id: EffectId,
    pub(crate) family: usize,
    pub(crate) judged: Judged,
    pub(crate) claim: Claim,
    asked: Asked,
}

/// How an explanation with one effect more did beside the one without it: what the gates go by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Claim {
    /// Fall of the objective against the structure without it, nats.
    pub(crate) fall: f64,
    /// Logarithm of the chance of that fall times the questions of the catalogue, which may exceed
    /// one.
    pub(crate) log_p: f64,
    /// Logarithm of the chance of that fall for this effect alone, before the choice of its shape and
    /// among all.
    pub(crate) log_p_alone: f64,
    pub(crate) gain: Gain,
    pub(crate) evidence: f64,
    /// True where a number of the effect stands on a bound.
    pub(crate) on_bound: bool,
    /// True where numbers of the effect are fitted to what is held out.
    pub(crate) fits_there: bool,
}

impl Claim {
    /// Nats that speak for it: held out and fitted together.
    pub(crate) fn score(&self) -> f64 {
        nats_together(&self.gain, self.evidence)
    }

    /// Tells whether chance is less than this by what was fitted and what was held out together.
    pub(crate) fn is_no_chance(&self, rate: f64) -> bool {
        self.gain.log_chance_with(self.log_p).min(0.0) <= libm::log(rate)
    }
}

/// Gain held out and gain in evidence together, nats.
pub(crate) fn nats_together(gain: &Gain, evidence: f64) -> f64 {
    gain.nats + evidence
}

/// Choices that a rival has to pay for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Asked {
    /// Sizes of the effect, and its sizes and shapes together.
    sizes: usize,
    numbers: usize,
    /// Shapes among which those tried were chosen.
    looked_at: f64,
    /// Questions of the catalogue.
    questions: f64,
}

impl Asked {
    /// Logarithm of the chance that the objective falls so far, times the questions.
    pub(crate) fn log_chance(self, fall: f64) -> f64 {
        self.log_chance_by(fall, self.numbers)
    }

    /// As [`Self::log_chance`], by the sizes alone at the shapes tried.
    pub(crate) fn log_chance_of_scan(self, fall: f64) -> f64 {
        self.log_chance_by(fall, self.sizes)
    }

    /// Logarithm of the chance that the objective falls so far with this effect, whatever else was asked.
    pub(crate) fn log_chance_alone(self, fall: f64) -> f64 {
        chi_squared_log_tail(2.0 * fall, self.numbers)
    }

    fn log_chance_by(self, fall: f64, numbers: usize) -> f64 {
        chi_squared_log_tail(2.0 * fall, numbers) + libm::log(self.looked_at * self.questions)
    }

    /// Nats of evidence that its numbers and the choice of its shape cost.
    pub(crate) fn price_nats(self, samples: usize) -> f64 {
        0.5 * self.numbers as f64 * libm::log(samples as f64) + libm::log(self.looked_at)
    }
}

impl Rival {
    /// Logarithm of the chance of another fall, as [`Self::log_p`].
    pub(crate) fn log_chance_of(&self, fall: f64) -> f64 {
        self.asked.log_chance(fall)
    }

    /// Judges it against another structure without it.
    pub(crate) fn judge(&mut self, without: &Judged, samples: usize) {
        let with = &self.judged;
        self.claim.fall = without.fitted.objective - with.fitted.objective;
        self.claim.gain = with.gain_over(without);
        self.claim.evidence =
            with.evidence_over(without, samples) - libm::log(self.asked.looked_at);
    }

    /// Rival fitted anew beside others, as the first of the effects.
    pub(crate) fn first_of(mut self, judged: Judged, without: &Judged, samples: usize) -> Self {
        self.judged = judged;
        let Fitted { structure, values, .. } = &self.judged.fitted;
        self.claim.on_bound = is_on_bound(structure, values, 0, self.asked.sizes);
        self.judge(without, samples);
        self
    }

    /// How it did, in words.
    pub(crate) fn line(&self, families: &[Family]) -> String {
        let Claim { fall, log_p, gain, evidence, on_bound, .. } = &self.claim;
        format!(
            "  rival {} {:?}: fall {fall:.1}, log p {:.1}, gain {:.1} ± {:.1} of {:.1}, evidence {evidence:.1}, \
             bound {on_bound}, rms {:.5}",
            self.id.info().symbol,
            families[self.family].sizes,
            log_p.min(0.0),
            gain.nats,
            gain.std_error,
            0.5 * gain.energy,
            self.judged.held_out.rms()
        )
    }

    /// Rival with its fit ended by sensitivities taken anew.
    pub(crate) fn settled(
        &self,
        current: &Judged,
        split: Split<'_>,
        whitener: &Whitener,
    ) -> Result<Self, GreyboxError> {
        let Fitted { structure, values, .. } = &self.judged.fitted;
        let fitted = fit(split.train, structure.clone().started_at(values), whitener)?;
        let judged = Judged::new(fitted, split, whitener)?;
        Ok(self.refitted(judged, current, split.train.samples()))
    }

    /// Rival with another fit.
    pub(crate) fn refitted(&self, judged: Judged, current: &Judged, samples: usize) -> Self {
        Self::of(self.id, self.family, judged, current, samples, self.asked)
    }

    /// Fits a scored effect on top of a fitted structure, from its shape and size in the scan.
    pub(crate) fn new(
        shortlisted: Shortlisted<'_>,
        current: &Judged,
        split: Split<'_>,
        whitener: &Whitener,
        bar: f64,
    ) -> Result<Self, GreyboxError> {
        let Shortlisted { scored, tried, family, plausible, .. } = shortlisted;
        let train = split.train;
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
            let mut numbers = numbers(effect, &tried.sizes, &shapes, &plausible);
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
        let (judged, asked) = (Judged::new(fitted, split, whitener)?, shortlisted.asked());
        Ok(Self::of(tried.plain.id(), scored.family, judged, current, train.samples(), asked))
    }

    /// A fit judged against the structure without the effect, which is its last.
    fn of(
        id: EffectId,
        family: usize,
        judged: Judged,
        current: &Judged,
        samples: usize,
        asked: Asked,
    ) -> Self {
        let fitted = &judged.fitted;
        let fall = current.fitted.objective - fitted.objective;
        let claim = Claim {
            fall,
            log_p: asked.log_chance(fall),
            log_p_alone: asked.log_chance_alone(fall),
            gain: judged.gain_over(current),
            evidence: judged.evidence_over(current, samples) - libm::log(asked.looked_at),
            on_bound: is_on_bound(
                &fitted.structure,
                &fitted.values,
                fitted.structure.effects.len() - 1,
                asked.sizes,
            ),
            fits_there: judged.fits_more_there(current),
        };
        Self { id, family, judged, claim, asked }
    }
}

/// Tells whether one of the first sizes of an effect stands on a bound.
pub(crate) fn is_on_bound(
    structure: &Structure,
    values: &[f64],
    effect: usize,
    sizes: usize,
) -> bool {
    let is_near = |&p: &usize| {
        let (free, value) = (&structure.free[p], values[p]);
        let near = 1e-3 * (free.most - free.least).min(value.abs().max(free.step));
        value - free.least <= near || free.most - value <= near
    };
    structure.places_of_effect(effect).iter().take(sizes).any(is_near)
}

/// Half the mean square of the whitened residual from which a fit is poor.
const POOR_PER_SAMPLE: f64 = 5.0;
/// Half the mean square at which no other start is worth trying: noise alone leaves a half.
pub(crate) const GOOD_PER_SAMPLE: f64 = 0.75;
/// Multiples of the size tried from which a fit starts where the model without it is poor.
const SIZES: [f64; 2] = [3.0, 30.0];

#[cfg(test)]
impl Judged {
    /// At values, without a recording.
    pub(crate) fn at(structure: Structure, values: Vec<f64>, stds: Vec<f64>, train: f64) -> Self {
        let sensitivities = vec![PerRecord::new(); values.len()];
        let held_out = HeldOut {
            residuals: PerRecord::new(),
            values: values.clone(),
            stds,
            size: 1.0,
            price_nats: 0.0,
        };
        let residuals = PerRecord::new();
        let fitted =
            Fitted { structure, values, residuals, sensitivities, objective: 0.0, noise_nats: 0.0 };
        let own = Whitener::white(1.0);
        Self { fitted, own, held_out, blocks: Vec::new(), train, least_stds: Vec::new() }
    }
}

#[cfg(test)]
impl Rival {
    /// Rival of one number, with a chance and a gain.
    pub(crate) fn at(id: EffectId, judged: Judged, log_p: f64, gain: [f64; 2]) -> Self {
        let asked = Asked { sizes: 1, numbers: 1, looked_at: 1.0, questions: 1.0 };
        let gain = Gain { nats: gain[0], std_error: gain[1], energy: 0.0 };
        let claim = Claim {
            fall: 0.0,
            log_p,
            log_p_alone: log_p,
            gain,
            evidence: 0.0,
            on_bound: false,
            fits_there: false,
        };
        Self { id, family: 0, judged, claim, asked }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Machine;

    #[test]
    fn what_is_held_out_widens_a_number_and_never_narrows_one() {
        let machine = Machine::bench_top();
        let nominal = Structure::nominal(&machine);
        let values = nominal.starts();
        let prior = |n: usize| nominal.free[n].prior.expect("a tolerance").std;
        let mut stds = vec![0.0; values.len()];
        (stds[0], stds[1]) = (3.0 * prior(0), 0.5 * prior(1));
        let problem = Problem::new(&machine, core::iter::empty(), 1);
        let covariance = Judged::at(nominal.clone(), values, stds, 0.0)
            .covariance(&problem, &Whitener::white(1.0));
        for (n, times) in [(0, 3.0), (1, 1.0)] {
            let ratio = libm::sqrt(covariance[(n, n)]) / prior(n);
            assert!((ratio - times).abs() < 1e-6, "{n}: {ratio}");
        }
    }
}
