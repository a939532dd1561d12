//! Choice of the model that predicts recordings, and moves of the predictions to it.

use ema_sim::{Effect, EffectId, ModelFidelity, Role};
use inference::log_likelihood_without;

use crate::{
    anchor::{FEW_RUNS, RUNS},
    error::{GreyboxError, if_run},
    explain::Session,
    fit::{fit_from_afar, fit_roughly},
    observation::Observation,
    problem::{Anchors, PerRecord},
    structure::{Free, Structure, Target},
};

/// Share of the step of each number by which a fit may leave an anchor that still stands for it: the
/// simple model is off by a few hundredths of what that changes.
const STANDS_WITHIN: f64 = 0.3;

/// Numbers of a structure at which a model predicts.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Place {
    observation: Observation,
    pub(crate) structure: Structure,
    pub(crate) values: Vec<f64>,
}

impl Place {
    /// Numbers of a structure half of the way from the place to some; an effect that is not there
    /// has no size.
    pub(crate) fn halfway(&self, structure: &Structure, values: &[f64]) -> Vec<f64> {
        let id = |structure: &Structure, place: usize| structure.effects.get(place).map(Effect::id);
        let here = |target: Target| {
            let at = self.structure.free.iter().position(|free| free.target == target);
            at.map(|at| self.values[at])
        };
        let from = |target: Target| match target {
            Target::Rough(_) | Target::Fault(_) => here(target),
            Target::Effect(effect, place) | Target::InRecord { effect, place, .. } => {
                let id_there = id(structure, effect);
                let is_size = |id: EffectId| id.info().parameters[place].role() == Role::Amplitude;
                let none = id_there.is_some_and(is_size).then_some(0.0);
                if id(&self.structure, effect) == id_there { here(target).or(none) } else { none }
            }
        };
        let half = |(free, &value): (&Free, &f64)| {
            from(free.target).map_or(value, |from| 0.5 * (from + value))
        };
        structure.free.iter().zip(values).map(half).collect()
    }

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
    /// tolerances fitted and a noise of its own, and moves the predictions to it there; with these
    /// numbers.
    pub(crate) fn observe(
        &mut self,
        log: &mut Vec<String>,
    ) -> Result<(Observation, Vec<f64>), GreyboxError> {
        let nominal = Structure::nominal(self.machine);
        let candidates = self.observations();
        if let [Observation::Ideal] = candidates[..] {
            return Ok((Observation::Ideal, nominal.starts()));
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
        let Some(best) = best else { return Ok((Observation::Ideal, nominal.starts())) };
        let Some(fidelity) = best.observation.fidelity() else {
            return Ok((Observation::Ideal, best.values));
        };
        let there =
            Place { observation: best.observation, structure: nominal, values: best.stands_at };
        let found = Place { values: best.values.clone(), ..there.clone() };
        let is_moved = if there.is_near(&found) {
            self.train.put_back(&best.train);
            self.move_to(fidelity, there, true)?
        } else {
            self.move_to(fidelity, found, false)?
        };
        if is_moved {
            return Ok((best.observation, best.values));
        }
        self.put_back(&none);
        Ok((Observation::Ideal, best.values))
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
            let fitted = if_run(fit_from_afar(&self.train, &nominal))?;
            return Ok(fitted.map(|(fitted, _)| Candidate {
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
            let fitted = if runs == FEW_RUNS {
                fit_from_afar(&self.train, &nominal)
            } else {
                fit_roughly(&self.train, &nominal.clone().started_at(&values))
            };
            let Some((fitted, _)) = if_run(fitted)? else { return Ok(None) };
            alike = likelihood_of(&fitted.residuals, &self.train.scatter());
            values = fitted.values;
        }
        let noise = self.train.sensor_noise(&nominal.state(self.machine, &values))?;
        self.train.weigh(noise);
        let fitted = fit_roughly(&self.train, &nominal.started_at(&values));
        let Some((fitted, _)) = if_run(fitted)? else { return Ok(None) };
        let as_runs = likelihood_of(&fitted.residuals, &[]) - self.train.log_determinant(noise);
        Ok(Some(Candidate {
            observation,
            likelihood: alike.max(as_runs),
            values: if as_runs > alike { fitted.values } else { values },
            stands_at,
            train: self.train.anchors(),
        }))
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
        let noise = match self.sensor_noise {
            Some(noise) => noise,
            None => self.train.sensor_noise(&state)?,
        };
        self.sensor_noise = Some(noise);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{machine::Machine, structure::Number};

    /// From health half of the way to an effect has half of its size and all of its shape; from
    /// another effect in its place that one's numbers do not count.
    #[test]
    fn half_of_the_way_has_half_of_a_size_and_all_of_a_shape() {
        let machine = Machine::bench_top();
        let nominal = Structure::nominal(&machine);
        let number = |place| Number { place, in_record: None, step: 1.0, least: -9.0, most: 9.0 };
        let with = |id| {
            let effect = Effect::new(id, machine.geometry());
            nominal.clone().with_effect(effect, &[number(0), number(1)])
        };
        let place = |structure: &Structure, of_effect: f64| {
            let mut values = structure.starts();
            for place in structure.places_of_effect(0) {
                values[place] = of_effect;
            }
            let structure = structure.clone();
            Place { observation: Observation::Low, structure, values }
        };
        let healthy = Place {
            observation: Observation::Low,
            structure: nominal.clone(),
            values: nominal.starts(),
        };
        let drifting = with(EffectId::FrictionDrift);
        let stribeck = with(EffectId::Stribeck);
        let mut values = drifting.starts();
        let [size, time] = drifting.places_of_effect(0)[..] else { panic!("two numbers") };
        (values[0], values[size], values[time]) = (3.0 * values[0], -0.2, 8.0);
        for (from, half) in [
            (healthy, [-0.1, 8.0]),
            (place(&stribeck, 4.0), [-0.1, 8.0]),
            (place(&drifting, 4.0), [1.9, 6.0]),
        ] {
            let found = from.halfway(&drifting, &values);
            assert_eq!([found[size], found[time]], half);
            assert!((found[0] / nominal.starts()[0] - 2.0).abs() < 1e-12);
        }
    }
}
