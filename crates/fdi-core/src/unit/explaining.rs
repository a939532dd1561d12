//! Explanation of recordings: effects that the model of a machine misses in them.

use std::sync::Arc;

use ema_sim::{Effect, EffectId, FaultCoordinates, LowFidelity, PhysicalFaults};
use inference::{BandedMatrix, ljung_box_chance, rms};
use recordings::Recording;

use crate::{
    diagnose::Diagnoser,
    offline::factor::joined,
    online::{
        error::DiagnoseError, observation::Observation, options::DiagnoseOptions,
        outcome::MISFIT_DEVIATIONS, plan::Plan, posterior::Posterior, run::Run, watch::Watch,
    },
    report::{Fault, ToleranceUse},
    unit::{
        answer::is_unlearnt,
        causes::{CauseSearch, FitTogether, FittedCause},
        error::UnitError,
        joint::BuiltFit,
        learnt_unit::{LearntUnit, OtherBundle, session_of},
        modelled::Modelled,
        quantities::Quantities,
        search::{Observed, SAME_WIDENESS, UnitSearchError, block, explain},
        together::{NumberPrior, Together, Whitening},
        unmodelled::absent,
        variants::{Setting, Variant, highest_hz, variants},
    },
};

/// Most effects that are looked for.
const MOST_EFFECTS: usize = 3;
/// Least chance that is stated: what the tails of the learnt error are beyond it is not known.
const LEAST_CHANCE: f64 = 1e-6;
/// Share of an effect that damage and numbers leave open below which they imitate it.
const ABSORBED_SHARE: f64 = 0.02;

/// Settings of an explanation.
#[derive(Clone, Debug, Default)]
pub struct ExplainOptions {
    /// The unit that the recordings are of, where it was learnt.
    pub unit: Option<Arc<LearntUnit>>,
    /// Effects that the machine cannot have: they are not looked for.
    pub without: Vec<EffectId>,
    /// Threads; none counts as one. The answer does not depend on it.
    pub jobs: usize,
}

/// Why recordings cannot be explained with the learnt error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExplainError {
    /// There is nothing to explain.
    #[error("no recording to explain")]
    Nothing,
    /// A recording that is not of the bundle's test.
    #[error("{name}: {reason}")]
    Recording {
        /// Name of the recording.
        name: String,
        /// Why not.
        reason: Box<DiagnoseError>,
    },
    /// A recording for which the bundle knows no error.
    #[error("{name}: {reason}")]
    Unlearnt {
        /// Name of the recording.
        name: String,
        /// Why not.
        reason: String,
    },
    /// The unit was learnt with another bundle.
    #[error(transparent)]
    OtherBundle(#[from] OtherBundle),
    /// The recordings leave a number of the machine without a most probable value.
    #[error(transparent)]
    Search(#[from] UnitSearchError),
}

/// The answer in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CauseVerdict {
    /// Damage and tolerances explain the recordings to the noise and the learnt error.
    Adequate,
    /// Damage, tolerances and the effects named explain the recordings.
    Named,
    /// Effects are there, and something else is left.
    NamedWithRemainder,
    /// Effects are there, one of which may be another that is as good.
    OneOf,
    /// Something is there that no effect of the catalogue explains.
    Unknown,
    /// Damage is beyond that of the machines whose error was learnt.
    BeyondLearnt,
}

/// An effect found, or as good as one found.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Cause {
    /// With its most probable numbers.
    pub effect: Effect,
    /// 95 % interval of each number fitted, by its key; of one that differs between recordings that of
    /// the first.
    pub intervals_95: Vec<(&'static str, [f64; 2])>,
    /// Twice the logarithm of the likelihood ratio.
    pub gain: f64,
    /// Chance of such a gain in any of what was tried; no less than a millionth, since the tails of the
    /// learnt error are not known beyond.
    pub p_familywise: f64,
    /// Gain in log-likelihood of the recordings held out, nats.
    pub holdout_gain_nats: Option<f64>,
    /// The effect found that it may be instead of.
    pub instead_of: Option<EffectId>,
}

/// How an effect of the catalogue fared beside damage and tolerances alone.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CauseTried {
    /// The effect.
    pub id: EffectId,
    /// Natural logarithm of the family-wise chance of its gain.
    pub log_p: f64,
    /// Share of what it does that damage and tolerances leave open.
    pub open_share: f64,
    /// Size of one of its numbers that is seen nine times in ten, in the unit of the number.
    pub smallest_seen: f64,
    /// Key of that number.
    pub smallest_key: &'static str,
    /// Gain and, of recordings held out, gain in log-likelihood, where it was fitted.
    pub fitted: Option<(f64, Option<f64>)>,
}

