//! Moves of the predictions to the finer model as a fit goes on.

use inference::Whitener;

use crate::{
    error::GreyboxError,
    explain::Session,
    fit::{Fitted, fit, objective_at},
    observation::Observation,
    rival::Judged,
    search::Search,
    structure::Structure,
};

/// Moves of the prediction to the finer model at a fit, and the change of its cost below which it
/// stays, nats.
const MOST_FOLLOWED: usize = 3;
const FOLLOWED_NATS: f64 = 0.5;
/// Halvings of a move.
const MOST_HALVED: usize = 3;
/// Nats that a move may lose: the means of so few runs differ by as much.
const FARTHER_NATS: f64 = 10.0;

impl Session<'_> {
    /// A fit with the prediction moved to the finer model at its numbers, and fitted again there
    /// until it stays.
    ///
    /// Where the finer model explains less there than where the prediction stood, the simple one
    /// led too far: the prediction is moved half of the way instead.
    pub(crate) fn followed(
        &mut self,
        observation: Observation,
        mut fitted: Fitted,
        whitener: &Whitener,
    ) -> Result<Fitted, GreyboxError> {
        for _ in 0..MOST_FOLLOWED {
            let Some(moved) = self.moved_towards(observation, &fitted, whitener)? else { break };
            let before = fitted.nats();
            fitted = fit(&self.train, moved, whitener)?;
            if (before - fitted.nats()).abs() < FOLLOWED_NATS {
                break;
            }
        }
        Ok(fitted)
    }

    /// Moves the prediction to the finer model with what was found.
    pub(crate) fn follow(&mut self, search: &mut Search) -> Result<(), GreyboxError> {
        if search.observation == Observation::Ideal {
            return Ok(());
        }
        let fitted = search.current.fitted.clone();
        let fitted = self.followed(search.observation, fitted, &search.floor.whitener)?;
        search.current = Judged::new(fitted, self.split(), &search.floor.whitener)?;
        search.anchors = self.all_anchors();
        let (fall, rms) = (search.explained(), search.current.held_out.rms());
        search.log.push(format!("followed: fall {fall:.1}, held out {rms:.5}"));
        Ok(())
    }

    /// Moves the prediction to the finer model at the numbers of a fit, or on the way to them;
    /// the structure that starts there. `None` where the finer model cannot be run, or explains less
    /// wherever it is tried.
    fn moved_towards(
        &mut self,
        observation: Observation,
        fitted: &Fitted,
        whitener: &Whitener,
    ) -> Result<Option<Structure>, GreyboxError> {
        let stood = match self.standing.clone() {
            Some(place) => {
                let nats = self.nats_at(&place.structure, &place.values, whitener)?;
                Some((place, nats))
            }
            None => None,
        };
        let mut values = fitted.values.clone();
        let anchors = self.all_anchors();
        for _ in 0..=MOST_HALVED {
            if !self.anchor(observation, &fitted.structure, &values)? {
                return Ok(None);
            }
            let nats = self.nats_at(&fitted.structure, &values, whitener)?;
            match &stood {
                Some((place, before)) if nats > before + FARTHER_NATS => {
                    values = place.halfway(&fitted.structure, &values);
                    self.put_back(&anchors);
                }
                _ => return Ok(Some(fitted.structure.clone().started_at(&values))),
            }
        }
        Ok(None)
    }

    /// Cost of the recordings at numbers.
    fn nats_at(
        &self,
        structure: &Structure,
        values: &[f64],
        whitener: &Whitener,
    ) -> Result<f64, GreyboxError> {
        let objective = objective_at(&self.train, structure, values, whitener)?;
        Ok(objective + self.train.noise_nats())
    }
}
