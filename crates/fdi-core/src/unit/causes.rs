//! Search for effects that the model file does not have and that recordings show.
//!
//! Each round looks at every effect of the catalogue in every shape that is tried, by the score test of
//! `unmodelled`; those that are beyond chance are fitted with damage, numbers and what was found
//! before them; and of those whose gain stays beyond chance, and which make recordings held out more
//! likely, the best is kept.

use std::convert::Infallible;

use ema_sim::{Effect, EffectId, Geometry, SimulationError};
use inference::{MostProbable, chi_squared_log_tail, dot, most_probable};

use crate::{
    statistics::parallel::in_parallel,
    unit::{
        acting::Acting,
        modelled::Modelled,
        search::UnitSearchError,
        together::Together,
        unmodelled::{AS_GOOD, Explanation, Gain, limit},
        variants::Variant,
    },
};

/// Effects of a round that are fitted.
const FITTED: usize = 6;
/// Share of the gain that recordings held out would have on average, below which they speak against
/// an effect.
const HELD_SHARE: f64 = 0.25;
/// Most rounds: what was dropped may come back.
const MOST_ROUNDS: usize = 8;
/// Share of the gain of an effect found that the low-fidelity model's own error on it may have: what
/// gains less beside it is a remainder and no further effect.
const OWN_ERROR_SHARE: f64 = 0.3;

/// An effect that was fitted, beside those found before it.
#[derive(Clone, Debug)]
pub(crate) struct FittedCause {
    pub(crate) acting: Acting,
    /// Numbers of the effect, with their standard deviations.
    pub(crate) unknowns: Vec<f64>,
    pub(crate) stds: Vec<f64>,
    /// Twice the logarithm of the likelihood ratio.
    pub(crate) gain: f64,
    /// Gain that chance exceeds at the rate allowed.
    pub(crate) limit: f64,
    /// Gain that its numbers have to be worth.
    pub(crate) price: f64,
    /// Chance of such a gain in any of what is tried.
    pub(crate) p_familywise: f64,
    /// Logarithm of the likelihood ratio of the recordings held out.
    pub(crate) holdout_gain_nats: Option<f64>,
    /// Mean of that logarithm where recordings held out show as much as those fitted.
    pub(crate) expected_gain_nats: f64,
}

impl FittedCause {
    /// True where neither chance nor the recordings held out speak against it.
    fn is_beyond_chance(&self) -> bool {
        let is_held = |gain: f64| gain > HELD_SHARE * self.expected_gain_nats;
        self.gain > self.limit && self.holdout_gain_nats.is_none_or(is_held)
    }

    /// Worth beside others of its round: each number costs the logarithm of the samples.
    fn worth(&self) -> f64 {
        self.gain - self.price + 2.0 * self.holdout_gain_nats.unwrap_or(0.0)
    }

    pub(crate) fn id(&self) -> EffectId {
        self.acting.base().id()
    }
}

/// How an effect fared in the first round.
#[derive(Clone, Debug)]
pub(crate) struct Looked {
    pub(crate) id: EffectId,
    /// Natural logarithm of the chance of its gain in any of what is tried.
    pub(crate) log_p: f64,
    pub(crate) open_share: f64,
    /// Size of one of its numbers that would be seen nine times in ten, and the key of that number.
    pub(crate) smallest_seen: f64,
    pub(crate) smallest_key: &'static str,
    pub(crate) fitted: Option<FittedCause>,
}

/// An effect found, with those that are as good.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    pub(crate) best: FittedCause,
    pub(crate) as_good: Vec<FittedCause>,
}

/// Recordings in a fit.
#[derive(Clone, Debug)]
pub(crate) struct FitTogether<'a> {
    pub(crate) together: Together<'a>,
    pub(crate) found: MostProbable,
}

impl<'a> FitTogether<'a> {
    /// Most probable damage and numbers from a start.
    pub(crate) fn new(mut together: Together<'a>, start: &[f64]) -> Result<Self, UnitSearchError> {
        let unknowns = together.unknowns();
        let found = most_probable(&mut together, &unknowns, start)?;
        Ok(Self { found: found.ok_or(UnitSearchError::Undetermined)?, together })
    }

