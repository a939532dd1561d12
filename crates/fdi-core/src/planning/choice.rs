//! Motions that leave some faults least open, within a time.

use ema_sim::FaultId;

use crate::unit::quantities::Quantities;

use super::{
    expectation::{Beside, Worth},
    motion::SAME_TIME_S,
};

/// Least gain in the objective that a motion is exchanged for.
const LEAST_GAIN: f64 = 1e-4;
/// Rounds of exchanges.
const ROUNDS: usize = 8;

/// A motion that may be taken: its length and its worth.
pub(super) struct Candidate {
    pub(super) duration_s: f64,
    pub(super) worth: Worth,
}

/// Looks for the motions of a test.
///
/// ```text
/// min Σ_f ln s_f
/// ```
///
/// over sets of motions that last no longer than some time together, with `s_f` the expected standard
/// deviation of each fault asked for: motions are added that gain most a second, and exchanged for others
/// as long as that gains.
pub(super) struct Choice<'a> {
    pub(super) candidates: &'a [Candidate],
    pub(super) nothing: &'a Worth,
    pub(super) quantities: &'a Quantities,
    pub(super) beside: Beside,
    pub(super) faults: &'a [FaultId],
    pub(super) within_s: f64,
}

impl Choice<'_> {
    /// Places of the motions, in the order of the candidates.
    pub(super) fn motions(&self) -> Vec<usize> {
        let mut chosen = Vec::new();
        self.add(&mut chosen);
        for _ in 0..ROUNDS {
            let before = self.objective(&chosen);
            self.exchange(&mut chosen);
            self.add(&mut chosen);
            if self.objective(&chosen) > before - LEAST_GAIN {
                break;
            }
        }
        chosen.sort_unstable();
        chosen
    }

    /// Adds motions that gain most a second, until none fits.
    fn add(&self, chosen: &mut Vec<usize>) {
        loop {
            let now = self.objective(chosen);
            let left_s = self.within_s - self.duration_s(chosen);
            let gain = |place: usize| {
                let with = [chosen.as_slice(), &[place]].concat();
                (now - self.objective(&with)) / self.candidates[place].duration_s
            };
            let best = (0..self.candidates.len())
                .filter(|place| {
                    !chosen.contains(place)
                        && self.candidates[*place].duration_s <= left_s + SAME_TIME_S
                })
                .map(|place| (place, gain(place)))
                .max_by(|a, b| a.1.total_cmp(&b.1));
            match best {
                Some((place, gain)) if gain > 0.0 => chosen.push(place),
                _ => return,
            }
        }
    }

    /// Exchanges each motion for the one, or for none, that gains most.
    fn exchange(&self, chosen: &mut Vec<usize>) {
        for place in (0..chosen.len()).rev() {
            let old = chosen.remove(place);
            let left_s = self.within_s - self.duration_s(chosen);
            let with = |new: usize| self.objective(&[chosen.as_slice(), &[new]].concat());
            let best = (0..self.candidates.len())
                .filter(|new| {
                    !chosen.contains(new)
                        && self.candidates[*new].duration_s <= left_s + SAME_TIME_S
                })
                .map(|new| (new, with(new)))
                .min_by(|a, b| a.1.total_cmp(&b.1));
            chosen.push(best.map_or(old, |(new, _)| new));
        }
    }

    fn duration_s(&self, chosen: &[usize]) -> f64 {
        chosen.iter().map(|place| self.candidates[*place].duration_s).sum()
    }

    /// Worth of a set of motions.
    fn worth(&self, chosen: &[usize]) -> Worth {
        chosen
            .iter()
            .fold(self.nothing.clone(), |sum, place| sum.and(&self.candidates[*place].worth))
    }

    fn objective(&self, chosen: &[usize]) -> f64 {
        let stds = self.worth(chosen).stds(self.quantities, &self.beside);
        stds.map_or(f64::INFINITY, |stds| {
            self.faults.iter().map(|fault| stds[fault.index()].ln()).sum()
        })
    }
}