/// A recording beside the model, before and after what was found.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CauseRecording {
    /// Name.
    pub name: String,
    /// True for one that was held out.
    pub is_held_out: bool,
    /// Root mean square of the residual, A.
    pub rms_a: [f64; 2],
    /// `100·(1 − |residual|/|measured − mean|)`.
    pub fit_percent: [f64; 2],
    /// Chance of as much correlation in white noise, by the white residual of the recording alone.
    pub whiteness_p: [f64; 2],
}

/// Effects that the model of a machine misses in recordings.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Causes {
    /// The answer in a word.
    pub verdict: CauseVerdict,
    /// Effects found in the order in which they were.
    pub found: Vec<Cause>,
    /// Effects that are as good as one of those found.
    pub as_good: Vec<Cause>,
    /// Effects that these recordings cannot show: the low-fidelity model knows nothing of them here, or
    /// damage and tolerances imitate them in every shape that is tried.
    pub absorbed: Vec<EffectId>,
    /// Faults without and with what was found.
    pub faults: [Vec<Fault>; 2],
    /// How each effect fared, the least likely by chance first.
    pub tried: Vec<CauseTried>,
    /// Fitted first, then held out.
    pub recordings: Vec<CauseRecording>,
    /// Part of a residual that noise and learnt error explain, A.
    pub floor_a: f64,
    /// Mean square of the white residual, before and after.
    pub misfit: [f64; 2],
    /// Simulations of the low-fidelity model.
    pub evaluations: u64,
}

/// A recording as it is explained.
struct Prepared<'a> {
    name: String,
    session: Option<String>,
    observation: &'a Observation,
    start_angle_rad: f64,
    noise: BandedMatrix,
}

impl Diagnoser {
    /// Says what the model misses in recordings of a machine in one state of health, beside damage and
    /// tolerances. A gain of recordings held out may speak against an effect, and nothing is fitted to
    /// it but a machine's damage and numbers.
    ///
    /// # Errors
    ///
    /// [`ExplainError`] for recordings that are not of the bundle's test or whose error it has not
    /// learnt.
    pub fn explain(
        &self,
        train: &[Recording],
        holdout: &[Recording],
        options: &ExplainOptions,
    ) -> Result<Causes, ExplainError> {
        let quantities = self.learnt.quantities();
        let built = options.unit.as_deref().map(|unit| self.built(unit, &quantities));
        let built = built.transpose()?;
        let experiment = &self.bundle().experiment;
        let first = train.first().ok_or(ExplainError::Nothing)?;
        let alone =
            DiagnoseOptions { tolerance: ToleranceUse::Model, ..DiagnoseOptions::default() };
        let plan = Plan::of(&alone, experiment).map_err(|reason| failed(first, reason))?;
        let read = |all: &[Recording]| -> Result<Vec<Observation>, ExplainError> {
            let one = |one: &Recording| {
                Observation::of(one, experiment, alone.max_delay_s)
                    .map_err(|reason| failed(one, reason.into()))
            };
            all.iter().map(one).collect()
        };
        let (of_train, of_holdout) = (read(train)?, read(holdout)?);
        let (error, _) = error_of(first, &self.run(&of_train[0], &plan))?;
        let prepared = |(one, seen): (&Recording, _)| {
            self.prepared(one, &self.run(seen, &plan), error, &quantities)
        };
        let prepared_train = train.iter().zip(&of_train).map(prepared);
        let prepared_train = prepared_train.collect::<Result<Vec<_>, _>>()?;
        let prepared_holdout = holdout.iter().zip(&of_holdout).map(prepared);
        let prepared_holdout = prepared_holdout.collect::<Result<Vec<_>, _>>()?;
        let machine = Machine { diagnoser: self, error, quantities: &quantities, built };
        machine.explain(&prepared_train, &prepared_holdout, options)
    }

    /// A learnt unit as built.
    fn built(&self, unit: &LearntUnit, quantities: &Quantities) -> Result<BuiltFit, ExplainError> {
        unit.check_basis(self.bundle(), quantities)?;
        Ok(unit.as_built(quantities).ok_or(UnitSearchError::Undetermined)?)
    }

