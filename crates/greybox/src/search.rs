//! The rounds: scan, refit, accept; then whether every effect found is still needed.

use ema_sim::{CommandKind, EffectId, LoopPart, Repetition};
use inference::{Whitener, chi_squared_log_tail, rms};

use crate::{
    curve::{Hypothesis, hypotheses},
    error::{GreyboxError, if_run},
    explain::Session,
    fit::{Fitted, fit, sandwich, whitened},
    floor::Floor,
    gain::Gain,
    hypothesis::{Family, Leads, Scales, differs_by_record, families, is_nonlinear_in_size},
    observation::Observation,
    observing::{AllAnchors, Place},
    plausible::Plausible,
    problem::{PerRecord, Problem},
    response::leads,
    rival::{Claim, Judged, Rival, Shortlisted, nats_together},
    scan::{Scan, score},
    structure::{Structure, Target},
    trial::{Before, Trial, Tried},
};

/// Share of what is explained that the form of a real law leaves: a tenth of its amplitude. What
/// explains no more is no effect beside it.
const FORM_SHARE: f64 = 0.01;
/// Share beyond three times that amplitude: no form leaves so much.
const MOST_FORM_SHARE: f64 = 0.1;
/// Rivals of the first effect that are tried in its place beside a second.
const MOST_SWAPPED: usize = 3;
/// Rivals of a round whose fits are ended before one of them wins.
const MOST_SETTLED: usize = 2;
/// Share of the best rival's score from which on another is among them.
const SETTLED_SHARE: f64 = 0.5;
/// Standard deviations by which the finer model may explain less with what was found.
const WORSE_STDS: f64 = 2.0;
/// Share of the noise by which the predictions of two fits may differ between which an effect does
/// the same.
const SAME_WITHIN: f64 = 0.1;
/// Nats by which numbers fitted to what is held out have to gain there beyond what they cost, a nat
/// each: noise alone gives two of them so much in 2 %.
const LEAST_FITTED_GAIN: f64 = 2.0;

/// An effect accepted in a round.
pub(crate) struct Found {
    pub(crate) rival: Rival,
    pub(crate) p_familywise: f64,
}

/// Where the rounds ended.
pub(crate) struct Search {
    pub(crate) floor: Floor,
    pub(crate) before: Judged,
    pub(crate) current: Judged,
    pub(crate) found: Vec<Found>,
    /// Fit without the first of them, once it is known.
    pub(crate) without_first: Option<Judged>,
    /// Rivals of the first effect that explain as much.
    pub(crate) ties: Vec<Rival>,
    /// Rivals of the last of several effects that explain as much.
    pub(crate) last_ties: Vec<Rival>,
    /// Rivals of other kinds that stood the tests in the first round or are tied with what did,
    /// those
    /// first; beside later effects, if any.
    pub(crate) runners_up: Vec<Rival>,
    /// Rivals that the last round left open: no chance, and not confirmed by what was held out.
    pub(crate) unconfirmed: Vec<Rival>,
    /// True where beside what was found a fit explains more than noise does that did not stand the
    /// tests, whatever it is.
    pub(crate) is_more_there: bool,
    /// Trials by which the noise was told.
    pub(crate) look: Option<Look>,
    pub(crate) rounds: Vec<Round>,
    /// How each effect fared in the first round.
    pub(crate) tried: Vec<Hypothesis>,
    /// Model that predicts, and where its predictions stood without an effect and stand now.
    pub(crate) observation: Observation,
    pub(crate) anchors_before: AllAnchors,
    pub(crate) anchors: AllAnchors,
    pub(crate) log: Vec<String>,
}

impl Search {
    /// Fall of the objective by all that was found.
    pub(crate) fn explained(&self) -> f64 {
        self.before.fitted.nats() - self.current.fitted.nats()
    }

    /// Tells whether beside what was found a fit explains more than noise does.
    pub(crate) fn is_more_beside_found(&self) -> bool {
        !self.found.is_empty() && self.is_more_there
    }

    /// Tells whether an effect that acts once was found.
    fn has(&self, id: EffectId) -> bool {
        self.found.iter().any(|known| known.rival.id == id) && !may_repeat(id)
    }
}

