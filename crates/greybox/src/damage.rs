//! How surely damage is there beside numbers of the model file that may do the same.

use inference::Whitener;

use crate::{error::GreyboxError, explain::Session, fit::fit, rival::Judged, structure::Target};

/// Levels that numbers of the file may do the same as: friction, play, turns of all phases, an
/// eccentricity in some direction.
const TOGETHER: [&[usize]; 4] = [&[0], &[1], &[2, 3, 4], &[5, 6]];

/// Least fall that a standard deviation is told from, nats: that of a fifth of one.
const LEAST_FALL: f64 = 0.02;

impl Session<'_> {
    /// A fit whose damage is as uncertain as fits without it leave it.
    ///
    /// Where friction sticks, slopes of a fault and of a number that does the same differ by more than
    /// what the two do, so that each seems to be known. A level `k` without which the objective rises
    /// by `f` has a standard deviation of `k/√(2f)` at least.
    pub(crate) fn profiled(
        &self,
        judged: Judged,
        whitener: &Whitener,
    ) -> Result<Judged, GreyboxError> {
        if !self.machine.has_suspects() {
            return Ok(judged);
        }
        let fitted = &judged.fitted;
        let covariance = judged.covariance(&self.train, whitener);
        let mut least = vec![0.0; fitted.values.len()];
        for together in TOGETHER {
            let is_of = |place: &usize| {
                let target = fitted.structure.free[*place].target;
                matches!(target, Target::Fault(level) if together.contains(&level))
            };
            let (of, others): (Vec<usize>, Vec<usize>) = (0..fitted.values.len()).partition(is_of);
            if !of.iter().any(|&place| fitted.finds_damage(place, &covariance)) {
                continue;
            }
            let values: Vec<f64> = others.iter().map(|&place| fitted.values[place]).collect();
            let without = fitted.structure.only(&others).started_at(&values);
            let without = fit(&self.train, without, whitener)?;
            let fall = (without.objective - fitted.objective).max(LEAST_FALL);
            for place in of {
                least[place] = fitted.values[place].abs() / libm::sqrt(2.0 * fall);
            }
        }
        Ok(judged.with_least_stds(least))
    }

    /// As [`profiled`](Self::profiled), beside a fit that is: where nothing was found both are one, mostly.
    pub(crate) fn profiled_beside(
        &self,
        judged: Judged,
        done: &Judged,
        whitener: &Whitener,
    ) -> Result<Judged, GreyboxError> {
        let (fitted, known) = (&judged.fitted, &done.fitted);
        let is_done = fitted.structure.effects.is_empty()
            && fitted.objective == known.objective
            && fitted.values == known.values;
        if is_done { Ok(done.clone()) } else { self.profiled(judged, whitener) }
    }
}
