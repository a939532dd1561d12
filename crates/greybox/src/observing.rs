//! Choice of the model that predicts recordings, and moves of the predictions to it.

use ema_sim::{Effect, EffectId, ModelFidelity};
use inference::{Whitener, log_likelihood_without};

use crate::{
    anchor::{FEW_RUNS, RUNS},
    error::{GreyboxError, if_run},
    explain::Session,
    fit::{Fitted, fit},
    observation::Observation,
    problem::{Anchors, PerRecord, rough_noise},
    structure::{Free, Structure, Target},
};

/// Share of the step of each number by which a fit may leave an anchor that still stands for it: the
/// simple model is off by a few hundredths of what that changes.
const STANDS_WITHIN: f64 = 0.3;

/// Numbers of a structure at which a model predicts.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Place {
    observation: Observation,
    structure: Structure,
    values: Vec<f64>,
}

impl Place {
    /// Tells whether what holds at one place holds at the other.
    fn is_near(&self, other: &Self) -> bool {
        let ids = |place: &Self| -> Vec<EffectId> {
            place.structure.effects.iter().map(Effect::id).collect()
        };
        let targets = |place: &Self| -> Vec<Target> {
            place.structure.free.iter().map(|free| free.target).collect()
        };
        let moved = |(free, (a, b)): (&Free, (&f64, &f64))| {
            (a - b).abs() <= STANDS_WITHIN * free.step.abs()
        };
        self.observation == other.observation
            && ids(self) == ids(other)
            && targets(self) == targets(other)
            && other.structure.free.iter().zip(other.values.iter().zip(&self.values)).all(moved)
    }
}

/// Recordings to fit under a model that may predict them.
struct Candidate {
    observation: Observation,
    /// Log-likelihood of the recordings.
    likelihood: f64,
    /// Numbers fitted.
    values: Vec<f64>,
    /// Numbers at which their predictions were moved to the model, and these anchors.
    stands_at: Vec<f64>,
    train: Anchors,
}

/// Anchors of all recordings.
#[derive(Clone, Debug)]
pub(crate) struct AllAnchors {
    standing: Option<Place>,
    train: Anchors,
    holdout: Anchors,
    repeat: Anchors,
}

