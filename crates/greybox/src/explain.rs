//! The whole chain: fit, scan, refit, judge, decide.

use ema_sim::{EffectId, model_file::MachineModel};

use crate::{
    curve::{Hypothesis, ResidualCurve, curves, hypotheses, joined},
    elsewhere::elsewhere,
    error::GreyboxError,
    explained::{Explained, FaultChange, Finding, Use, Verdict},
    fit::{Fitted, fit, sandwich},
    floor::{Excess, Floor, pairs},
    hypothesis::{Family, Leads, Scales, families},
    machine::{Machine, Prediction},
    noise::{Whitener, rms},
    problem::{PerRecord, Problem},
    record::{Record, Recordings},
    response::{leads, travel},
    rival::{Judged, Rival},
    scan::{Scan, Tried, score, try_all},
    show::{RecordFit, along_coordinates, record_fits, remainder},
    structure::Structure,
    through_plant::ThroughPlant,
};

/// What decides, with the defaults that every report states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Seed of the draws of noise.
    pub seed: u64,
    /// Threads.
    pub jobs: usize,
    /// Family-wise chance of a name where there is nothing.
    pub false_alarm_rate: f64,
    /// Most effects looked for.
    pub most_effects: usize,
    /// Effects that are refitted in a round.
    pub refitted: usize,
    /// Standard errors by which the held-out likelihood has to rise.
    pub gain_std_errors: f64,
    /// Family-wise chance below which half of that is enough.
    pub sure_rate: f64,
    /// Nats by which the evidence has to rise.
    pub evidence_nats: f64,
    /// Nats, beside the standard errors, within which rivals are tied.
    pub tie_nats: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            seed: 0,
            jobs: 1,
            false_alarm_rate: 0.01,
            most_effects: 3,
            refitted: 6,
            gain_std_errors: 2.0,
            sure_rate: 1e-6,
            evidence_nats: 3.0,
            tie_nats: 5.0,
        }
    }
}

/// Says what a model misses in recordings of a machine in one state of health.
///
/// # Errors
///
/// [`GreyboxError`].
pub fn explain(
    model: &MachineModel,
    recordings: &Recordings,
    options: &Options,
) -> Result<Explained, GreyboxError> {
    recordings.check()?;
    let machine = Machine::new(model);
    let recordings = with_holdout(recordings);
    if let Some(reason) = insufficient(&machine, &recordings) {
        return Ok(Explained::inconclusive(reason));
    }
    Session::new(&machine, &recordings, options).run()
}

/// What the recordings lack, where they cannot answer.
fn insufficient(machine: &Machine, recordings: &Recordings) -> Option<String> {
    if recordings.holdout.is_empty() {
        return Some(
            "one recording alone cannot be fitted and judged on: give a second one, of another \
             command, with `--holdout`"
                .to_owned(),
        );
    }
    for record in recordings.all() {
        let name = &record.name;
        if record.position.is_none() {
            return Some(format!(
                "{name}: no position of the motor: causes cannot be told apart by the current alone"
            ));
        }
        let most = record.drive.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let at_most = record.drive.iter().filter(|x| x.abs() >= 0.999 * most).count();
        if at_most as f64 > CLIPPED_SHARE * record.drive.len() as f64 {
            let percent = 100.0 * at_most as f64 / record.drive.len() as f64;
            let unit = machine.drive_unit().to_uppercase();
            return Some(format!(
                "{name}: {percent:.0} % of the samples stand at {most} {unit}: the signal is clipped"
            ));
        }
    }
    None
}

/// Share of samples at the largest value from which a signal counts as clipped.
const CLIPPED_SHARE: f64 = 0.05;

/// Without a recording held out the last of several is.
pub(crate) fn with_holdout(recordings: &Recordings) -> Recordings {
    let mut recordings = recordings.clone();
    if recordings.holdout.is_empty() && recordings.train.len() > 1 {
        recordings.holdout.extend(recordings.train.pop());
    }
    recordings
}

/// Share of an effect below which damage and tolerances imitate it.
const ABSORBED_SHARE: f64 = 0.15;

/// Causes beside the best among which a recording is to tell.
const MOST_OPEN: usize = 3;

/// Whether an effect may act twice: ripples do, of different orders.
fn may_repeat(id: EffectId) -> bool {
    matches!(id, EffectId::Cogging | EffectId::CurrentRipple | EffectId::TransmissionError)
}