/// The noise with the fit of the model without an effect.
pub(crate) struct Floored {
    pub(crate) floor: Floor,
    pub(crate) fitted: Fitted,
    pub(crate) look: Option<Look>,
}

/// Trials by which the noise was told.
pub(crate) struct Look {
    /// Where predictions stood.
    pub(crate) standing: Option<Place>,
    /// Prediction without an effect.
    pub(crate) drive: PerRecord,
    pub(crate) tried: Vec<Tried>,
}

impl Look {
    /// Tells whether effects do what they did, where another fit predicts `drive`.
    fn is_here(&self, standing: Option<&Place>, drive: &PerRecord, whitener: &Whitener) -> bool {
        let less = |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(|(a, b)| a - b).collect();
        let change: PerRecord = drive.iter().zip(&self.drive).map(less).collect();
        self.standing.as_ref() == standing && rms(&whitened(whitener, &change)) <= SAME_WITHIN
    }
}

/// Everything that one scan made.
pub(crate) struct Round {
    pub(crate) families: Vec<Family>,
    pub(crate) tried: Vec<Tried>,
    pub(crate) scan: Scan,
}

impl Round {
    /// The best of the scan in words.
    fn lines(&self) -> impl Iterator<Item = String> {
        self.scan.scored.iter().take(6).map(|s| {
            let f = &self.families[s.family];
            let (symbol, sizes) = (f.id.info().symbol, &f.sizes);
            let (log_p, share, cosine) = (s.log_p, s.visible_share, s.raw_cosine);
            format!("  {symbol} {sizes:?}: log p {log_p:.1}, share {share:.2}, cosine {cosine:.2}")
        })
    }
}

/// Share of what is explained that may be the form of a law and not an effect. The numbers of what
/// differs between recordings are fitted to those held out as well, so that it takes up more.
fn form_share(id: EffectId) -> f64 {
    if differs_by_record(id) { MOST_FORM_SHARE } else { FORM_SHARE }
}

/// Tells whether an effect may act twice: ripples do, of different orders.
pub(crate) fn may_repeat(id: EffectId) -> bool {
    id.info().repetition == Repetition::ByOrder
}