    fn sum(&self) -> f64 {
        self.together.sum(&self.found)
    }

    /// Mean square of the white residual.
    pub(crate) fn misfit(&self) -> f64 {
        let samples = self.together.samples();
        dot(&self.found.white[..samples], &self.found.white[..samples]) / samples as f64
    }

    fn explanation(&self) -> Explanation<'_> {
        let together = &self.together;
        Explanation::at(&self.found, together.last_slopes(), &together.unknowns())
    }

    /// Numbers of an effect with their standard deviations, by its place among those acting.
    fn numbers_of(&self, place: usize) -> (Vec<f64>, Vec<f64>) {
        let count = self.together.recordings().len();
        let acting = self.together.acting();
        let before: usize = acting[..place].iter().map(|one| one.len(count)).sum();
        let begin = self.together.first_of_effects() + before;
        let all = begin..begin + acting[place].len(count);
        let std = |n: usize| self.found.covariance.at(n, n).sqrt();
        (self.found.numbers[all.clone()].to_vec(), all.map(std).collect())
    }
}

/// A variant with its slopes in the recordings.
#[derive(Debug)]
struct Tried {
    variant: Variant,
    /// One row a size and recording, A.
    slopes: Vec<Vec<Vec<f64>>>,
}

/// The search in recordings fitted and held out.
pub(crate) struct CauseSearch<'a> {
    /// The fit with what was found.
    pub(crate) fit: FitTogether<'a>,
    /// Fit of the recordings held out with what was found.
    pub(crate) holdout: Option<FitTogether<'a>>,
    tried: Vec<Tried>,
    jobs: usize,
    pub(crate) found: Vec<Found>,
    /// Effects of the first round.
    pub(crate) looked: Vec<Looked>,
    /// True where a form is left that no effect explains.
    pub(crate) is_unexplained: bool,
    /// Effects that the low-fidelity model does not show in these recordings.
    pub(crate) unseen: Vec<EffectId>,
    /// Simulations of the low-fidelity model in fits and slopes of effects.
    pub(crate) evaluations: u64,
}

impl<'a> CauseSearch<'a> {
    /// Simulates what is tried on the machine as it was fitted without any of it.
    pub(crate) fn new(
        fit: FitTogether<'a>,
        holdout: Option<FitTogether<'a>>,
        variants: &[Variant],
        jobs: usize,
    ) -> Result<Self, SimulationError> {
        let mut search = Self {
            fit,
            holdout,
            tried: Vec::new(),
            jobs,
            found: Vec::new(),
            looked: Vec::new(),
            is_unexplained: false,
            unseen: Vec::new(),
            evaluations: 0,
        };
        let signals = search.signals(&[])?;
        let tried = |_, variant: &Variant| Ok::<_, Infallible>(search.tried(variant, &signals));
        let Ok(tried) = in_parallel(variants, jobs, tried);
        search.tried = tried.into_iter().flatten().collect();
        for variant in variants {
            let id = variant.effect.id();
            let is_tried = search.tried.iter().any(|one| one.variant.effect.id() == id);
            if is_tried || search.unseen.contains(&id) {
                continue;
            }
            // one that the machine cannot have is none that it may have unseen
            let mut small = variant.small().into_iter();
            if small.any(|(effect, _)| search.signals(&[effect]).is_ok()) {
                search.unseen.push(id);
            }
        }
        let recordings = search.fit.together.recordings().len() as u64;
        let simulated: usize = search.tried.iter().map(|one| one.slopes.len()).sum();
        search.evaluations += recordings * (1 + simulated as u64);
        Ok(search)
    }

    /// Signal of each recording's machine with effects, A.
    fn signals(&self, effects: &[Effect]) -> Result<Vec<Vec<f64>>, SimulationError> {
        let together = &self.fit.together;
        let signal = |(recording, modelled): (usize, &Modelled<'_>)| {
            let point = together.point(recording, &self.fit.found.numbers);
            modelled.clone().signal_with(&point, effects)
        };
        together.recordings().iter().enumerate().map(signal).collect()
    }