pub(crate) struct Session<'a> {
    machine: &'a Machine,
    options: &'a Options,
    train: Problem<'a>,
    holdout: Problem<'a>,
    repeat: Problem<'a>,
    pairs: Vec<(usize, usize)>,
}

/// An effect accepted in a round.
struct Found {
    rival: Rival,
    p_familywise: f64,
}

/// A fit with what it leaves of the recordings held out.
struct Seen<'f> {
    fitted: &'f Fitted,
    held_out: PerRecord,
}

/// Where the rounds ended.
struct Search {
    floor: Floor,
    before: Judged,
    current: Judged,
    found: Vec<Found>,
    /// Rivals of the first effect that explain as much.
    ties: Vec<Rival>,
    /// Of other kinds that stood the tests in the first round.
    runners_up: Vec<Rival>,
    first_round: Option<Round>,
    /// How each effect fared in the first round.
    tried: Vec<Hypothesis>,
    log: Vec<String>,
}

/// Everything that one scan made.
struct Round {
    families: Vec<Family>,
    tried: Vec<Tried>,
    scan: Scan,
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

impl<'a> Session<'a> {
    pub(crate) fn new(
        machine: &'a Machine,
        recordings: &'a Recordings,
        options: &'a Options,
    ) -> Self {
        let problem = |records: &'a [Record]| Problem::new(machine, records, options.jobs);
        Self {
            machine,
            options,
            train: problem(&recordings.train),
            holdout: problem(&recordings.holdout),
            repeat: problem(&recordings.repeat),
            pairs: pairs(recordings),
        }
    }

    fn run(&self) -> Result<Explained, GreyboxError> {
        let search = self.search()?;
        self.answer(search)
    }

    /// The explanations that the recordings leave open, the best first, with the noise. Without
    /// an effect found none.
    pub(crate) fn open(&self) -> Result<(Vec<(EffectId, Fitted)>, Whitener), GreyboxError> {
        let search = self.search()?;
        let Some(first) = search.found.first() else {
            return Ok((Vec::new(), search.floor.whitener));
        };
        let best = (first.rival.id, first.rival.judged.fitted.clone());
        // where nothing is tied the next best is asked for, to be sure
        let others = if search.ties.is_empty() {
            search.runners_up.iter().take(1)
        } else {
            search.ties.iter().take(MOST_OPEN)
        };
        let others = others.map(|r| (r.id, r.judged.fitted.clone()));
        Ok((std::iter::once(best).chain(others).collect(), search.floor.whitener))
    }

    /// Effects, one a round, until no other stands the tests.
    fn search(&self) -> Result<Search, GreyboxError> {
        let (floor, fitted) = self.floor(Structure::nominal(self.machine))?;
        let whitener = &floor.whitener;
        let before = Judged::new(fitted, &self.train, &self.holdout)?;
        let scales = self.scales(&before.fitted)?;
        let mut log = vec![format!(
            "nominal: holdout rms {:.5}, floor {:.5} ({:?}), order {}",
            before.holdout_rms,
            floor.rms,
            floor.source,
            whitener.order()
        )];
        let mut current = before.clone();
        let mut found: Vec<Found> = Vec::new();
        let (mut ties, mut runners_up, mut tried) = (Vec::new(), Vec::new(), Vec::new());
        let mut first_round = None;
        for round_number in 0..self.options.most_effects {
            let alpha = self.options.false_alarm_rate / f64::from(1_u32 << round_number);
            let round = self.scan(&current, whitener, &scales)?;
            let p_familywise = round.scan.p_familywise;
            log.extend(round.lines());
            let rivals = if p_familywise <= alpha {
                self.rivals(&round, &current, whitener, &scales)?
            } else {
                Vec::new()
            };
            log.extend(rivals.iter().map(|rival| rival.line(&round.families)));
            if first_round.is_none() {
                let of_family: Vec<EffectId> = round.families.iter().map(|f| f.id).collect();
                tried = hypotheses(&of_family, &round.scan, &rivals);
            }
            first_round.get_or_insert(round);
            let again = |rival: &Rival| {
                found.iter().any(|known| known.rival.id == rival.id) && !may_repeat(rival.id)
            };
            let accepted: Vec<Rival> = rivals
                .into_iter()
                .filter(|rival| self.accepts(rival, alpha) && !again(rival))
                .collect();
            let Some(winner) = accepted.iter().max_by(|a, b| a.score().total_cmp(&b.score()))
            else {
                break;
            };
            let problems = (&self.train, &self.holdout);
            let winner = winner.clone().settled(&current, problems, whitener)?;
            // a tie of the first effect is not asked again beside a second
            ties = if found.is_empty() { self.tied(&winner, &accepted) } else { Vec::new() };
            if found.is_empty() {
                runners_up = best_of_each(accepted, winner.id);
            }
            log.push(format!("round {round_number}: {}", winner.id.info().symbol));
            current = winner.judged.clone();
            found.push(Found { rival: winner, p_familywise });
        }
        Ok(Search { floor, before, current, found, ties, runners_up, first_round, tried, log })
    }

