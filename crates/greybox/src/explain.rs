//! The whole chain: fit, scan, refit, judge, decide.

use ema_sim::{EffectId, MachineSignals, model_file::MachineModel};
use inference::{Whitener, rms};

use crate::{
    ambiguous::ambiguous,
    curve::{ResidualCurve, curves, joined},
    elsewhere::elsewhere,
    error::{GreyboxError, if_run},
    explained::{
        Explained, FaultChange, Finding, NumberFit, NumberInterval, RecordChange, Use, Verdict,
    },
    fit::{Fitted, fit, fit_below, fit_roughly},
    floor::{Excess, Floor, pairs, rms_std},
    hypothesis::Scales,
    interval::{Z_95, hold_off_zero, levels},
    machine::{Machine, Rough},
    observation::Observation,
    observing::{AllAnchors, Place},
    problem::{PerRecord, Problem, Split},
    record::{Record, Recordings},
    response::travel,
    rival::{GOOD_PER_SAMPLE, Judged, Rival},
    scan::Scored,
    search::{Floored, Found, Look, Round, Search},
    show::{RecordFit, along_coordinates, record_fits, remainder},
    signal_chain::{Signals, sound, standing},
    structure::Structure,
    suspects::with_suspects,
    through_plant::ThroughPlant,
    trial::{Before, Trial},
};

/// Thresholds and limits that decide, with the defaults that every report states.
#[derive(Clone, Debug, PartialEq)]
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
    /// Standard errors by which the held-out likelihood has to rise, and standard deviations by which
    /// one of the sizes of an effect has to differ from zero.
    pub gain_std_errors: f64,
    /// Chance, by fit and hold-out together, below which half of that is enough, or what is expected
    /// of a hold-out that cannot tell. Beside what was found a fit alone that is less likely by
    /// chance is a remainder.
    pub sure_rate: f64,
    /// Nats by which the evidence of all recordings has to rise.
    pub evidence_nats: f64,
    /// Nats of likelihood, fitted and held out together, within which rivals are tied.
    pub tie_nats: f64,
    /// Effects that the machine cannot have: they are not looked for.
    pub without: Vec<EffectId>,
    /// Keys of numbers of the model file that are exact. All others may be off within the tolerance
    /// that the file states, else within the usual one (`docs/models/tolerances.md`).
    pub exact: Vec<String>,
    /// Model that predicts what recordings show; `None`: the one under which they are likeliest.
    pub observation: Option<Observation>,
    /// Use that is made of the signal chain.
    pub signals: Signals,
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
            sure_rate: 1e-5,
            evidence_nats: 3.0,
            tie_nats: 5.0,
            without: Vec::new(),
            exact: Vec::new(),
            observation: None,
            signals: Signals::default(),
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
    if let Some(reason) = insufficient(&recordings) {
        return Ok(Explained::inconclusive(reason));
    }
    let (recordings, finds) = sound(&machine, recordings, options.signals, options.jobs)?;
    if standing(&finds).is_some() {
        return Ok(Explained::unsound(finds));
    }
    let machine = with_suspects(&machine, &recordings, &options.exact, options.jobs)?;
    let mut explained = match Session::new(&machine, &recordings, options).run() {
        Err(few @ GreyboxError::FewSamples { .. }) => Explained::inconclusive(few.to_string()),
        answered => answered?,
    };
    explained.signals = finds;
    Ok(explained)
}

/// Lack of the recordings, where they cannot answer.
fn insufficient(recordings: &Recordings) -> Option<String> {
    if recordings.holdout.is_empty() {
        return Some(
            "one recording alone cannot be fitted and judged on: give a second one, of another \
             command, with `--holdout`"
                .to_owned(),
        );
    }
    let blind = recordings.all().find(|record| record.position.is_none())?;
    Some(format!(
        "{}: no position of the motor: causes cannot be told apart by the current alone",
        blind.name
    ))
}

/// Recordings of which the last of several to fit is held out where none is.
pub fn with_holdout(recordings: &Recordings) -> Recordings {
    let mut recordings = recordings.clone();
    if recordings.holdout.is_empty() && recordings.train.len() > 1 {
        recordings.holdout.extend(recordings.train.pop());
    }
    recordings
}

/// Size of a residual over that of the noise from which on something is left.
const LEAST_LEFT: f64 = 1.05;