    /// A variant with its slopes; `None` where the machine does not take it.
    fn tried(&self, variant: &Variant, without: &[Vec<f64>]) -> Option<Tried> {
        let slope = |(effect, size): (Effect, f64)| {
            let with = self.signals(&[effect]).ok()?;
            let each = with.iter().zip(without).map(|(with, without)| {
                with.iter().zip(without).map(|(a, b)| (a - b) / size).collect::<Vec<f64>>()
            });
            let rows: Vec<Vec<f64>> = each.collect();
            rows.iter().flatten().all(|value| value.is_finite()).then_some(rows)
        };
        let slopes = variant.small().into_iter().map(slope).collect::<Option<Vec<_>>>()?;
        let is_seen = slopes.iter().flatten().flatten().any(|value| *value != 0.0);
        is_seen.then(|| Tried { variant: variant.clone(), slopes })
    }

    /// Looks for effects until nothing is left, or so many are found.
    pub(crate) fn run(&mut self, most: usize) {
        let mut rounds = 0;
        let mut goes_on = true;
        while goes_on && rounds < MOST_ROUNDS && self.found.len() < most {
            goes_on = self.round(rounds == 0);
            rounds += 1;
        }
        self.state_numbers();
        if goes_on {
            self.is_unexplained = !self.beyond_chance(self.scored()).is_empty();
        }
    }

    /// Goes on from a fit, and from that of the recordings held out with its effects.
    fn go_on_from(&mut self, fit: FitTogether<'a>) {
        if let Some(holdout) = self.held_out(&fit) {
            self.holdout = Some(holdout);
        }
        self.fit = fit;
    }

    /// Drops effects that the others found since explain.
    fn drop_needless(&mut self) {
        let mut place = 0;
        while self.found.len() > 1 && place < self.found.len() {
            let id = self.found[place].best.id();
            let Some(fit) = self.without(id) else { break };
            let needed = fit.sum() - self.fit.sum();
            let found = &self.found[place].best;
            let others = self.found.iter().filter(|one| one.best.id() != id);
            let largest = others.map(|one| one.best.gain).fold(0.0, f64::max);
            if needed < found.limit.max(OWN_ERROR_SHARE * largest) {
                self.found.remove(place);
                self.go_on_from(fit);
            } else {
                place += 1;
            }
        }
    }