    fn run<'a>(&'a self, observation: &'a Observation, plan: &'a Plan) -> Run<'a> {
        Run { learnt: &self.learnt, observation, plan, watch: &Watch::NOTHING }
    }

    /// A recording with its noise, the error that of the first recording.
    fn prepared<'a>(
        &self,
        recording: &Recording,
        run: &Run<'a>,
        error: &UnitError,
        quantities: &Quantities,
    ) -> Result<Prepared<'a>, ExplainError> {
        let (own, start_angle_rad) = error_of(recording, run)?;
        let (name, observation) = (recording.name.clone(), run.observation);
        if own.start != error.start {
            let reason = "the bundle has learnt another error for its start angle than for that of \
                          the first recording";
            return Err(ExplainError::Unlearnt { name, reason: reason.to_owned() });
        }
        let unit_noise = self.learnt.unit_noise(observation.phase_rate_hz);
        let noise_of = |level_a: f64| unit_noise.scaled(level_a * level_a);
        let level_a = if let Some(told) = run.told_noise(observation.noise_beside_gains_a()) {
            told.level_a
        } else {
            let noise = noise_of(self.learnt.bundle.noise_a);
            let observed = observed(observation, start_angle_rad, &noise, self);
            let experiment = &self.bundle().experiment;
            let budget = run.plan.budget.unit;
            let alone = explain(experiment, quantities, error, &observed, &[], budget)?;
            run.likeliest_noise(error, &alone).map_err(UnitSearchError::from)?
        };
        let noise = noise_of(level_a);
        let session = session_of(&recording.metadata);
        Ok(Prepared { name, session, observation, start_angle_rad, noise })
    }
}

/// The learnt error for a recording, and its start angle.
fn error_of<'a>(
    recording: &Recording,
    run: &Run<'a>,
) -> Result<(&'a UnitError, f64), ExplainError> {
    run.within_tolerances().map_err(|reason| {
        let reason = reason.unwrap_or_else(|| "tolerances are switched off".to_owned());
        ExplainError::Unlearnt { name: recording.name.clone(), reason }
    })
}

fn failed(recording: &Recording, reason: DiagnoseError) -> ExplainError {
    ExplainError::Recording { name: recording.name.clone(), reason: Box::new(reason) }
}

/// Recording as it is compared.
fn observed<'a>(
    observation: &'a Observation,
    start_angle_rad: f64,
    noise: &'a BandedMatrix,
    diagnoser: &Diagnoser,
) -> Observed<'a> {
    Observed {
        signal_a: &observation.signal_a,
        start_angle_rad,
        shares: observation.sensor_shares.as_ref(),
        noise,
        temperature: diagnoser.learnt.temperature_reading(observation),
        start_std_s: 0.0,
        damage: &[],
        nominal_slopes: None,
    }
}

/// A machine whose recordings are explained.
struct Machine<'a> {
    diagnoser: &'a Diagnoser,
    error: &'a UnitError,
    quantities: &'a Quantities,
    built: Option<BuiltFit>,
}