/// Share of an effect below which damage and tolerances imitate it.
const ABSORBED_SHARE: f64 = 0.15;

/// Friction and backlash levels, k1 and k2, from which the nominal model is fitted too.
const WORN: [[f64; 2]; 3] = [[0.4, 0.0], [0.0, 0.2], [0.4, 0.2]];

/// Causes beside the best among which a recording is to tell.
const MOST_OPEN: usize = 3;

pub(crate) struct Session<'a> {
    pub(crate) machine: &'a Machine,
    pub(crate) options: &'a Options,
    pub(crate) train: Problem<'a>,
    pub(crate) holdout: Problem<'a>,
    pub(crate) repeat: Problem<'a>,
    /// Place to which the predictions were moved, if any.
    pub(crate) standing: Option<Place>,
    /// Noise of the sensors, once predictions were moved: it is the same wherever they stand.
    pub(crate) sensor_noise: Option<f64>,
    pairs: Vec<(usize, usize)>,
}

/// A fit with what it leaves of all recordings, seen from where the prediction stood for it.
struct Seen<'f> {
    judged: &'f Judged,
    /// Residuals of the recordings held out at its own numbers.
    held_out: PerRecord,
    /// Residuals of what was fitted and of what was held out, in their own unit.
    in_unit: [PerRecord; 2],
    fits: Vec<(Use, RecordFit)>,
    plant: Vec<ThroughPlant>,
}

impl Seen<'_> {
    /// Root mean square of what was held out, in its own unit.
    fn held_out_rms(&self) -> f64 {
        rms(&self.in_unit[1].concat())
    }

    /// Size of the residual held out in its own unit over that of equal noise.
    fn unit(&self) -> f64 {
        self.held_out_rms() / rms(&self.held_out.concat()).max(f64::MIN_POSITIVE)
    }
}

impl<'a> Session<'a> {
    pub(crate) fn new(
        machine: &'a Machine,
        recordings: &'a Recordings,
        options: &'a Options,
    ) -> Self {
        let problem = |records: &'a [Record]| Problem::new(machine, records, options.jobs);
        let (mut train, mut repeat) = (problem(&recordings.train), problem(&recordings.repeat));
        let pairs = pairs(recordings);
        train.leave_out_alike(&mut repeat, &pairs);
        Self {
            machine,
            options,
            train,
            holdout: problem(&recordings.holdout),
            repeat,
            standing: None,
            sensor_noise: None,
            pairs,
        }
    }