impl Session<'_> {
    /// Effects, one a round, until no other stands the tests; then those that the others leave
    /// needed.
    pub(crate) fn search(&mut self) -> Result<Search, GreyboxError> {
        let left_out = [&self.train, &self.holdout, &self.repeat].map(Problem::left_out);
        let mut log: Vec<String> = left_out.into_iter().flatten().collect();
        let (observation, values) = self.observe(&mut log)?;
        let nominal = Structure::nominal(self.machine).started_at(&values);
        let Floored { floor, fitted, look } = self.floor(&nominal)?;
        let fitted = self.followed(observation, fitted, &floor.whitener)?;
        let before = Judged::new(fitted, self.split(), &floor.whitener)?;
        let scales = self.scales(&before.fitted)?;
        log.push(format!(
            "nominal: holdout rms {:.5}, floor {:.5} ({:?}), order {}",
            before.held_out.rms(),
            floor.rms,
            floor.source,
            floor.whitener.order()
        ));
        let anchors = self.all_anchors();
        let mut search = Search {
            floor,
            current: before.clone(),
            before,
            found: Vec::new(),
            without_first: None,
            ties: Vec::new(),
            last_ties: Vec::new(),
            runners_up: Vec::new(),
            unconfirmed: Vec::new(),
            is_more_there: false,
            look,
            rounds: Vec::new(),
            tried: Vec::new(),
            observation,
            anchors_before: anchors.clone(),
            anchors,
            log,
        };
        for number in 0..self.options.most_effects {
            if !self.round(&mut search, &scales, number)? {
                break;
            }
            self.follow(&mut search)?;
        }
        self.drop_needless(&mut search)?;
        if self.swap_first(&mut search)? {
            let found = search.found.len();
            self.drop_needless(&mut search)?;
            // they were tied beside what is gone
            if search.found.len() < found {
                search.ties.clear();
            }
        }
        if !search.found.is_empty() {
            self.follow(&mut search)?;
            self.take_back_worse(&mut search);
        }
        let named: Vec<EffectId> = search.found.iter().map(|found| found.rival.id).collect();
        search.runners_up.retain(|rival| !named.contains(&rival.id));
        Ok(search)
    }

    /// Takes back all that was found where the finer model explains less with it than without, by more
    /// than the means of so few runs differ.
    fn take_back_worse(&mut self, search: &mut Search) {
        let explained = search.explained();
        if explained > 0.0 {
            return;
        }
        let whitener = &search.floor.whitener;
        self.put_back(&search.anchors_before);
        let before = self.train.runs_std(&search.before.fitted.residuals, whitener);
        self.put_back(&search.anchors);
        let now = self.train.runs_std(&search.current.fitted.residuals, whitener);
        let by_chance = libm::hypot(before, now);
        if explained > -WORSE_STDS * by_chance {
            return;
        }
        search.log.push(format!(
            "taken back: the finer model explains {:.1} less with it, ± {by_chance:.1}",
            -explained
        ));
        (search.current, search.anchors) = (search.before.clone(), search.anchors_before.clone());
        search.found.clear();
        search.ties.clear();
        search.last_ties.clear();
    }

    /// Looks for one more effect; false where none stands the tests.
    fn round(
        &self,
        search: &mut Search,
        scales: &Scales,
        number: usize,
    ) -> Result<bool, GreyboxError> {
        let alpha = self.alarm_rate(number);
        let whitener = &search.floor.whitener;
        let round = self.scan(search, scales)?;
        let p_familywise = round.scan.p_familywise;
        search.log.extend(round.lines());
        let mut rivals = if p_familywise <= alpha {
            self.rivals(&round, &search.current, whitener, scales)?
        } else {
            Vec::new()
        };
        self.settle_nearest(&mut rivals, search)?;
        search.log.extend(rivals.iter().map(|rival| rival.line(&round.families)));
        if search.rounds.is_empty() {
            let of_family: Vec<EffectId> = round.families.iter().map(|f| f.id).collect();
            search.tried = hypotheses(&of_family, &round.scan, &rivals);
        }
        search.rounds.push(round);
        let explained = search.explained();
        search.is_more_there = rivals.iter().any(|rival| rival.claim.log_p <= self.log_sure());
        let stands = |rival: &Rival| self.stands(rival.id, &rival.claim, explained, alpha);
        rivals.retain(|rival| !search.has(rival.id));
        let (mut accepted, mut others): (Vec<Rival>, Vec<Rival>) =
            rivals.into_iter().partition(stands);
        accepted.sort_by(|a, b| b.claim.score().total_cmp(&a.claim.score()));
        self.settle(&mut accepted, &mut others, search, stands)?;
        others.retain(|rival| rival.claim.fall >= form_share(rival.id) * explained);
        let Some(winner) = accepted.first().cloned() else {
            search.unconfirmed = self.unconfirmed(&search.current, &others, alpha);
            return Ok(false);
        };
        let ties = self.left_open(&winner.judged, accepted.iter().chain(&others), alpha);
        let ties = best_of_each(ties, winner.id);
        if search.found.is_empty() {
            let is_tied = |rival: &Rival| ties.iter().any(|tie| tie.id == rival.id);
            accepted.retain(|rival| !is_tied(rival));
            search.runners_up = ties.clone();
            search.runners_up.extend(best_of_each(accepted, winner.id));
            search.ties = ties;
        } else {
            search.last_ties = ties;
        }
        search.log.push(format!("round {number}: {}", winner.id.info().symbol));
        search.is_more_there = false;
        search.current = winner.judged.clone();
        search.found.push(Found { rival: winner, p_familywise });
        Ok(true)
    }

    /// Refits the nearest rival. It explains most of what was fitted, but what was held out worse
    /// than nothing, and may have
    /// stopped short: it is fitted again from no wear, where that is nearer.
    fn settle_nearest(&self, rivals: &mut [Rival], search: &Search) -> Result<(), GreyboxError> {
        let nearest = rivals.iter_mut().max_by(|a, b| a.claim.fall.total_cmp(&b.claim.fall));
        if let Some(rival) =
            nearest.filter(|rival| rival.claim.evidence > 0.0 && rival.claim.gain.nats < 0.0)
        {
            let whitener = &search.floor.whitener;
            let Fitted { structure, values, .. } = &rival.judged.fitted;
            let healthy = structure.clone().started_at(values).started_worn([0.0; 2]);
            let Some(judged) = self.judged(healthy, whitener)? else { return Ok(()) };
            if judged.fitted.objective < rival.judged.fitted.objective {
                *rival = rival.clone().refitted(judged, &search.current, self.train.samples());
            }
        }
        Ok(())
    }

    /// Ends the fits of the best with sensitivities of their own; those that stand the tests still
    /// come first, in their new order, and those that do not are among the others.
    fn settle(
        &self,
        accepted: &mut Vec<Rival>,
        others: &mut Vec<Rival>,
        search: &Search,
        stands: impl Fn(&Rival) -> bool,
    ) -> Result<(), GreyboxError> {
        let whitener = &search.floor.whitener;
        let mut settled: Vec<Rival> = Vec::new();
        while settled.len() < MOST_SETTLED && !accepted.is_empty() {
            let most = settled.iter().map(|rival: &Rival| rival.claim.score()).reduce(f64::max);
            if most.is_some_and(|most| accepted[0].claim.score() < SETTLED_SHARE * most) {
                break;
            }
            let ended = accepted.remove(0).settled(&search.current, self.split(), whitener);
            let Some(rival) = if_run(ended)? else { continue };
            if stands(&rival) { &mut settled } else { &mut *others }.push(rival);
        }
        settled.sort_by(|a, b| b.claim.score().total_cmp(&a.claim.score()));
        accepted.splice(0..0, settled);
        Ok(())
    }

    /// Puts each of the best rivals of the first effect in its place, beside the later ones;
    /// whether one stays there. Others may be tied with it there.
    fn swap_first(&self, search: &mut Search) -> Result<bool, GreyboxError> {
        if search.found.len() < 2 {
            return Ok(false);
        }
        let Some(without) = search.without_first.clone() else {
            search.ties.clear();
            return Ok(false);
        };
        let samples = self.train.samples();
        let mut rivals: Vec<Rival> = core::mem::take(&mut search.runners_up);
        rivals.retain(|rival| !search.has(rival.id));
        rivals.truncate(MOST_SWAPPED.max(search.ties.len()));
        let mut is_swapped = false;
        for rival in rivals {
            let with = &rival.judged.fitted;
            let known = &search.current.fitted;
            let mut structure = with.structure.clone().started_at(&with.values);
            for place in 1..search.found.len() {
                structure = structure.with_effect_of(&known.structure, &known.values, place);
            }
            let Some(judged) = self.judged(structure, &search.floor.whitener)? else { continue };
            let gain = judged.gain_over(&search.current);
            let evidence = judged.evidence_over(&search.current, samples);
            let rival = rival.first_of(judged, &without, samples);
            let (symbol, fit) = (rival.id.info().symbol, rival.judged.fit_over(&search.current));
            search.log.push(format!(
                "beside the others {symbol}: gain {:.1} ± {:.1}, fit {fit:.1}, bound {}",
                gain.nats, gain.std_error, rival.claim.on_bound
            ));
            if rival.claim.on_bound {
                continue;
            }
            if gain.is_sure(self.options.gain_std_errors) && evidence > self.options.evidence_nats {
                let (new, old) = (rival.id.info().symbol, search.found[0].rival.id.info().symbol);
                search.log.push(format!("swapped: {new} for {old}"));
                search.current = rival.judged.clone();
                search.found[0].rival = rival;
                // they were open beside what is gone
                search.last_ties.clear();
                search.unconfirmed.clear();
                search.is_more_there = false;
                is_swapped = true;
            } else {
                search.runners_up.push(rival);
            }
        }
        let is_tied = |rival: &&Rival| self.is_tied(rival, &search.current);
        search.ties = search.runners_up.iter().filter(is_tied).cloned().collect();
        Ok(is_swapped)
    }

    /// Leaves out what the others have made needless, what explains least first; the others are
    /// judged anew against what is left without each.
    fn drop_needless(&self, search: &mut Search) -> Result<(), GreyboxError> {
        loop {
            let without = self.without_each(search)?;
            let needless = without.iter().enumerate().filter_map(|(place, without)| {
                let without =
                    without.as_ref().filter(|without| !self.needs(search, place, without))?;
                Some((place, without))
            });
            let objective = |judged: &Judged| judged.fitted.objective;
            let least = needless.min_by(|(_, a), (_, b)| objective(a).total_cmp(&objective(b)));
            let Some((place, left)) = least else {
                self.judge_anew(search, without);
                return Ok(());
            };
            let gain = search.current.gain_over(left);
            let dropped = search.found.remove(place).rival;
            let fall = objective(left) - objective(&search.current);
            search.is_more_there |= dropped.log_chance_of(fall) <= self.log_sure();
            search.current = left.clone();
            search.last_ties.clear();
            search.unconfirmed.clear();
            if place == 0 {
                search.ties.clear();
                search.runners_up.clear();
            }
            search.log.push(format!(
                "dropped: {}: fall {fall:.1}, gain {:.1} ± {:.1} of {:.1}",
                dropped.id.info().symbol,
                gain.nats,
                gain.std_error,
                0.5 * gain.energy,
            ));
        }
    }

    /// Judges what was found, and what is tied with it alone, against what is left without each.
    fn judge_anew(&self, search: &mut Search, without: Vec<Option<Judged>>) {
        let samples = self.train.samples();
        for (found, without) in search.found.iter_mut().zip(&without) {
            let Some(without) = without else { continue };
            found.rival.judged = search.current.clone();
            found.rival.judge(without, samples);
        }
        let is_alone = without.len() == 1;
        if let Some(Some(without)) = without.last().filter(|_| !is_alone) {
            search.last_ties.iter_mut().for_each(|tie| tie.judge(without, samples));
        }
        search.without_first = without.into_iter().next().flatten();
        if let Some(without) = search.without_first.as_ref().filter(|_| is_alone) {
            search.ties.iter_mut().for_each(|tie| tie.judge(without, samples));
        }
    }

    /// Fits of an explanation without each of its effects; nothing where the machine
    /// cannot be run so.
    fn without_each(&self, search: &mut Search) -> Result<Vec<Option<Judged>>, GreyboxError> {
        let mut all = Vec::new();
        for place in 0..search.found.len() {
            let known = &search.current.fitted;
            let structure = known.structure.without_effect(&known.values, place);
            let without = self.judged(structure, &search.floor.whitener)?;
            // what was found may have led damage and tolerances to where they do without it
            let best = search.before.fitted.nats();
            if let Some(without) = &without
                && search.found.len() == 1
                && without.fitted.nats() < best
            {
                search.before = without.clone();
                search.anchors_before = self.all_anchors();
            }
            all.push(without);
        }
        Ok(all)
    }

    /// Tells whether what was found explains more than it does without one of its effects.
    fn needs(&self, search: &Search, place: usize, without: &Judged) -> bool {
        let current = &search.current;
        let fall = without.fitted.objective - current.fitted.objective;
        let numbers = current.fitted.values.len() - without.fitted.values.len();
        let others = search.explained() - fall;
        let is_no_form = fall >= MOST_FORM_SHARE * others;
        let (gain, log_p) = (current.gain_over(without), chi_squared_log_tail(2.0 * fall, numbers));
        let evidence = current.evidence_over(without, self.train.samples());
        log_p <= self.log_alone()
            && self.is_held_out(&gain, log_p, current.fits_more_there(without), is_no_form)
            && nats_together(&gain, evidence) > self.options.evidence_nats
            && fall >= form_share(search.found[place].rival.id) * search.explained()
            && self.has_size(current, place, &search.floor.whitener)
    }

    /// Tells whether one of the sizes of an effect is not zero within two standard deviations
    /// ([`Options::gain_std_errors`](crate::Options::gain_std_errors)): beside numbers that do the same,
    /// none may be. Sizes are asked for beside the shape found, of which there is none without a size.
    /// An effect with another size in each recording is told by its fit alone.
    fn has_size(&self, judged: &Judged, effect: usize, whitener: &Whitener) -> bool {
        let Fitted { structure, values, .. } = &judged.fitted;
        let places = structure.places_of_effect(effect);
        let sizes = structure.sizes_of_effect(effect);
        let differs =
            |&place: &usize| matches!(structure.free[place].target, Target::InRecord { .. });
        if places.iter().any(differs) {
            return true;
        }
        let is_shape = |place: &usize| places.contains(place) && !sizes.contains(place);
        let kept: Vec<usize> = (0..values.len()).filter(|place| !is_shape(place)).collect();
        let all = sandwich(&judged.fitted, &self.train, whitener);
        let covariance = judged.no_surer(all.clone());
        let beside = sandwich(&judged.fitted.only(&kept), &self.train, whitener);
        let known = kept.iter().enumerate().filter(|(_, place)| sizes.contains(place));
        known.into_iter().any(|(known, &place)| {
            // as much more as what is held out asks for
            let more = covariance[(place, place)] / all[(place, place)].max(f64::MIN_POSITIVE);
            let std = libm::sqrt((more * beside[(known, known)]).max(0.0));
            values[place].abs() > self.options.gain_std_errors * std
        })
    }

    /// A structure fitted from its starts; `None` where the machine cannot be run.
    pub(crate) fn judged(
        &self,
        structure: Structure,
        whitener: &Whitener,
    ) -> Result<Option<Judged>, GreyboxError> {
        if_run(
            fit(&self.train, structure, whitener)
                .and_then(|fitted| Judged::new(fitted, self.split(), whitener)),
        )
    }

    /// Trials of the first round, else those by which the noise was told, which are those of a fit that
    /// predicts `drive` where that is nearly what was predicted then.
    fn tried_before<'s>(&self, search: &'s Search, drive: &PerRecord) -> Before<'s> {
        if let Some(round) = search.rounds.first() {
            return Before::Elsewhere(&round.tried);
        }
        match &search.look {
            Some(look) if look.is_here(self.standing.as_ref(), drive, &search.floor.whitener) => {
                Before::Here(&look.tried)
            }
            Some(look) => Before::Elsewhere(&look.tried),
            None => Before::None,
        }
    }

    fn scan(&self, search: &Search, scales: &Scales) -> Result<Round, GreyboxError> {
        let (fitted, whitener) = (&search.current.fitted, &search.floor.whitener);
        let leads = self.leads(fitted, whitener, scales)?;
        let families = self.families(&leads);
        let state = fitted.structure.state(self.machine, &fitted.values);
        let drive = self.drive(fitted)?;
        let (problem, before) = (&self.train, self.tried_before(search, &drive));
        let trial = Trial { problem, state: &state, drive: &drive, whitener, scales, before };
        let tried = trial.run(&families)?;
        let scan = score(&families, &tried, fitted, whitener, self.options.seed);
        Ok(Round { families, tried, scan })
    }

    /// The best of a scan, refitted; where the model is far off also the best by plain likeness
    /// among the rest, and what does nothing in proportion to its size.
    fn rivals(
        &self,
        round: &Round,
        current: &Judged,
        whitener: &Whitener,
        scales: &Scales,
    ) -> Result<Vec<Rival>, GreyboxError> {
        let scored = &round.scan.scored;
        let questions = round.families.len() as f64;
        let worth = (0..scored.len()).filter(|&n| scored[n].log_p <= self.log_alone());
        let by_score: Vec<usize> = worth.take(self.options.refitted).collect();
        // where the model is far off the linear picture may be wrong
        let far_off = current.fitted.objective > self.train.samples() as f64;
        let rest = if far_off { 0..scored.len() } else { 0..0 };
        let rest = rest.filter(|n| !by_score.contains(n));
        let (nonlinear, mut by_likeness): (Vec<usize>, Vec<usize>) =
            rest.partition(|&n| is_nonlinear_in_size(round.families[scored[n].family].id));
        by_likeness.sort_by(|a, b| scored[*b].raw_cosine.total_cmp(&scored[*a].raw_cosine));
        by_likeness.truncate(3);
        let chosen = by_score.into_iter().chain(by_likeness).chain(nonlinear);
        let plausible = Plausible::new(self.machine, scales);
        let mut rivals: Vec<Rival> = Vec::new();
        let mut bar = f64::INFINITY;
        for place in chosen {
            let scored = &scored[place];
            if scored.visible_share < 0.01 || scored.energy <= 0.0 {
                continue;
            }
            let family = &round.families[scored.family];
            let outcome = Rival::new(
                Shortlisted {
                    scored,
                    tried: &round.tried[scored.tried],
                    family,
                    plausible,
                    questions,
                },
                current,
                self.split(),
                whitener,
                bar,
            );
            if let Some(rival) = if_run(outcome)? {
                bar = bar.min(rival.judged.fitted.objective);
                rivals.push(rival);
            }
        }
        Ok(rivals)
    }

    /// Logarithm of the chance that an effect alone may have, before the choice among all, by the scan
    /// and by its fit: what is held out does not name what was not seen in what was fitted.
    fn log_alone(&self) -> f64 {
        libm::log(self.options.false_alarm_rate)
    }

    /// Logarithm of the chance below which chance is out of the question.
    fn log_sure(&self) -> f64 {
        libm::log(self.options.sure_rate)
    }

    /// Tells whether an effect passes all gates beside others that explain so many nats.
    pub(crate) fn stands(&self, id: EffectId, claim: &Claim, explained: f64, alpha: f64) -> bool {
        let is_no_form = claim.fall >= MOST_FORM_SHARE * explained;
        claim.is_no_chance(alpha)
            && claim.log_p_alone <= self.log_alone()
            && self.is_held_out(&claim.gain, claim.log_p, claim.fits_there, is_no_form)
            && claim.score() > self.options.evidence_nats
            && !claim.on_bound
            && claim.fall >= form_share(id) * explained
    }

    /// Chance of a name where there is nothing, beside so many effects.
    pub(crate) fn alarm_rate(&self, found: usize) -> f64 {
        self.options.false_alarm_rate / f64::from(1_u32 << found)
    }

    /// Tells whether what was not fitted confirms an explanation. Where chance is out of the
    /// question,
    /// less is asked of it, and only what is expected where its command shows too little of the
    /// effect to say, or scatters too much.
    /// Less not so where it may be but what the form of an effect found leaves.
    ///
    /// Chance is out of the question by both together (`Gain::log_chance_with`).
    fn is_held_out(&self, gain: &Gain, log_p: f64, fits_there: bool, is_no_form: bool) -> bool {
        let wanted = self.options.gain_std_errors;
        let sure = gain.log_chance_with(log_p) <= self.log_sure();
        let less = if sure && is_no_form { 0.5 } else { 1.0 };
        gain.is_sure(less * wanted)
            || (sure && is_no_form && !fits_there && gain.is_as_expected())
            || (sure && gain.is_mute(wanted) && (gain.nats > LEAST_FITTED_GAIN || !fits_there))
    }

    /// Rivals that explain as much as the best, that it is no chance that they do, and that what
    /// is held out does not speak against. That there is something to be explained may stand by
    /// the best alone: they need not show it as surely.
    fn left_open<'r>(
        &self,
        best: &Judged,
        rivals: impl Iterator<Item = &'r Rival>,
        alpha: f64,
    ) -> Vec<Rival> {
        let is_open = |rival: &&Rival| {
            rival.claim.is_no_chance(alpha) && !rival.claim.on_bound && self.is_tied(rival, best)
        };
        rivals.filter(is_open).cloned().collect()
    }

    /// Rivals that may be there beside what was found: no chance, not confirmed, and as good as any
    /// other of these.
    fn unconfirmed(&self, current: &Judged, rivals: &[Rival], alpha: f64) -> Vec<Rival> {
        let mut open = self.left_open(current, rivals.iter(), alpha);
        let likelihood = |rival: &Rival| rival.claim.gain.nats + rival.judged.fit_over(current);
        let best = open.iter().max_by(|a, b| likelihood(a).total_cmp(&likelihood(b))).cloned();
        open.retain(|rival| best.as_ref().is_some_and(|best| self.is_tied(rival, &best.judged)));
        open
    }

    /// Tells whether a rival explains as much as the best, and what is held out does not speak
    /// against
    /// it.
    fn is_tied(&self, rival: &Rival, best: &Judged) -> bool {
        let is_refuted =
            rival.claim.gain.nats < -self.options.gain_std_errors * rival.claim.gain.std_error;
        !is_refuted && self.is_as_good(&rival.judged, best)
    }

    /// Tells whether a rival explains as much as the best, but for the half nat that each number
    /// more
    /// explains by chance. What its numbers and its shape cost does not count: that chance is not
    /// at work is settled for both.
    fn is_as_good(&self, rival: &Judged, best: &Judged) -> bool {
        let by_chance = 0.5 * (rival.numbers() as f64 - best.numbers() as f64);
        best.gain_over(rival).nats + best.fit_over(rival) + by_chance < self.options.tie_nats
    }

    /// Questions of the catalogue for the machine.
    pub(crate) fn families(&self, leads: &Leads) -> Vec<Family> {
        let mut families = families(self.machine.geometry(), leads, self.machine.is_axis());
        families.retain(|family| !self.options.without.contains(&family.id));
        // a controller that follows the motion is neither wrong nor misled
        if self.train.records.iter().any(|r| r.record.kind == CommandKind::Motion) {
            families.retain(|family| family.id.info().acts_through != LoopPart::Controller);
        }
        families
    }

    pub(crate) fn leads(
        &self,
        fitted: &Fitted,
        whitener: &Whitener,
        scales: &Scales,
    ) -> Result<Leads, GreyboxError> {
        let known = fitted.sensitivities.iter().map(|c| whitened(whitener, c)).collect();
        let state = fitted.structure.state(self.machine, &fitted.values);
        leads(&self.train, &state, &fitted.residuals, known, whitener, scales)
    }
}