    /// The fit without an effect that was found; `None` where there is none.
    fn without(&self, id: EffectId) -> Option<FitTogether<'a>> {
        let together = &self.fit.together;
        let mut start = self.fit.found.numbers[..together.first_of_effects()].to_vec();
        let mut kept = Vec::new();
        for (place, acting) in together.acting().iter().enumerate() {
            if acting.base().id() != id {
                kept.push(acting.clone());
                start.extend(self.fit.numbers_of(place).0);
            }
        }
        FitTogether::new(together.with_acting(kept), &start).ok()
    }

    /// Gives each effect found its numbers beside all the others, and takes none of them for an
    /// alternative.
    fn state_numbers(&mut self) {
        let ids: Vec<EffectId> = self.found.iter().map(|one| one.best.id()).collect();
        for found in &mut self.found {
            let acting = self.fit.together.acting();
            let own = acting.iter().position(|one| one.base().id() == found.best.id());
            if let Some(place) = own {
                found.best.acting = acting[place].clone();
                (found.best.unknowns, found.best.stds) = self.fit.numbers_of(place);
            }
            found.as_good.retain(|one| !ids.contains(&one.id()));
        }
    }

    /// Best variant of each effect that is not found yet, with the share that is open in any of its
    /// variants.
    fn scored(&self) -> Vec<(usize, Gain)> {
        let explanation = self.fit.explanation();
        let acting = self.fit.together.acting();
        let mut best: Vec<(usize, Gain)> = Vec::new();
        for (place, tried) in self.tried.iter().enumerate() {
            let Variant { effect, sizes, .. } = &tried.variant;
            let id = effect.id();
            // of an effect found the other sizes are looked for, in the shape that was found first
            let own = acting.iter().find(|one| one.base().id() == id);
            if own.is_some_and(|own| own.base() != effect || own.seeks(sizes[0])) {
                continue;
            }
            let Some(gain) = self.gain(&explanation, tried) else { continue };
            let other =
                best.iter().position(|(other, _)| self.tried[*other].variant.effect.id() == id);
            match other {
                Some(at) => {
                    let open_share = best[at].1.open_share.max(gain.open_share);
                    if best[at].1.value < gain.value {
                        best[at] = (place, gain);
                    }
                    best[at].1.open_share = open_share;
                }
                None => best.push((place, gain)),
            }
        }
        best
    }

    /// Gain of a variant, its sizes within their bounds.
    fn gain(&self, explanation: &Explanation<'_>, tried: &Tried) -> Option<Gain> {
        let together = &self.fit.together;
        let count = together.recordings().len();
        let differs = tried.variant.effect.id().info().differs_by_recording;
        // those of one recording together, as the unknowns stand
        let copies = if differs { count } else { 1 };
        let rows = |kept: &[usize]| -> Vec<Vec<f64>> {
            let row = |copy: usize, size: usize| {
                let own = |recording: usize| {
                    let is_there = !differs || recording == copy;
                    is_there.then(|| &tried.slopes[size][recording][..])
                };
                together.white_row(&(0..count).map(own).collect::<Vec<_>>())
            };
            (0..copies)
                .flat_map(|copy| kept.iter().map(move |&size| (copy, size)))
                .map(|(copy, size)| row(copy, size))
                .collect()
        };
        let one_sided = tried.variant.is_one_sided();
        let mut kept: Vec<usize> = (0..one_sided.len()).collect();
        let mut open_share = 0.0_f64;
        loop {
            let gain = explanation.gain(&rows(&kept), None)?;
            open_share = open_share.max(gain.open_share);
            let is_within = |n: usize| !one_sided[kept[n]] || gain.amplitudes[n] > 0.0;
            if (0..kept.len()).all(is_within) {
                let mut amplitudes = vec![0.0; copies * one_sided.len()];
                for copy in 0..copies {
                    for (n, &size) in kept.iter().enumerate() {
                        amplitudes[copy * one_sided.len() + size] =
                            gain.amplitudes[copy * kept.len() + n];
                    }
                }
                return Some(Gain { amplitudes, open_share, ..gain });
            }
            let within: Vec<usize> =
                (0..kept.len()).filter(|&n| is_within(n)).map(|n| kept[n]).collect();
            if within.is_empty() {
                // none of it is most probable
                let amplitudes = vec![0.0; copies * one_sided.len()];
                return Some(Gain { value: 0.0, amplitudes, open_share, ..gain });
            }
            kept = within;
        }
    }

    /// Variants beyond chance of those scored, the clearest first.
    fn beyond_chance(&self, mut beyond: Vec<(usize, Gain)>) -> Vec<(usize, Gain)> {
        let excess = |gain: &Gain| gain.value - gain.limit(self.tried.len());
        beyond.retain(|(_, gain)| excess(gain) > 0.0);
        beyond.sort_by(|(_, a), (_, b)| excess(b).total_cmp(&excess(a)));
        beyond
    }

    /// One round; false where it finds nothing.
    fn round(&mut self, is_first: bool) -> bool {
        let scored = self.scored();
        let mut candidates = self.beyond_chance(scored.clone());
        candidates.truncate(FITTED);
        let fitted =
            |_, (place, gain): &(usize, Gain)| Ok::<_, Infallible>(self.fitted(*place, gain));
        let Ok(fitted) = in_parallel(&candidates, self.jobs, fitted);
        let mut all: Vec<_> = fitted.into_iter().flatten().collect();
        self.evaluations += all.iter().map(|(_, fit)| fit.together.evaluations()).sum::<u64>();
        if is_first {
            let looked = scored.iter().map(|(place, gain)| {
                let variant = &self.tried[*place].variant;
                let fitted = all.iter().find(|(cause, _)| cause.id() == variant.effect.id());
                self.looked(variant, gain, fitted.map(|(cause, _)| cause.clone()))
            });
            self.looked = looked.collect();
        }
        let has_candidates = !candidates.is_empty();
        all.retain(|(cause, _)| cause.is_beyond_chance());
        all.sort_by(|(a, _), (b, _)| b.worth().total_cmp(&a.worth()));
        // a further size of an effect found is no further effect
        let largest = self.found.iter().map(|one| one.best.gain).fold(0.0, f64::max);
        let is_of_found = |id: EffectId| self.found.iter().any(|one| one.best.id() == id);
        all.retain(|(cause, _)| cause.gain > OWN_ERROR_SHARE * largest || is_of_found(cause.id()));
        let mut all = all.into_iter();
        let Some((best, fit)) = all.next() else {
            self.is_unexplained = has_candidates;
            return false;
        };
        let as_good =
            all.map(|(cause, _)| cause).filter(|one| best.worth() - one.worth() < AS_GOOD);
        let as_good = as_good.collect();
        match self.found.iter_mut().find(|one| one.best.id() == best.id()) {
            // another size of an effect that was found: the first said that it is there
            Some(known) => {
                let held = known.best.holdout_gain_nats.zip(best.holdout_gain_nats);
                known.best.holdout_gain_nats = held.map(|(a, b)| a + b);
                known.best.p_familywise = known.best.p_familywise.min(best.p_familywise);
                known.best.gain += best.gain;
            }
            None => self.found.push(Found { best, as_good }),
        }
        self.go_on_from(fit);
        self.drop_needless();
        true
    }

    fn looked(&self, variant: &Variant, gain: &Gain, fitted: Option<FittedCause>) -> Looked {
        // the square root of a noncentral χ² is nearly normal about the size's own white length
        let needed = gain.limit(self.tried.len()).sqrt() + NINE_IN_TEN;
        let id = variant.effect.id();
        let first = &id.info().parameters[variant.sizes[0]];
        Looked {
            id,
            smallest_key: first.key(Geometry::Rotary),
            log_p: self.log_chance(gain.value, gain.degrees as usize),
            open_share: gain.open_share,
            smallest_seen: needed / gain.open_square.sqrt(),
            fitted,
        }
    }

    /// Natural logarithm of the chance that any of what is tried gains as much.
    fn log_chance(&self, gain: f64, degrees: usize) -> f64 {
        (chi_squared_log_tail(gain, degrees) + (self.tried.len() as f64).ln()).min(0.0)
    }

    /// A variant fitted beside what was found, with the sizes asked about or, where that is worth
    /// more, with all sizes of its effect; `None` where no fit is found.
    fn fitted(&self, place: usize, gain: &Gain) -> Option<(FittedCause, FitTogether<'a>)> {
        let Variant { effect, sizes, scales } = &self.tried[place].variant;
        let (own_id, count) = (effect.id(), self.fit.together.recordings().len());
        // what was found before, but for other sizes of this effect, which are fitted with it
        let mut acting = Acting::new(effect.clone(), sizes, scales);
        let mut own = vec![0.0; acting.len(count)];
        let (mut others, mut numbers, mut moves) = (Vec::new(), Vec::new(), Vec::new());
        let machine = self.fit.together.first_of_effects();
        let mut begin = machine;
        for (place, other) in self.fit.together.acting().iter().enumerate() {
            let (found, _) = self.fit.numbers_of(place);
            let end = begin + found.len();
            if other.base().id() == own_id {
                acting = other.with_sizes(sizes, scales);
                own = other.widened(&acting, count, &found);
            } else {
                others.push(other.clone());
                numbers.extend(found);
                moves.extend(&gain.moves[begin..end]);
            }
            begin = end;
        }
        let mut shares = STARTS.to_vec();
        if own_id.info().nonlinear_in_size {
            // as it was tried, since less of it does not do less
            shares.push(scales[sizes[0]] / gain.amplitudes[0].max(f64::MIN_POSITIVE));
        }
        let start_at = |share: f64| {
            let amplitudes: Vec<f64> = gain.amplitudes.iter().map(|size| share * size).collect();
            let added = acting.at_sizes(count, sizes, &amplitudes);
            let own = own.iter().zip(added).map(|(own, added)| own + added);
            let at = self.fit.found.numbers[..machine].iter().chain(&numbers);
            let moves = gain.moves[..machine].iter().chain(&moves);
            at.zip(moves).map(|(at, by)| at + share * by).chain(own).collect::<Vec<f64>>()
        };
        let starts: Vec<Vec<f64>> = shares.into_iter().map(start_at).collect();
        let with = |acting: &Acting| {
            let all = others.iter().chain([acting]).cloned().collect();
            self.fit.together.with_acting(all)
        };
        let mut together = with(&acting);
        let starts = together.by_likelihood(starts);
        let mut fits = starts.iter().map(|start| FitTogether::new(together.clone(), start));
        let fit = fits.find_map(Result::ok)?;
        let (cause, fit) = self.cause(fit, sizes.len())?;
        let all_sizes = own_id.info().size_groups().concat();
        let wider = acting.with_sizes(&all_sizes, scales);
        if wider.numbers() == acting.numbers() || own_id.info().nonlinear_in_size {
            return Some((cause, fit));
        }
        let mut start = fit.found.numbers[..machine + numbers.len()].to_vec();
        start.extend(acting.widened(&wider, count, &cause.unknowns));
        let whole = FitTogether::new(with(&wider), &start).ok();
        let whole = whole.and_then(|fit| self.cause(fit, all_sizes.len()));
        Some(match whole {
            Some((whole, fit)) if whole.worth() > cause.worth() => (whole, fit),
            _ => (cause, fit),
        })
    }

    /// The effect of a fit that acts last, of which so many sizes are new.
    fn cause(&self, fit: FitTogether<'a>, sizes: usize) -> Option<(FittedCause, FitTogether<'a>)> {
        let count = self.fit.together.recordings().len();
        let place = fit.together.acting().len().checked_sub(1)?;
        let acting = fit.together.acting()[place].clone();
        let (unknowns, stds) = fit.numbers_of(place);
        let gain = self.fit.sum() - fit.sum();
        let copies = if acting.base().id().info().differs_by_recording { count } else { 1 };
        let sizes = sizes * copies;
        let held = self.holdout.as_ref().map_or(0, |held| held.together.recordings().len());
        let cause = FittedCause {
            unknowns,
            stds,
            gain,
            limit: limit(sizes as f64, self.tried.len()),
            price: acting.len(count) as f64 * (self.fit.together.samples() as f64).ln(),
            p_familywise: self.log_chance(gain, sizes).exp(),
            holdout_gain_nats: self.holdout_gain(&fit),
            expected_gain_nats: 0.5 * gain * held as f64 / count as f64,
            acting,
        };
        gain.is_finite().then_some((cause, fit))
    }

    /// Fit of the recordings held out with the effects of another fit.
    fn held_out(&self, fit: &FitTogether<'a>) -> Option<FitTogether<'a>> {
        let holdout = self.holdout.as_ref()?;
        let count = fit.together.recordings().len();
        let acting = fit.together.acting().iter().enumerate();
        let acting = acting.map(|(place, one)| one.held_out(count, &fit.numbers_of(place).0));
        let acting: Vec<Acting> = acting.collect();
        let together = holdout.together.with_acting(acting);
        let mut start = holdout.found.numbers[..holdout.together.first_of_effects()].to_vec();
        start.resize(together.unknowns().len(), 0.0);
        FitTogether::new(together, &start).ok()
    }

    /// Logarithm of the likelihood ratio of the recordings held out, with the effects of a fit beside
    /// those found before. Sizes that every recording has of its own are fitted, and each costs what
    /// it gains by chance.
    fn holdout_gain(&self, fit: &FitTogether<'a>) -> Option<f64> {
        let before = self.holdout.as_ref()?;
        // where the machine is none with the effects, they are worth less than nothing
        let Some(after) = self.held_out(fit) else { return Some(f64::NEG_INFINITY) };
        let free = |one: &FitTogether<'_>| one.found.numbers.len() as f64;
        Some(0.5 * (before.sum() - after.sum()) - (free(&after) - free(before)))
    }
}

/// Shares of the sizes by the score test that a fit may begin at.
const STARTS: [f64; 4] = [1.0, 0.3, 0.1, 0.0];
/// Normal quantile that nine of ten are below.
const NINE_IN_TEN: f64 = 1.281_551_565_544_6;
