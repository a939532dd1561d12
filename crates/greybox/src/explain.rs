//! The whole chain: fit, scan, refit, judge, decide.

use ema_sim::{EffectId, model_file::MachineModel};
use nalgebra::DMatrix;

use crate::{
    curve::{ResidualCurve, curves, joined},
    elsewhere::elsewhere,
    error::GreyboxError,
    explained::{Explained, FaultChange, Finding, Use, Verdict},
    fit::{Fitted, fit, sandwich},
    floor::{Excess, Floor, pairs},
    hypothesis::Scales,
    machine::{Machine, Prediction},
    noise::{Whitener, rms},
    problem::{PerRecord, Problem},
    record::{Record, Recordings},
    response::travel,
    rival::{GOOD_PER_SAMPLE, Judged, Rival},
    scan::Scored,
    search::{Found, Round, Search},
    show::{RecordFit, along_coordinates, record_fits, remainder},
    structure::{Structure, Target},
    through_plant::ThroughPlant,
    trial::Trial,
};

/// What decides, with the defaults that every report states.
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
    /// Standard errors by which the held-out likelihood has to rise.
    pub gain_std_errors: f64,
    /// Chance, by fit and hold-out together, below which half of that is enough for a first
    /// effect.
    pub sure_rate: f64,
    /// Nats by which the evidence has to rise.
    pub evidence_nats: f64,
    /// Nats of likelihood, fitted and held out together, within which rivals are tied.
    pub tie_nats: f64,
    /// Effects that the machine cannot have: they are not looked for.
    pub without: Vec<EffectId>,
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
            without: Vec::new(),
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

/// Friction and backlash levels, k1 and k2, from which the nominal model is fitted too.
const WORN: [[f64; 2]; 3] = [[0.4, 0.0], [0.0, 0.2], [0.4, 0.2]];

/// Standard deviations from which on a fault level is found, and its least.
const FOUND_STD: f64 = 3.0;
const LEAST_FOUND: f64 = 1e-3;

/// Causes beside the best among which a recording is to tell.
const MOST_OPEN: usize = 3;

pub(crate) struct Session<'a> {
    pub(crate) machine: &'a Machine,
    pub(crate) options: &'a Options,
    pub(crate) train: Problem<'a>,
    pub(crate) holdout: Problem<'a>,
    repeat: Problem<'a>,
    pairs: Vec<(usize, usize)>,
}