    fn answer(&self, search: Search) -> Result<Explained, GreyboxError> {
        let Search { floor, before, current, found, ties, first_round, tried, mut log, .. } =
            search;
        let whitener = &floor.whitener;
        let fitted = &current.fitted;
        let nominal = self.seen(&before.fitted, whitener)?;
        let now = self.seen(fitted, whitener)?;
        let something_left =
            self.is_something_left((&nominal, &now), current.holdout_rms, &floor, &mut log)?;
        let verdict = match (found.is_empty(), something_left) {
            (true, false) => Verdict::Adequate,
            (true, true) => Verdict::Unknown,
            (false, _) if !ties.is_empty() => Verdict::OneOf,
            (false, false) => Verdict::Named,
            (false, true) => Verdict::NamedWithRemainder,
        };
        let of = |(place, f): (usize, &Found)| self.finding(&current, whitener, place, f);
        let effects = found.iter().enumerate().map(of).collect();
        let p_familywise = found.last().map_or(1.0, |f| f.p_familywise);
        let alternative = |rival: &Rival| {
            let last = rival.judged.fitted.structure.effects.len() - 1;
            let found = Found { rival: rival.clone(), p_familywise };
            self.finding(&rival.judged, whitener, last, &found)
        };
        let state = fitted.structure.state(self.machine, &fitted.values);
        let remainder =
            if something_left { Some(remainder(self.machine, &self.train, &state)?) } else { None };
        let rough = self.machine.rough().iter().zip(&fitted.values);
        Ok(Explained {
            verdict,
            reason: None,
            effects,
            alternatives: ties.iter().map(alternative).collect(),
            absorbed: first_round.as_ref().map_or_else(Vec::new, absorbed),
            holdout_rms: Some([before.holdout_rms, current.holdout_rms]),
            noise_floor: Some((floor.rms, floor.source)),
            drive_unit: self.machine.drive_unit(),
            faults: self.fault_changes(&before, &current, whitener),
            rough: rough.map(|(rough, value)| (rough.key.clone(), rough.value, *value)).collect(),
            smallest_named_90: first_round.as_ref().map_or_else(Vec::new, |r| self.smallest(r)),
            records: self.record_fits(&nominal, &now, whitener)?,
            remainder,
            hypotheses: tried,
            curves: self.curves(&nominal, &now)?,
            log,
        })
    }

    /// Whether the recordings show more than the model and noise: by repetitions, by what the
    /// controller answered to, or where both are missing by the size of the residual.
    fn is_something_left(
        &self,
        (before, now): (&Seen<'_>, &Seen<'_>),
        holdout_rms: f64,
        floor: &Floor,
        log: &mut Vec<String>,
    ) -> Result<bool, GreyboxError> {
        let fitted = now.fitted;
        let excess = Excess::of_pairs(
            &fitted.structure,
            &fitted.values,
            &fitted.residuals,
            &self.repeat,
            (&self.pairs, &floor.whitener),
        )?;
        let (now, nominal) = (self.through_plant(now)?, self.through_plant(before)?);
        log.push(format!("left over: {excess:?}, {now:?}, of the nominal model {nominal:?}"));
        let plant = now.into_iter().zip(nominal).any(|(now, nominal)| now.is_there(nominal));
        // a model may fit what is held out and not what was fitted
        let worst_rms = holdout_rms.max(rms(&fitted.residuals.concat()));
        Ok(plant || excess.map_or_else(|| worst_rms > 1.05 * floor.rms, Excess::is_there))
    }