impl Machine<'_> {
    fn explain(
        &self,
        train: &[Prepared<'_>],
        holdout: &[Prepared<'_>],
        options: &ExplainOptions,
    ) -> Result<Causes, ExplainError> {
        let (of_train, of_holdout) = (self.observed(train), self.observed(holdout));
        let before = self.fit(train, &of_train)?;
        let held_before =
            (!holdout.is_empty()).then(|| self.fit(holdout, &of_holdout)).transpose()?;
        let spent = before.together.evaluations()
            + held_before.as_ref().map_or(0, |held| held.together.evaluations());
        let variants = self.variants(&options.without)?;
        let mut search =
            CauseSearch::new(before.clone(), held_before.clone(), &variants, options.jobs.max(1))
                .map_err(UnitSearchError::from)?;
        search.run(MOST_EFFECTS);
        let mut recordings = self.recordings(train, [&before, &search.fit], false)?;
        if let (Some(before), Some(after)) = (&held_before, &search.holdout) {
            recordings.extend(self.recordings(holdout, [before, after], true)?);
        }
        let usual = self.error.ln_misfit_mean.exp();
        let widening = (search.fit.misfit() / usual).max(1.0).sqrt();
        let stated = |one: &FittedCause, instead_of| cause(one, instead_of, train.len(), widening);
        let mut found = Vec::new();
        let mut as_good = Vec::new();
        for one in &search.found {
            found.push(stated(&one.best, None));
            as_good.extend(one.as_good.iter().map(|other| stated(other, Some(one.best.id()))));
        }
        let tried = search.looked.iter().map(|one| CauseTried {
            id: one.id,
            log_p: one.log_p,
            open_share: one.open_share,
            smallest_seen: one.smallest_seen,
            smallest_key: one.smallest_key,
            fitted: one.fitted.as_ref().map(|fitted| (fitted.gain, fitted.holdout_gain_nats)),
        });
        let mut tried: Vec<CauseTried> = tried.collect();
        tried.sort_by(|a, b| a.log_p.total_cmp(&b.log_p));
        let is_absorbed = |one: &&CauseTried| one.open_share < ABSORBED_SHARE;
        let absorbed = tried.iter().filter(is_absorbed).map(|one| one.id);
        let absorbed = search.unseen.iter().copied().chain(absorbed).collect();
        Ok(Causes {
            verdict: self.verdict(&search, !as_good.is_empty()),
            absorbed,
            faults: [self.faults(&before), self.faults(&search.fit)],
            misfit: [before.misfit(), search.fit.misfit()],
            floor_a: self.covariance(train, &before).mean_diagonal().sqrt(),
            evaluations: spent + search.evaluations,
            found,
            as_good,
            tried,
            recordings,
        })
    }

    fn observed<'b>(&self, prepared: &'b [Prepared<'_>]) -> Vec<Observed<'b>> {
        let one = |one: &'b Prepared<'_>| {
            observed(one.observation, one.start_angle_rad, &one.noise, self.diagnoser)
        };
        prepared.iter().map(one).collect()
    }

    /// Most probable damage and numbers of recordings together.
    fn fit<'b>(
        &'b self,
        prepared: &[Prepared<'_>],
        observed: &'b [Observed<'b>],
    ) -> Result<FitTogether<'b>, ExplainError> {
        let experiment = &self.diagnoser.bundle().experiment;
        let count = prepared.len();
        let noise = mean_noise(prepared);
        let learnt = &self.diagnoser.learnt;
        let first_rad = prepared[0].start_angle_rad;
        let has_one_start =
            prepared.iter().all(|one| learnt.same_start(one.start_angle_rad, first_rad));
        let sessions: Vec<usize> = prepared.iter().map(|one| place_of(prepared, one)).collect();
        let layout = self.quantities.layout();
        let prior = NumberPrior::new(layout, self.built.as_ref(), &sessions);
        let prior = prior.ok_or(UnitSearchError::Undetermined)?;
        let mut start = vec![0.0; layout.sought.len()];
        start.extend(prior.mean());
        let whitening = |wideness| {
            Whitening::new(self.error, wideness, &noise, count, has_one_start)
                .map_err(UnitSearchError::from)
        };
        let modelled = observed
            .iter()
            .map(|one| Modelled::new(experiment, self.quantities, self.error, one))
            .collect();
        let fit = FitTogether::new(Together::new(modelled, whitening(0.0)?, prior), &start)?;
        let wideness = self.wideness(&fit);
        if wideness.abs() < SAME_WIDENESS {
            return Ok(fit);
        }
        let together = fit.together.with_whitening(whitening(wideness)?);
        Ok(FitTogether::new(together, &fit.found.numbers)?)
    }

    /// Share of the covariance of a wide play on the machine of a fit.
    fn wideness(&self, fit: &FitTogether<'_>) -> f64 {
        let point = fit.together.point(0, &fit.found.numbers);
        self.error.wideness(&self.quantities.at(&point))
    }

    /// Effects in the shapes that are tried on the machine.
    fn variants(&self, without: &[EffectId]) -> Result<Vec<Variant>, UnitSearchError> {
        let experiment = &self.diagnoser.bundle().experiment;
        let model = LowFidelity::new(&experiment.actuator, &experiment.scenario)?;
        let healthy = PhysicalFaults::from(&FaultCoordinates([0.0; ema_sim::FAULT_COUNT]));
        let setting = Setting {
            scales: model.scales(&model.simulate(&healthy)),
            pole_pairs: experiment.actuator.motor.pole_pairs,
            duration_s: experiment.scenario.duration_s,
            highest_hz: highest_hz(experiment.filter.corner_hz, experiment.filter.output_hz),
        };
        let mut effects = absent(&experiment.effects);
        effects.retain(|id| !without.contains(id));
        Ok(variants(&effects, &setting))
    }

    fn verdict(&self, search: &CauseSearch<'_>, is_open: bool) -> CauseVerdict {
        let levels = &search.fit.found.numbers;
        if self.quantities.layout().sought.iter().zip(levels).any(is_unlearnt) {
            return CauseVerdict::BeyondLearnt;
        }
        let is_to_the_noise = search.fit.misfit() <= self.error.largest_misfit(MISFIT_DEVIATIONS);
        match (search.found.is_empty(), is_to_the_noise && !search.is_unexplained) {
            (true, true) => CauseVerdict::Adequate,
            (true, false) => CauseVerdict::Unknown,
            (false, _) if is_open => CauseVerdict::OneOf,
            (false, true) => CauseVerdict::Named,
            (false, false) => CauseVerdict::NamedWithRemainder,
        }
    }

    fn faults(&self, fit: &FitTogether<'_>) -> Vec<Fault> {
        let indices = self.quantities.layout().sought.clone();
        let count = indices.len();
        let covariance = block(&fit.found.covariance, count);
        let estimate = fit.found.numbers[..count].to_vec();
        Posterior { indices, estimate, covariance, explained: None }.faults()
    }

    /// Each recording beside two fits.
    fn recordings(
        &self,
        prepared: &[Prepared<'_>],
        fits: [&FitTogether<'_>; 2],
        is_held_out: bool,
    ) -> Result<Vec<CauseRecording>, UnitSearchError> {
        let factor = self.covariance(prepared, fits[0]).cholesky()?;
        let [before, after] = fits.map(|fit| {
            let mut together = fit.together.clone();
            together.residuals_a(&fit.found.numbers)
        });
        let (before, after) = (before?, after?);
        let recording = |((one, before), after): ((&Prepared<'_>, &Vec<f64>), &Vec<f64>)| {
            let signal = &one.observation.signal_a;
            let mean = signal.iter().sum::<f64>() / signal.len() as f64;
            let spread: Vec<f64> = signal.iter().map(|y| y - mean).collect();
            let spread_a = rms(&spread).max(f64::MIN_POSITIVE);
            let rms_a = [before, after].map(|residual| rms(residual));
            CauseRecording {
                name: one.name.clone(),
                is_held_out,
                rms_a,
                fit_percent: rms_a.map(|rms_a| 100.0 * (1.0 - rms_a / spread_a)),
                whiteness_p: [before, after].map(|residual| {
                    let mut white = residual.clone();
                    factor.whiten(&mut white);
                    ljung_box_chance(&white)
                }),
            }
        };
        Ok(prepared.iter().zip(before.iter()).zip(after.iter()).map(recording).collect())
    }

    /// Covariance of noise and learnt error of one recording.
    fn covariance(&self, prepared: &[Prepared<'_>], fit: &FitTogether<'_>) -> BandedMatrix {
        joined(&self.error.covariance_of(self.wideness(fit)), &mean_noise(prepared))
    }
}

/// Mean covariance of the recordings' noise.
fn mean_noise(prepared: &[Prepared<'_>]) -> BandedMatrix {
    let share = 1.0 / prepared.len() as f64;
    let mut all = prepared.iter().map(|one| one.noise.scaled(share));
    let first = all.next().unwrap_or_else(|| BandedMatrix::zeros(0, 0));
    all.fold(first, |sum, one| sum.plus(&one))
}

/// Place of the first recording of the same session: those that state none share one.
fn place_of(prepared: &[Prepared<'_>], one: &Prepared<'_>) -> usize {
    prepared.iter().position(|other| other.session == one.session).unwrap_or_default()
}

/// An effect in the first of so many recordings, its intervals wider by what the fit leaves over.
fn cause(
    fitted: &FittedCause,
    instead_of: Option<EffectId>,
    recordings: usize,
    widening: f64,
) -> Cause {
    let FittedCause { acting, unknowns, stds, gain, p_familywise, holdout_gain_nats, .. } = fitted;
    let stds: Vec<f64> = stds.iter().map(|std| widening * std).collect();
    Cause {
        effect: acting.effect(0, unknowns),
        intervals_95: acting.intervals(recordings, unknowns, &stds),
        gain: *gain,
        p_familywise: p_familywise.max(LEAST_CHANCE),
        holdout_gain_nats: *holdout_gain_nats,
        instead_of,
    }
}