/// A fit with what it leaves of the recordings held out.
struct Seen<'f> {
    fitted: &'f Fitted,
    held_out: PerRecord,
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

    fn answer(&self, search: Search) -> Result<Explained, GreyboxError> {
        let Search { floor, before, current, found, first_round, tried, mut log, .. } = search;
        let (ties, last_ties) = (search.ties, search.last_ties);
        let whitener = &floor.whitener;
        let fitted = &current.fitted;
        let nominal = self.seen(&before.fitted, whitener)?;
        let now = self.seen(fitted, whitener)?;
        let something_left =
            self.is_something_left((&nominal, &now), current.holdout_rms, &floor, &mut log)?;
        let verdict = match (found.is_empty(), something_left) {
            (true, false) => match &first_round {
                Some(round) if self.may_be_an_effect(&current, round, whitener) => {
                    Verdict::Absorbed
                }
                _ => Verdict::Adequate,
            },
            (true, true) => Verdict::Unknown,
            (false, true) => Verdict::NamedWithRemainder,
            (false, false) if !(ties.is_empty() && last_ties.is_empty()) => Verdict::OneOf,
            (false, false) => Verdict::Named,
        };
        // what explains most comes first, but the one that others are tied with before it
        let mut by_strength: Vec<(usize, &Found)> = found.iter().enumerate().collect();
        let first = usize::from(!ties.is_empty());
        by_strength[first..].sort_by(|(_, a), (_, b)| b.rival.fall.total_cmp(&a.rival.fall));
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
        let rough = self.machine.rough().iter().zip(&state.rough);
        Ok(Explained {
            verdict,
            reason: None,
            effects,
            alternatives,
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

    /// Whether damage that was found is imitated by an effect that these recordings cannot tell
    /// from damage and tolerance.
    fn may_be_an_effect(&self, current: &Judged, round: &Round, whitener: &Whitener) -> bool {
        let fitted = &current.fitted;
        let covariance = sandwich(fitted, &self.train, whitener);
        let is_found = |&p: &usize| {
            matches!(fitted.structure.free[p].target, Target::Fault(_))
                && fitted.values[p].abs() > FOUND_STD * libm::sqrt(covariance[(p, p)].max(0.0))
                && fitted.values[p].abs() > LEAST_FOUND
        };
        let scored = round.scan.scored.iter().filter(|scored| is_absorbed(scored));
        scored.filter_map(|scored| scored.imitated_by).any(|p| is_found(&p))
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
    pub(crate) fn floor(&self, nominal: &Structure) -> Result<(Floor, Fitted), GreyboxError> {
        if let Some(floor) = Floor::of_pairs(&self.train, &self.repeat, &self.pairs) {
            let fitted = self.nominal(nominal, &floor.whitener)?;
            return Ok((floor, fitted));
        }
        let guess = Whitener::white(rough_noise(&self.train));
        let fitted = fit(&self.train, nominal.clone(), &guess)?;
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
            before: &[],
        };
        let tried = tried.run(&families)?;
        let mut columns: Vec<&PerRecord> = fitted.sensitivities.iter().collect();
        columns.extend(tried.iter().flat_map(|t| &t.columns));
        let floor = Floor::of_saturated(&fitted.residuals, &columns);
        let fitted = self.nominal(nominal, &floor.whitener)?;
        Ok((floor, fitted))
    }

    /// The model without an effect, fitted from health, and where that leaves something also from
    /// far gone wear, which bends the fit on its way.
    fn nominal(&self, nominal: &Structure, whitener: &Whitener) -> Result<Fitted, GreyboxError> {
        let mut best = fit(&self.train, nominal.clone(), whitener)?;
        for levels in WORN {
            if best.objective < GOOD_PER_SAMPLE * self.train.samples() as f64 {
                break;
            }
            let fitted = fit(&self.train, nominal.clone().started_worn(levels), whitener)?;
            if fitted.objective < best.objective {
                best = fitted;
            }
        }
        Ok(best)
    }

    pub(crate) fn drive(&self, fitted: &Fitted) -> Result<PerRecord, GreyboxError> {
        let state = fitted.structure.state(self.machine, &fitted.values);
        Ok(self.train.drives(&[state])?.remove(0))
    }

    pub(crate) fn scales(&self, fitted: &Fitted) -> Result<Scales, GreyboxError> {
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
            holdout_gain_nats: found.rival.gain.nats,
            holdout_gain_se: found.rival.gain.std_error,
            evidence_nats: found.rival.evidence,
            instead_of: None,
        }
    }

    fn fault_changes(
        &self,
        before: &Judged,
        after: &Judged,
        whitener: &Whitener,
    ) -> Vec<FaultChange> {
        let was =
            levels(&before.fitted, &sandwich(&before.fitted, &self.train, before.own_noise()));
        let is = levels(&after.fitted, &sandwich(&after.fitted, &self.train, whitener));
        let change = |((key, before, std_before), (_, after, std_after))| FaultChange {
            key,
            before,
            std_before,
            after,
            std_after,
        };
        was.into_iter().zip(is).map(change).collect()
    }

    /// The size at which an effect would have been named nine times in ten: the root of its
    /// projected energy exceeds that which the gates ask for by 1.28 standard deviations. The
    /// recordings held out are taken to show as much of it a sample as those fitted.
    fn smallest(&self, round: &Round) -> Vec<(EffectId, String, f64)> {
        let geometry = self.machine.geometry();
        let of = |scored: &Scored| {
            let (tried, family) = (&round.tried[scored.tried], &round.families[scored.family]);
            let &(place, size) = tried.sizes.first()?;
            if scored.energy <= 0.0 {
                return None;
            }
            let id = tried.plain.id();
            let key = id.info().parameters[place].key(geometry).to_owned();
            let numbers = tried.sizes.len() + family.free_shapes().len();
            let least = self.least_named(round, family.screened(), numbers);
            Some((id, key, size.abs() * least / libm::sqrt(scored.energy)))
        };
        round.scan.scored.iter().filter_map(of).collect()
    }

    /// Root of the projected energy from which scan, evidence and the recordings held out accept
    /// an effect, nine times in ten, whose shapes were chosen among so many.
    fn least_named(&self, round: &Round, looked_at: f64, numbers: usize) -> f64 {
        let options = &self.options;
        let questions = libm::log(round.families.len().max(1) as f64 * looked_at);
        let scan = questions - libm::log(options.false_alarm_rate);
        let price = 0.5 * numbers as f64 * libm::log(self.train.samples().max(1) as f64);
        let evidence = options.evidence_nats + price + libm::log(looked_at);
        let share = self.holdout.samples() as f64 / self.train.samples().max(1) as f64;
        let sure = (questions - libm::log(options.sure_rate)) / (1.0 + share);
        let root = |nats: f64| libm::sqrt(2.0 * nats) + NINE_IN_TEN;
        let confirmed = 2.0 * (options.gain_std_errors + NINE_IN_TEN) / libm::sqrt(share);
        root(scan.max(evidence)).max(root(sure).min(confirmed))
    }
}

/// Standard deviations that nine of ten are within, to one side.
const NINE_IN_TEN: f64 = 1.2816;

/// Fault levels with their standard deviations; of an eccentricity its amount, whatever its
/// direction.
fn levels(fitted: &Fitted, covariance: &DMatrix<f64>) -> Vec<(String, f64, f64)> {
    let variance = |p: usize, q: usize| covariance[(p, q)];
    let (values, mut levels) = (&fitted.values, Vec::new());
    for (p, free) in fitted.structure.free.iter().enumerate() {
        let Target::Fault(place) = free.target else { continue };
        if place < ECCENTRICITY {
            levels.push((free.key.clone(), values[p], libm::sqrt(variance(p, p).max(0.0))));
        } else if place == ECCENTRICITY {
            let (cos, sin) = (values[p], values[p + 1]);
            let amount = libm::hypot(cos, sin);
            let (c, s) = if amount > 0.0 { (cos / amount, sin / amount) } else { (1.0, 0.0) };
            let along = c * c * variance(p, p)
                + s * s * variance(p + 1, p + 1)
                + 2.0 * c * s * variance(p, p + 1);
            levels.push(("k6".to_owned(), amount, libm::sqrt(along.max(0.0))));
        }
    }
    levels
}

/// Place of the first of the two coordinates of an eccentricity.
const ECCENTRICITY: usize = 5;

fn is_absorbed(scored: &Scored) -> bool {
    scored.visible_share < ABSORBED_SHARE && scored.visible_share > 0.0
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

/// Noise by second differences of the measured signals: a first guess.
fn rough_noise(problem: &Problem<'_>) -> f64 {
    let differences: Vec<f64> = problem
        .records
        .iter()
        .flat_map(|r| r.measured.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]) / libm::sqrt(6.0)))
        .collect();
    rms(&differences).max(1e-9)
}