    /// Recordings to fit and recordings held out.
    pub(crate) fn split(&self) -> Split<'_> {
        Split { train: &self.train, holdout: &self.holdout }
    }

    fn run(&mut self) -> Result<Explained, GreyboxError> {
        let search = self.search()?;
        self.answer(search)
    }

    /// The explanations that the recordings leave open, the best first, with the noise. Without
    /// an effect found none.
    pub(crate) fn open(&mut self) -> Result<(Vec<(EffectId, Fitted)>, Whitener), GreyboxError> {
        let search = self.search()?;
        let Some(first) = search.found.first() else {
            return Ok((Vec::new(), search.floor.whitener));
        };
        // one cause at a time, the first in doubt
        let (in_doubt, ties) = match (&search.ties[..], search.found.last()) {
            ([], Some(last)) if !search.last_ties.is_empty() => (last, &search.last_ties),
            _ => (first, &search.ties),
        };
        let best = (in_doubt.rival.id, search.current.fitted.clone());
        // where nothing is tied the next best is asked for, to be sure
        let others = if ties.is_empty() {
            search.runners_up.iter().take(1)
        } else {
            ties.iter().take(MOST_OPEN)
        };
        let others = others.map(|r| (r.id, r.judged.fitted.clone()));
        Ok((std::iter::once(best).chain(others).collect(), search.floor.whitener))
    }

    fn answer(&mut self, search: Search) -> Result<Explained, GreyboxError> {
        let is_more_there = search.is_more_beside_found();
        self.put_back(&search.anchors);
        let smallest_named_90 = self.detection_limits(&search)?;
        let Search { floor, before, current, found, rounds, tried, mut log, .. } = search;
        let first_round = rounds.first();
        let (ties, last_ties) = (search.ties, search.last_ties);
        let whitener = &floor.whitener;
        self.put_back(&search.anchors_before);
        let before = self.profiled(before, whitener)?;
        let nominal = self.seen_from(&search.anchors_before, &before, whitener)?;
        self.put_back(&search.anchors);
        let current = self.profiled_beside(current, &before, whitener)?;
        let fitted = &current.fitted;
        let numbers = self.wrong_numbers(&current, whitener)?;
        let now = self.seen_from(&search.anchors, &current, whitener)?;
        let something_left =
            self.is_something_left(&nominal, &now, &floor, search.observation, &mut log)?
                || is_more_there;
        let verdict = match (found.is_empty() && numbers.is_empty(), something_left) {
            (true, false) => match first_round {
                Some(round) if self.may_be_an_effect(&current, round, whitener) => {
                    Verdict::Absorbed
                }
                _ => Verdict::Adequate,
            },
            (true, true) => Verdict::Unknown,
            // beside a number alone nothing is named of what is left
            (false, true) if found.is_empty() => Verdict::Unknown,
            (false, true) => Verdict::NamedWithRemainder,
            (false, false) if !(ties.is_empty() && last_ties.is_empty()) => Verdict::OneOf,
            (false, false) => Verdict::Named,
        };
        let open = ties.iter().chain(&last_ties).chain(&search.unconfirmed);
        let open = open.map(|rival| &rival.judged);
        let faults = self.fault_changes(&before, &current, open, whitener)?;
        // what explains most comes first, but the one that others are tied with before it
        let mut by_strength: Vec<(usize, &Found)> = found.iter().enumerate().collect();
        let first = usize::from(!ties.is_empty());
        by_strength[first..]
            .sort_by(|(_, a), (_, b)| b.rival.claim.fall.total_cmp(&a.rival.claim.fall));
        let of = |(place, f): (usize, &Found)| self.finding(&current, whitener, place, f);
        let effects = by_strength.into_iter().map(of).collect();
        let alternative = |(place, rival): (usize, Rival)| {
            let (judged, instead) = (rival.judged.clone(), &found[place]);
            let found = Found { rival, p_familywise: instead.p_familywise };
            let finding = self.finding(&judged, whitener, place, &found);
            Finding { instead_of: Some(instead.rival.id), ..finding }
        };
        let last = found.len().saturating_sub(1);
        let ties = ties.into_iter().map(|rival| (0, rival));
        let alternatives = ties.chain(last_ties.into_iter().map(|rival| (last, rival)));
        let alternatives = alternatives.map(alternative).collect();
        let state = fitted.structure.state(self.machine, &fitted.values);
        let remainder =
            if something_left { Some(remainder(self.machine, &self.train, &state)?) } else { None };
        Ok(Explained {
            verdict,
            reason: None,
            effects,
            alternatives,
            numbers,
            absorbed: first_round.map_or_else(Vec::new, absorbed),
            holdout_rms: Some([&nominal, &now].map(Seen::held_out_rms)),
            noise_floor: Some(floor.level(now.unit())),
            observation: Some(search.observation),
            drive_unit: self.machine.drive_unit(),
            faults,
            rough: rough_fits(self.machine, &state.rough),
            smallest_named_90,
            records: record_changes(&nominal, &now),
            remainder,
            hypotheses: tried,
            curves: self.curves(&nominal, &now)?,
            signals: Vec::new(),
            log,
        })
    }

    /// Tells whether damage that was found is imitated by an effect that these recordings cannot
    /// tell from damage and tolerance.
    fn may_be_an_effect(&self, current: &Judged, round: &Round, whitener: &Whitener) -> bool {
        let fitted = &current.fitted;
        let covariance = current.covariance(&self.train, whitener);
        let scored = round.scan.scored.iter().filter(|scored| is_absorbed(scored));
        scored.filter_map(|scored| scored.imitated_by).any(|p| fitted.finds_damage(p, &covariance))
    }

    /// Tells whether the recordings show more than the model and noise: by repetitions, by what the
    /// controller answered to, or where both are missing by the size of the residual.
    fn is_something_left(
        &self,
        before: &Seen<'_>,
        now: &Seen<'_>,
        floor: &Floor,
        observation: Observation,
        log: &mut Vec<String>,
    ) -> Result<bool, GreyboxError> {
        let Judged { fitted, held_out, .. } = now.judged;
        let excess = Excess::of_pairs(
            &fitted.structure,
            &fitted.values,
            &fitted.residuals,
            &self.repeat,
            &self.pairs,
            &floor.whitener,
        )?;
        let (now, nominal) = (&now.plant, &before.plant);
        log.push(format!("left over: {excess:?}, {now:?}, of the nominal model {nominal:?}"));
        let plant = now.iter().zip(nominal).any(|(now, nominal)| now.is_there(*nominal));
        // a model may fit what is held out and not what was fitted
        let worst = floor.times(&held_out.residuals).max(floor.times(&fitted.residuals));
        let fitted_std = rms_std(&self.train, &fitted.residuals);
        let by_chance = 3.0 * libm::hypot(fitted_std, rms_std(&self.holdout, &held_out.residuals));
        let most = if observation == Observation::Ideal {
            LEAST_LEFT.max(1.0 + by_chance)
        } else {
            LEAST_LEFT + by_chance
        };
        Ok(plant || excess.map_or_else(|| worst > most, Excess::is_there))
    }

    /// Part that came through the plant in the recordings fitted and in those held out, there at
    /// the
    /// numbers as both have them; nothing of these where an effect has another size in each.
    fn through_plant(
        &self,
        judged: &Judged,
        there: &PerRecord,
    ) -> Result<Vec<ThroughPlant>, GreyboxError> {
        let Judged { fitted, held_out, .. } = judged;
        let Fitted { structure, values, residuals, .. } = fitted;
        let state = structure.state(self.machine, values);
        let mut plant = vec![ThroughPlant::of(&self.train, &state, residuals)?];
        if structure.by_record(values).is_empty() {
            let moved = structure.state(self.machine, &held_out.values);
            let drives = if_run(self.holdout.drives(core::slice::from_ref(&moved)))?;
            plant.push(match drives.as_deref() {
                Some([drive, ..]) => {
                    let residuals = self.holdout.residuals(drive);
                    ThroughPlant::of(&self.holdout, &moved, &residuals)?
                }
                _ => ThroughPlant::of(&self.holdout, &state, there)?,
            });
        }
        Ok(plant.into_iter().flatten().collect())
    }

    /// A fit with what it leaves of all recordings, the prediction standing where it stood for it.
    fn seen_from<'f>(
        &mut self,
        anchors: &AllAnchors,
        judged: &'f Judged,
        whitener: &Whitener,
    ) -> Result<Seen<'f>, GreyboxError> {
        self.put_back(anchors);
        let Fitted { structure, values, residuals, .. } = &judged.fitted;
        let held_out = elsewhere(&self.holdout, structure, values, whitener)?;
        let repeated = elsewhere(&self.repeat, structure, values, whitener)?;
        let mut fits = Vec::new();
        for (role, problem, residuals) in [
            (Use::Train, &self.train, residuals),
            (Use::Holdout, &self.holdout, &held_out),
            (Use::Repeat, &self.repeat, &repeated),
        ] {
            let of = record_fits(problem, residuals, whitener).into_iter();
            fits.extend(of.map(|fit| (role, fit)));
        }
        let in_unit = [self.train.in_their_unit(residuals), self.holdout.in_their_unit(&held_out)];
        let plant = self.through_plant(judged, &held_out)?;
        Ok(Seen { judged, held_out, in_unit, fits, plant })
    }

    /// Residuals over the coordinates, of what was fitted and of what was held out.
    fn curves(
        &self,
        before: &Seen<'_>,
        now: &Seen<'_>,
    ) -> Result<Vec<ResidualCurve>, GreyboxError> {
        let after = &now.judged.fitted;
        let state = after.structure.state(self.machine, &after.values);
        let mut along = along_coordinates(self.machine, &self.train, &state)?;
        let state = after.structure.state_elsewhere(self.machine, &after.values);
        let there = along_coordinates(self.machine, &self.holdout, &state)?;
        for (all, more) in along.iter_mut().zip(there) {
            all.extend(more);
        }
        let [before, after] = [before, now].map(|seen| joined(&seen.in_unit));
        Ok(curves(self.machine, &along, &before, &after))
    }

    /// The nominal fit and the noise, with what was tried to tell it.
    pub(crate) fn floor(&self, nominal: &Structure) -> Result<Floored, GreyboxError> {
        if let Some(floor) = Floor::of_pairs(&self.train, &self.repeat, &self.pairs) {
            let fitted = self.nominal(nominal, &floor.whitener)?;
            return Ok(Floored { floor, fitted, look: None });
        }
        let (fitted, guess) = fit_roughly(&self.train, nominal)?;
        let scales = self.scales(&fitted)?;
        let drive = self.drive(&fitted)?;
        let leads = self.leads(&fitted, &guess, &scales)?;
        let families = self.families(&leads);
        let state = fitted.structure.state(self.machine, &fitted.values);
        let tried = Trial {
            problem: &self.train,
            state: &state,
            drive: &drive,
            whitener: &guess,
            scales: &scales,
            before: Before::None,
        };
        let tried = tried.run(&families)?;
        let mut columns: Vec<&PerRecord> = fitted.sensitivities.iter().collect();
        columns.extend(tried.iter().flat_map(|t| &t.columns));
        let floor = Floor::of_saturated(&fitted.residuals, &columns)?;
        let look = Some(Look { standing: self.standing.clone(), drive, tried });
        let fitted = self.nominal(nominal, &floor.whitener)?;
        Ok(Floored { floor, fitted, look })
    }

    /// The model without an effect, fitted from health, and where that leaves something also from
    /// far gone wear, which bends the fit on its way.
    fn nominal(&self, nominal: &Structure, whitener: &Whitener) -> Result<Fitted, GreyboxError> {
        let mut best = fit(&self.train, nominal.clone(), whitener)?;
        for levels in WORN {
            if best.objective < GOOD_PER_SAMPLE * self.train.samples() as f64 {
                break;
            }
            let worn = nominal.clone().started_worn(levels);
            let fitted = fit_below(&self.train, worn, whitener, best.objective)?;
            if fitted.objective < best.objective {
                best = fitted;
            }
        }
        if !self.machine.has_suspects() {
            return Ok(best);
        }
        // damage and numbers that do the same lead one another astray: once more from health
        let healthy = best.structure.clone().started_at(&best.values).started_healthy();
        let fitted = fit_below(&self.train, healthy, whitener, best.objective)?;
        Ok(if fitted.objective < best.objective { fitted } else { best })
    }

    pub(crate) fn drive(&self, fitted: &Fitted) -> Result<PerRecord, GreyboxError> {
        let state = fitted.structure.state(self.machine, &fitted.values);
        Ok(self.train.drives(&[state])?.remove(0))
    }

    pub(crate) fn scales(&self, fitted: &Fitted) -> Result<Scales, GreyboxError> {
        let state = fitted.structure.state(self.machine, &fitted.values);
        let predictions: Vec<MachineSignals> = self.train.predictions(&state)?;
        let all = |of: fn(&MachineSignals) -> &Vec<f64>| -> f64 {
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

    fn finding(
        &self,
        judged: &Judged,
        whitener: &Whitener,
        place: usize,
        found: &Found,
    ) -> Finding {
        let fitted = &judged.fitted;
        let effect = fitted.structure.effects_at(self.machine, &fitted.values).swap_remove(place);
        let covariance = judged.covariance(&self.train, whitener);
        let interval = |p: usize| {
            let (value, std) = (fitted.values[p], libm::sqrt(covariance[(p, p)].max(0.0)));
            let interval_95 = [value - Z_95 * std, value + Z_95 * std];
            NumberInterval { key: fitted.structure.free[p].key.clone(), interval_95 }
        };
        // what differs between recordings has a key for each, of which the first is told
        let mut intervals: Vec<NumberInterval> = Vec::new();
        for one in fitted.structure.places_of_effect(place).into_iter().map(interval) {
            if intervals.iter().all(|known| known.key != one.key) {
                intervals.push(one);
            }
        }
        hold_off_zero(&mut intervals, fitted, place, found.rival.claim.fall);
        Finding {
            effect,
            interval_95: intervals,
            p_familywise: found.p_familywise,
            holdout_gain_nats: found.rival.claim.gain.nats,
            holdout_gain_se: found.rival.claim.gain.std_error,
            evidence_nats: found.rival.claim.evidence,
            instead_of: None,
        }
    }

    /// Levels without and with what was found; their intervals in the end hold those of all
    /// that is left open.
    fn fault_changes<'j>(
        &self,
        before: &Judged,
        after: &Judged,
        open: impl Iterator<Item = &'j Judged>,
        whitener: &Whitener,
    ) -> Result<Vec<FaultChange>, GreyboxError> {
        let levels_of =
            |judged: &Judged, noise| levels(&judged.fitted, &judged.covariance(&self.train, noise));
        let was = levels_of(before, before.own_noise());
        let covariance = after.covariance(&self.train, whitener);
        let mut is = levels(&after.fitted, &covariance);
        for other in open {
            for ((_, level), (_, other)) in is.iter_mut().zip(levels_of(other, whitener)) {
                let ([low, high], [least, most]) = (level.interval_95, other.interval_95);
                level.interval_95 = [low.min(least), high.max(most)];
            }
        }
        let mut ambiguous = ambiguous(&after.fitted, &covariance, whitener);
        for (key, level) in &mut is {
            let place = after.fitted.structure.free.iter().position(|free| free.key == *key);
            if let Some(place) = place.filter(|_| ambiguous.iter().any(|(of, _)| of == key)) {
                let within = level.interval_95;
                level.interval_95 =
                    self.likelihood_interval(&after.fitted, place, within, whitener)?;
            }
        }
        let change = |((key, before), (_, after)): ((String, _), (_, _))| {
            let place = ambiguous.iter().position(|(level, _)| *level == key);
            let ambiguous_with =
                place.map_or_else(Vec::new, |place| ambiguous.swap_remove(place).1);
            FaultChange { key, before, after, ambiguous_with }
        };
        Ok(was.into_iter().zip(is).map(change).collect())
    }
}