impl Session<'_> {
    /// Models of the machine that may predict its recordings.
    fn observations(&self) -> Vec<Observation> {
        if let Some(pinned) = self.options.observation {
            return vec![pinned];
        }
        let has = |observation: &Observation| {
            observation.fidelity().is_none_or(|f| self.machine.electronics().contains(&f))
        };
        Observation::ALL.into_iter().filter(has).collect()
    }

    /// Chooses the model under which the recordings to fit are likeliest, each with damage and
    /// tolerances fitted and a noise of its own, and moves the predictions to it there.
    pub(crate) fn observe(&mut self, log: &mut Vec<String>) -> Result<Observation, GreyboxError> {
        let candidates = self.observations();
        if let [Observation::Ideal] = candidates[..] {
            return Ok(Observation::Ideal);
        }
        let none = self.all_anchors();
        let mut best: Option<Candidate> = None;
        for observation in candidates {
            let seen = self.likelihood_under(observation)?;
            self.put_back(&none);
            let Some(candidate) = seen else { continue };
            let likelihood = candidate.likelihood;
            log.push(format!("under {}: log-likelihood {likelihood:.1}", observation.word()));
            if best.as_ref().is_none_or(|best| likelihood > best.likelihood) {
                best = Some(candidate);
            }
        }
        let Some(best) = best else { return Ok(Observation::Ideal) };
        let Some(fidelity) = best.observation.fidelity() else { return Ok(Observation::Ideal) };
        let there = Place {
            observation: best.observation,
            structure: Structure::nominal(self.machine),
            values: best.stands_at,
        };
        let found = Place { values: best.values, ..there.clone() };
        let is_moved = if there.is_near(&found) {
            self.train.put_back(&best.train);
            self.move_to(fidelity, there, true)?
        } else {
            self.move_to(fidelity, found, false)?
        };
        if is_moved {
            return Ok(best.observation);
        }
        self.put_back(&none);
        Ok(Observation::Ideal)
    }

    /// The recordings to fit under a model; `None` where it cannot be run.
    ///
    /// The mean of `n` runs has an `n`-th of their scatter, which must not count against a model that
    /// needs runs. With the residual `r` beside that mean, it is the larger of the likelihoods under
    /// a noise that is alike throughout, by autocovariances `γ`, and one as the runs scatter:
    ///
    /// ```text
    /// ln p = ln p_AR(γ_r − γ_V/n),        ln p = ln p_AR(L⁻¹·r) − ln det L_∞
    /// L·Lᵀ = I + V·(1 + 1/n)/σ²,          L_∞·L_∞ᵀ = I + V/σ²
    /// ```
    ///
    /// with the covariance `V` of runs and the noise `σ` of the sensors.
    fn likelihood_under(
        &mut self,
        observation: Observation,
    ) -> Result<Option<Candidate>, GreyboxError> {
        let nominal = Structure::nominal(self.machine);
        let mut values = nominal.starts();
        let Some(fidelity) = observation.fidelity() else {
            let fitted = self.rough_fit(&nominal, &values)?;
            return Ok(fitted.map(|fitted| Candidate {
                observation,
                likelihood: likelihood_of(&fitted.residuals, &[]),
                stands_at: fitted.values.clone(),
                values: fitted.values,
                train: self.train.anchors(),
            }));
        };
        let mut alike = f64::NEG_INFINITY;
        let mut stands_at = values.clone();
        for runs in [FEW_RUNS, RUNS] {
            stands_at.clone_from(&values);
            let state = nominal.state(self.machine, &values);
            if !self.train.anchor(fidelity, &state, runs)? {
                return Ok(None);
            }
            let Some(fitted) = self.rough_fit(&nominal, &values)? else { return Ok(None) };
            alike = likelihood_of(&fitted.residuals, &self.train.scatter());
            values = fitted.values;
        }
        let noise = self.train.sensor_noise(&nominal.state(self.machine, &values))?;
        self.train.weigh(noise);
        let Some(fitted) = self.rough_fit(&nominal, &values)? else { return Ok(None) };
        let as_runs = likelihood_of(&fitted.residuals, &[]) - self.train.log_determinant(noise);
        Ok(Some(Candidate {
            observation,
            likelihood: alike.max(as_runs),
            values: if as_runs > alike { fitted.values } else { values },
            stands_at,
            train: self.train.anchors(),
        }))
    }

    /// Fit with white noise; `None` where the machine cannot be run.
    fn rough_fit(
        &self,
        nominal: &Structure,
        values: &[f64],
    ) -> Result<Option<Fitted>, GreyboxError> {
        let noise = Whitener::white(rough_noise(&self.train));
        if_run(fit(&self.train, nominal.clone().started_at(values), &noise))
    }

    /// Moves the predictions to the model of an observation at values of a structure; false where it
    /// cannot be run, or where there is none.
    pub(crate) fn anchor(
        &mut self,
        observation: Observation,
        structure: &Structure,
        values: &[f64],
    ) -> Result<bool, GreyboxError> {
        let Some(fidelity) = observation.fidelity() else { return Ok(false) };
        let place = Place { observation, structure: structure.clone(), values: values.to_vec() };
        if self.standing.as_ref().is_some_and(|standing| standing.is_near(&place)) {
            return Ok(true);
        }
        self.move_to(fidelity, place, false)
    }

    /// Moves the predictions to a model at a place, those of the recordings to fit where they are not
    /// there yet; false where it cannot be run.
    fn move_to(
        &mut self,
        fidelity: ModelFidelity,
        place: Place,
        is_train_there: bool,
    ) -> Result<bool, GreyboxError> {
        let Place { structure, values, .. } = &place;
        let state = structure.state(self.machine, values);
        let elsewhere = structure.state_elsewhere(self.machine, values);
        let before = self.all_anchors();
        let is_run = (is_train_there || self.train.anchor(fidelity, &state, RUNS)?)
            && self.holdout.anchor(fidelity, &elsewhere, RUNS)?
            && self.repeat.anchor(fidelity, &elsewhere, RUNS)?;
        if !is_run {
            self.put_back(&before);
            return Ok(false);
        }
        let noise = self.train.sensor_noise(&state)?;
        for problem in [&mut self.train, &mut self.holdout, &mut self.repeat] {
            problem.weigh(noise);
        }
        self.standing = Some(place);
        Ok(true)
    }

    /// Anchors as they stand.
    pub(crate) fn all_anchors(&self) -> AllAnchors {
        AllAnchors {
            standing: self.standing.clone(),
            train: self.train.anchors(),
            holdout: self.holdout.anchors(),
            repeat: self.repeat.anchors(),
        }
    }

    /// Anchors as they stood.
    pub(crate) fn put_back(&mut self, anchors: &AllAnchors) {
        self.standing.clone_from(&anchors.standing);
        self.train.put_back(&anchors.train);
        self.holdout.put_back(&anchors.holdout);
        self.repeat.put_back(&anchors.repeat);
    }
}

/// Log-likelihood of residuals under autoregressive noise of their own, less what the scatter of
/// runs less their mean, all of as many recordings, puts into them.
fn likelihood_of(residuals: &PerRecord, scatter: &[&[f64]]) -> f64 {
    let stretches: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
    let runs = (scatter.len() / stretches.len().max(1)) as f64;
    // n − 1 of n runs less their mean are free
    log_likelihood_without(&stretches, scatter, 1.0 / (runs - 1.0).max(1.0))
}