/// The best rival of each kind but one, best first.
fn best_of_each(mut rivals: Vec<Rival>, but: EffectId) -> Vec<Rival> {
    rivals.sort_by(|a, b| b.claim.score().total_cmp(&a.claim.score()));
    let mut seen = vec![but];
    rivals.retain(|rival| {
        let new = !seen.contains(&rival.id);
        seen.push(rival.id);
        new
    });
    rivals
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::tests::nothing_recorded;

    /// A fit of so many numbers with a log-likelihood of what was fitted.
    fn judged(numbers: usize, train: f64) -> Judged {
        let none = Structure { effects: Vec::new(), free: Vec::new() };
        Judged::at(none, vec![0.0; numbers], vec![0.0; numbers], train)
    }

    #[test]
    fn what_is_as_likely_is_open_but_for_chance_numbers_and_what_refutes_it() {
        let (machine, recordings, options) = nothing_recorded();
        let session = Session::new(&machine, &recordings, &options);
        let is_open = |numbers, train, log_p, gain| {
            let rival = Rival::at(EffectId::Stribeck, judged(numbers, train), log_p, gain);
            session.left_open(&judged(2, 0.0), [&rival].into_iter(), 0.01).len() == 1
        };
        // passes neither the gate of gain nor that of evidence
        assert!(is_open(2, -4.6, -20.0, [-1.9, 1.0]));
        assert!(!is_open(2, -5.1, -20.0, [0.0, 1.0]), "explains less");
        assert!(!is_open(3, -4.6, -20.0, [0.0, 1.0]), "with one number more");
        assert!(is_open(1, -5.4, -20.0, [0.0, 1.0]), "with one number less");
        assert!(!is_open(2, 0.0, -20.0, [-2.1, 1.0]), "refuted");
        assert!(!is_open(2, 0.0, -4.0, [0.0, 1.0]), "chance");
        assert!(is_open(2, 0.0, -4.0, [1.0, 1.0]), "no chance with what is held out");
    }

    #[test]
    fn of_what_is_unconfirmed_the_best_are_open() {
        let (machine, recordings, options) = nothing_recorded();
        let session = Session::new(&machine, &recordings, &options);
        let rival = |id, train| Rival::at(id, judged(2, train), -20.0, [0.0, 1.0]);
        let rivals = [
            rival(EffectId::Stribeck, 30.0),
            rival(EffectId::Cogging, 26.0),
            rival(EffectId::Presliding, 20.0),
        ];
        let open = session.unconfirmed(&judged(2, 0.0), &rivals, 0.01);
        let ids: Vec<EffectId> = open.iter().map(|rival| rival.id).collect();
        assert_eq!(ids, [EffectId::Stribeck, EffectId::Cogging]);
    }
}