/// Fits of the recordings before and after.
fn record_changes(before: &Seen<'_>, after: &Seen<'_>) -> Vec<RecordChange> {
    let pairs = before.fits.iter().zip(&after.fits);
    let of = |((role, before), (_, after)): (&(Use, RecordFit), &(Use, RecordFit))| RecordChange {
        role: *role,
        before: before.clone(),
        after: after.clone(),
    };
    pairs.map(of).collect()
}

/// Numbers of the machine that a fit has, beside those of the model file.
fn rough_fits(machine: &Machine, values: &[f64]) -> Vec<NumberFit> {
    let fits = machine.rough().iter().zip(values).zip(machine.scales_of(values));
    let of = |((rough, value), scale): ((&Rough, &f64), f64)| NumberFit {
        key: rough.key.clone(),
        nominal: rough.value,
        fitted: value * scale,
    };
    fits.map(of).collect()
}

fn is_absorbed(scored: &Scored) -> bool {
    scored.visible_share < ABSORBED_SHARE && scored.raw_energy > 0.0
}

fn absorbed(round: &Round) -> Vec<EffectId> {
    let mut ids: Vec<EffectId> = round
        .scan
        .scored
        .iter()
        .filter(|scored| is_absorbed(scored))
        .map(|scored| round.families[scored.family].id)
        .collect();
    ids.sort();
    ids.dedup();
    ids
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::structure::{Free, Target};

    /// The axis of the tests, no recordings, the defaults.
    pub(crate) fn nothing_recorded() -> (Machine, Recordings, Options) {
        (Machine::bench_top(), Recordings::default(), Options::default())
    }

    #[test]
    fn the_level_in_the_end_holds_those_of_all_that_is_left_open() {
        let (machine, recordings, options) = nothing_recorded();
        let session = Session::new(&machine, &recordings, &options);
        let worn = |k1: f64| {
            let nominal = Structure::nominal(&machine);
            let is_k1 = |free: &Free| matches!(free.target, Target::Fault(0));
            let value = |free: &Free| if is_k1(free) { k1 } else { free.start };
            let values = nominal.free.iter().map(value).collect();
            let stds = vec![0.0; nominal.free.len()];
            Judged::at(nominal, values, stds, 0.0)
        };
        let open = [worn(0.05), worn(0.3)];
        let k1 = &session
            .fault_changes(&worn(0.2), &worn(0.1), open.iter(), &Whitener::white(1.0))
            .expect("levels")[0];
        assert_eq!(k1.before.interval_95, [0.2, 0.2]);
        assert_eq!((k1.after.value, k1.after.interval_95), (0.1, [0.05, 0.3]));
    }
}