    /// What came through the plant in the recordings fitted and in those held out; nothing of
    /// these where an effect has another size in each.
    fn through_plant(&self, seen: &Seen<'_>) -> Result<Vec<ThroughPlant>, GreyboxError> {
        let fitted = seen.fitted;
        let (structure, values) = (&fitted.structure, &fitted.values);
        let state = structure.state(self.machine, values);
        let mut plant = vec![ThroughPlant::of(&self.train, &state, &fitted.residuals)?];
        if structure.by_record(values).is_empty() {
            plant.push(ThroughPlant::of(&self.holdout, &state, &seen.held_out)?);
        }
        Ok(plant.into_iter().flatten().collect())
    }

    /// A fit with what it leaves of the recordings held out.
    fn seen<'f>(&self, fitted: &'f Fitted, whitener: &Whitener) -> Result<Seen<'f>, GreyboxError> {
        let held_out = elsewhere(&self.holdout, &fitted.structure, &fitted.values, whitener)?;
        Ok(Seen { fitted, held_out })
    }

    fn record_fits(
        &self,
        before: &Seen<'_>,
        after: &Seen<'_>,
        whitener: &Whitener,
    ) -> Result<Vec<(Use, RecordFit, RecordFit)>, GreyboxError> {
        let mut fits = Vec::new();
        let mut add = |role: Use, problem: &Problem<'_>, nominal: &PerRecord, found: &PerRecord| {
            let pairs = record_fits(problem, nominal, whitener)
                .into_iter()
                .zip(record_fits(problem, found, whitener));
            fits.extend(pairs.map(|(a, b)| (role, a, b)));
        };
        add(Use::Train, &self.train, &before.fitted.residuals, &after.fitted.residuals);
        add(Use::Holdout, &self.holdout, &before.held_out, &after.held_out);
        let of = |seen: &Seen<'_>| {
            elsewhere(&self.repeat, &seen.fitted.structure, &seen.fitted.values, whitener)
        };
        add(Use::Repeat, &self.repeat, &of(before)?, &of(after)?);
        Ok(fits)
    }

    /// Residuals over the coordinates, of what was fitted and of what was held out.
    fn curves(
        &self,
        before: &Seen<'_>,
        now: &Seen<'_>,
    ) -> Result<Vec<ResidualCurve>, GreyboxError> {
        let after = now.fitted;
        let state = after.structure.state(self.machine, &after.values);
        let mut along = along_coordinates(self.machine, &self.train, &state)?;
        let state = after.structure.state_elsewhere(self.machine, &after.values);
        let there = along_coordinates(self.machine, &self.holdout, &state)?;
        for (all, more) in along.iter_mut().zip(there) {
            all.extend(more);
        }
        let before = joined([&before.fitted.residuals, &before.held_out]);
        let after = joined([&after.residuals, &now.held_out]);
        Ok(curves(self.machine, &along, &before, &after))
    }

    /// The nominal fit and the noise.
    fn floor(&self, nominal: Structure) -> Result<(Floor, Fitted), GreyboxError> {
        if let Some(floor) = Floor::of_pairs(&self.train, &self.repeat, &self.pairs) {
            let fitted = fit(&self.train, nominal, &floor.whitener)?;
            return Ok((floor, fitted));
        }
        let guess = Whitener::white(rough_noise(&self.train));
        let fitted = fit(&self.train, nominal.clone(), &guess)?;
        let scales = self.scales(&fitted)?;
        let drive = self.drive(&fitted)?;
        let leads = self.leads(&fitted, &guess, &scales)?;
        let families = families(self.machine.geometry(), &leads, self.machine.is_axis());
        let state = fitted.structure.state(self.machine, &fitted.values);
        let tried = try_all(&self.train, &state, &drive, &families, &guess, &scales)?;
        let mut columns: Vec<&PerRecord> = fitted.sensitivities.iter().collect();
        columns.extend(tried.iter().flat_map(|t| &t.columns));
        let floor = Floor::of_saturated(&fitted.residuals, &columns);
        let fitted = fit(&self.train, nominal, &floor.whitener)?;
        Ok((floor, fitted))
    }

    fn drive(&self, fitted: &Fitted) -> Result<PerRecord, GreyboxError> {
        let state = fitted.structure.state(self.machine, &fitted.values);
        Ok(self.train.drives(&[state])?.remove(0))
    }

    fn scales(&self, fitted: &Fitted) -> Result<Scales, GreyboxError> {
        let state = fitted.structure.state(self.machine, &fitted.values);
        let predictions: Vec<Prediction> = self.train.predictions(&state)?;
        let all = |of: fn(&Prediction) -> &Vec<f64>| -> f64 {
            let squares: f64 = predictions.iter().flat_map(|p| of(p).iter().map(|x| x * x)).sum();
            let count: usize = predictions.iter().map(|p| of(p).len()).sum();
            libm::sqrt(squares / count.max(1) as f64)
        };
        let drive = all(|p| &p.drive);
        Ok(Scales {
            torque: drive * self.machine.constant(),
            drive,
            speed: all(|p| &p.speed),
            travel: travel(&predictions, |p| &p.surface).1,
            motor_travel: travel(&predictions, |p| &p.motor).1,
            sample_s: 1.0 / self.train.records[0].record.rate_hz,
        })
    }

    fn leads(
        &self,
        fitted: &Fitted,
        whitener: &Whitener,
        scales: &Scales,
    ) -> Result<Leads, GreyboxError> {
        let known =
            fitted.sensitivities.iter().map(|c| crate::fit::whitened(whitener, c)).collect();
        let state = fitted.structure.state(self.machine, &fitted.values);
        leads(&self.train, &state, (&fitted.residuals, known), whitener, scales)
    }

    fn scan(
        &self,
        current: &Judged,
        whitener: &Whitener,
        scales: &Scales,
    ) -> Result<Round, GreyboxError> {
        let fitted = &current.fitted;
        let leads = self.leads(fitted, whitener, scales)?;
        let families = families(self.machine.geometry(), &leads, self.machine.is_axis());
        let state = fitted.structure.state(self.machine, &fitted.values);
        let drive = self.drive(fitted)?;
        let tried = try_all(&self.train, &state, &drive, &families, whitener, scales)?;
        let scan = score(&families, &tried, fitted, whitener, self.options.seed);
        Ok(Round { families, tried, scan })
    }

    /// The best of a scan, and the best by plain likeness among the rest, refitted.
    fn rivals(
        &self,
        round: &Round,
        current: &Judged,
        whitener: &Whitener,
        scales: &Scales,
    ) -> Result<Vec<Rival>, GreyboxError> {
        let scored = &round.scan.scored;
        let questions = round.families.len() as f64;
        let alone = libm::log(self.options.false_alarm_rate);
        let worth = scored.iter().filter(|s| s.log_p <= alone).count();
        let by_score: Vec<usize> = (0..worth.min(self.options.refitted)).collect();
        let mut by_likeness: Vec<usize> = (by_score.len()..scored.len()).collect();
        by_likeness.sort_by(|a, b| scored[*b].raw_cosine.total_cmp(&scored[*a].raw_cosine));
        // where the model is far off the linear picture may be wrong
        let far_off = current.fitted.objective > self.train.samples() as f64;
        by_likeness.truncate(if far_off { 3 } else { 0 });
        let chosen = by_score.into_iter().chain(by_likeness);
        let mut rivals: Vec<Rival> = Vec::new();
        let mut bar = f64::INFINITY;
        for place in chosen {
            let scored = &scored[place];
            if scored.visible_share < 0.01 || scored.energy <= 0.0 {
                continue;
            }
            let family = &round.families[scored.family];
            let outcome = Rival::new(
                (scored, &round.tried[scored.tried], family),
                current,
                (&self.train, &self.holdout),
                whitener,
                (scales.travel, questions),
                bar,
            );
            match outcome {
                Ok(rival) => {
                    bar = bar.min(rival.judged.fitted.objective);
                    rivals.push(rival);
                }
                // at such sizes the machine cannot be run: no explanation
                Err(GreyboxError::Simulation { .. } | GreyboxError::NotFinite { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(rivals)
    }

    fn accepts(&self, rival: &Rival, alpha: f64) -> bool {
        rival.log_p <= libm::log(alpha)
            && rival.gain > self.wanted_std_errors(rival) * rival.gain_std
            && rival.evidence > self.options.evidence_nats
            && !rival.on_bound
    }

    /// Where chance is out of the question in what was fitted, less is asked of what was not.
    fn wanted_std_errors(&self, rival: &Rival) -> f64 {
        let sure = rival.log_p <= libm::log(self.options.sure_rate);
        self.options.gain_std_errors * if sure { 0.5 } else { 1.0 }
    }

    /// Rivals of another kind that explain as much as the winner.
    fn tied(&self, winner: &Rival, accepted: &[Rival]) -> Vec<Rival> {
        let as_good = |rival: &&Rival| {
            let (lead, std) = winner.judged.gain_over(&rival.judged);
            lead < self.options.gain_std_errors * std
                && winner.score() - rival.score() < self.options.tie_nats
        };
        best_of_each(accepted.iter().filter(as_good).cloned().collect(), winner.id)
    }

    fn finding(
        &self,
        judged: &Judged,
        whitener: &Whitener,
        place: usize,
        found: &Found,
    ) -> Finding {
        let fitted = &judged.fitted;
        let effect = fitted.structure.effects_at(self.machine, &fitted.values).swap_remove(place);
        let covariance = sandwich(fitted, &self.train, whitener);
        let interval = |p: usize| {
            let (value, std) = (fitted.values[p], libm::sqrt(covariance[(p, p)].max(0.0)));
            (fitted.structure.free[p].key.clone(), [value - 1.96 * std, value + 1.96 * std])
        };
        Finding {
            effect,
            interval_95: fitted
                .structure
                .places_of_effect(place)
                .into_iter()
                .map(interval)
                .collect(),
            p_familywise: found.p_familywise,
            holdout_gain_nats: found.rival.gain,
            holdout_gain_se: found.rival.gain_std,
            evidence_nats: found.rival.evidence,
        }
    }

    fn fault_changes(
        &self,
        before: &Judged,
        after: &Judged,
        whitener: &Whitener,
    ) -> Vec<FaultChange> {
        let own_before = sandwich(&before.fitted, &self.train, before.own_noise());
        let own_after = sandwich(&after.fitted, &self.train, whitener);
        let places = before.fitted.structure.free.iter().enumerate();
        let is_fault = |free: &crate::structure::Free| {
            matches!(free.target, crate::structure::Target::Fault(_))
        };
        places
            .filter(|(_, free)| is_fault(free))
            .map(|(p, free)| FaultChange {
                key: free.key.clone(),
                before: before.fitted.values[p],
                std_before: libm::sqrt(own_before[(p, p)].max(0.0)),
                after: after.fitted.values[p],
                std_after: libm::sqrt(own_after[(p, p)].max(0.0)),
            })
            .collect()
    }

    /// The size at which an effect would have been named nine times in ten: its projected
    /// energy exceeds the threshold of the scan by 1.28 standard deviations.
    fn smallest(&self, round: &Round) -> Vec<(EffectId, String, f64)> {
        let geometry = self.machine.geometry();
        let chance = self.options.false_alarm_rate / round.families.len().max(1) as f64;
        let threshold = libm::sqrt(-2.0 * libm::log(chance));
        let of = |scored: &crate::scan::Scored| {
            let tried = &round.tried[scored.tried];
            let &(place, size) = tried.sizes.first()?;
            if scored.energy <= 0.0 {
                return None;
            }
            let id = tried.plain.id();
            let key = id.info().parameters[place].key(geometry).to_owned();
            let smallest = size.abs() * (threshold + 1.2816) / libm::sqrt(scored.energy);
            Some((id, key, smallest))
        };
        round.scan.scored.iter().filter_map(of).collect()
    }
}

/// The best rival of each kind but one, best first.
fn best_of_each(mut rivals: Vec<Rival>, but: EffectId) -> Vec<Rival> {
    rivals.sort_by(|a, b| b.score().total_cmp(&a.score()));
    let mut seen = vec![but];
    rivals.retain(|rival| {
        let new = !seen.contains(&rival.id);
        seen.push(rival.id);
        new
    });
    rivals
}

fn absorbed(round: &Round) -> Vec<EffectId> {
    let mut ids: Vec<EffectId> = round
        .scan
        .scored
        .iter()
        .filter(|scored| scored.visible_share < ABSORBED_SHARE && scored.visible_share > 0.0)
        .map(|scored| round.families[scored.family].id)
        .collect();
    ids.sort();
    ids.dedup();
    ids
}

/// Noise by second differences of the measured signals: a first guess.
fn rough_noise(problem: &Problem<'_>) -> f64 {
    let differences: Vec<f64> = problem
        .records
        .iter()
        .flat_map(|r| r.measured.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]) / libm::sqrt(6.0)))
        .collect();
    rms(&differences).max(1e-9)
}
