//! Effects of the catalogue switched on one at a time, each by as much as the noise lets one see.

use core::ops::Range;

use ema_sim::Effect;
use inference::Whitener;

use crate::{
    error::{GreyboxError, if_run},
    fit::whitened,
    gram::dot,
    hypothesis::{Family, Scales, differs_by_record, first_size, is_nonlinear_in_size, multiples},
    machine::State,
    parallel,
    problem::{PerRecord, Problem},
};

/// Change, in units of the noise, that a size tried is to make.
const WANTED_CHANGE: [f64; 2] = [5.0, 60.0];
/// Change wanted where a size was found by one recording of several.
const TAKEN_CHANGE: [f64; 2] = [1.0, 200.0];
/// Largest change of a size at once.
const MOST_RESIZED: f64 = 1e2;
/// How often a size may be changed.
const MOST_RESIZINGS: usize = 2;

/// One effect with its shapes, switched on a little.
#[derive(Clone, Debug)]
pub(crate) struct Tried {
    /// Which question.
    pub(crate) family: usize,
    /// The effect with all sizes zero.
    pub(crate) plain: Effect,
    /// Places and values of the sizes tried.
    pub(crate) sizes: Vec<(usize, f64)>,
    /// Change of the prediction by each.
    pub(crate) columns: Vec<PerRecord>,
}

impl Tried {
    /// Tells whether the prediction is the same to the last bit.
    fn does_nothing(&self) -> bool {
        self.columns.iter().flatten().flatten().all(|change| *change == 0.0)
    }
}

/// A state of a machine in which effects are switched on.
pub(crate) struct Trial<'a> {
    pub(crate) problem: &'a Problem<'a>,
    pub(crate) state: &'a State,
    /// Motion of the machine in it.
    pub(crate) drive: &'a PerRecord,
    pub(crate) whitener: &'a Whitener,
    pub(crate) scales: &'a Scales,
    /// Trials in another state, with sizes that were seen there.
    pub(crate) before: &'a [Tried],
}

/// A shape of a question.
struct Candidate<'f> {
    family: usize,
    sizes: &'f [usize],
    plain: &'f Effect,
    multiple: f64,
}

impl Trial<'_> {
    /// Switches on each effect in each shape. What does nothing at all in its first shape, as a
    /// resistance where the supply is never used up, is tried in no other.
    pub(crate) fn run(&self, families: &[Family]) -> Result<Vec<Tried>, GreyboxError> {
        let by_family: Vec<Vec<Candidate<'_>>> =
            families.iter().enumerate().map(|(place, of)| candidates(place, of)).collect();
        let firsts: Vec<&Candidate<'_>> = by_family.iter().filter_map(|of| of.first()).collect();
        let mut tried = self.of(&firsts)?;
        let idle: Vec<usize> =
            tried.iter().filter(|tried| tried.does_nothing()).map(|tried| tried.family).collect();
        let others = by_family.iter().flat_map(|of| of.iter().skip(1));
        let others: Vec<&Candidate<'_>> = others.filter(|c| !idle.contains(&c.family)).collect();
        tried.extend(self.of(&others)?);
        tried.sort_by_key(|tried| tried.family);
        Ok(tried)
    }

    /// Candidates that this machine, or this machine with the others, can have.
    fn of(&self, candidates: &[&Candidate<'_>]) -> Result<Vec<Tried>, GreyboxError> {
        let outcomes = parallel::map(candidates, self.problem.jobs, |of| self.tried(of));
        outcomes.into_iter().filter_map(Result::transpose).collect()
    }

    fn tried(&self, candidate: &Candidate<'_>) -> Result<Option<Tried>, GreyboxError> {
        let Candidate { family, sizes, plain, .. } = candidate;
        let mut tried = Tried {
            family: *family,
            plain: (*plain).clone(),
            sizes: Vec::new(),
            columns: Vec::new(),
        };
        for &place in *sizes {
            let Some((size, columns)) = self.sized(candidate, place)? else { return Ok(None) };
            if differs_by_record(plain.id()) {
                for record in 0..columns.len() {
                    tried.sizes.push((place, size));
                    tried.columns.push(alone(&columns, record));
                }
            } else {
                tried.sizes.push((place, size));
                tried.columns.push(columns);
            }
        }
        Ok(Some(tried))
    }

    /// A size that is seen, with what it does. How far off the first one is, is told by one
    /// recording where that shows the effect at all.
    fn sized(
        &self,
        candidate: &Candidate<'_>,
        place: usize,
    ) -> Result<Option<(f64, PerRecord)>, GreyboxError> {
        let plain = candidate.plain;
        let all = self.problem.records.len();
        let (least, most) = plain.id().info().parameters[place].bounds();
        let mut size = self.first_size(candidate, place);
        let mut among = 0..all.min(1);
        let mut wanted = WANTED_CHANGE;
        let mut left = if is_nonlinear_in_size(plain.id()) { 0 } else { MOST_RESIZINGS };
        let mut changes = self.change(plain, place, size, among.clone())?;
        while let Some(mut columns) = changes {
            let seen = self.seen(&columns);
            let is_told = seen > 0.0 || among.end == all;
            let next = (size * resized(seen, wanted)).clamp(least, most);
            if left > 0 && is_told && next != size {
                (size, left) = (next, left - 1);
                changes = self.change(plain, place, size, among.clone())?;
            } else if among.end < all {
                let rest = self.change(plain, place, size, among.end..all)?;
                changes = rest.map(|rest| {
                    columns.extend(rest);
                    columns
                });
                (among.end, wanted) = (all, TAKEN_CHANGE);
            } else {
                return Ok(Some((size, columns)));
            }
        }
        Ok(None)
    }

    /// The size at which it was seen before, or a guess.
    fn first_size(&self, Candidate { plain, multiple, .. }: &Candidate<'_>, place: usize) -> f64 {
        let same = |tried: &&Tried| tried.plain == **plain && !is_nonlinear_in_size(plain.id());
        let mut before = self.before.iter().filter(same).flat_map(|tried| &tried.sizes);
        let seen = before.find(|(of, _)| *of == place);
        let parameter = &plain.id().info().parameters[place];
        let guess = || multiple * first_size(parameter, self.scales);
        seen.map_or_else(guess, |(_, size)| *size)
    }

    /// Change of some of the recordings by a size of an effect; `None` where the machine cannot
    /// have it.
    fn change(
        &self,
        plain: &Effect,
        place: usize,
        size: f64,
        records: Range<usize>,
    ) -> Result<Option<PerRecord>, GreyboxError> {
        let Problem { machine, records: all, .. } = self.problem;
        let key = plain.id().info().parameters[place].key(machine.geometry());
        let Ok(effect) = plain.clone().with(key, size) else { return Ok(None) };
        let mut on = self.state.clone();
        on.add(&effect);
        let mut columns = Vec::new();
        for (prepared, off) in all[records.clone()].iter().zip(&self.drive[records]) {
            let Some(with) = if_run(prepared.drive(machine, &on))? else { return Ok(None) };
            columns.push(with.iter().zip(off).map(|(a, b)| a - b).collect());
        }
        Ok(Some(columns))
    }

    /// Size of a change of all recordings in units of the noise, as some of them show it.
    fn seen(&self, columns: &PerRecord) -> f64 {
        let white = whitened(self.whitener, columns);
        let share = white.len() as f64 / self.problem.samples() as f64;
        libm::sqrt(dot(&white, &white) / share)
    }
}

/// A question in all its shapes.
fn candidates(family: usize, of: &Family) -> Vec<Candidate<'_>> {
    let Family { sizes, shapes, .. } = of;
    let multiples = multiples(of.id);
    let sized =
        |plain| multiples.iter().map(move |&multiple| Candidate { family, sizes, plain, multiple });
    shapes.iter().flat_map(sized).collect()
}

/// Factor on a size that is seen too little or too much.
fn resized(seen: f64, [lower, upper]: [f64; 2]) -> f64 {
    if (lower..=upper).contains(&seen) || !seen.is_finite() {
        return 1.0;
    }
    let [lower, upper] = WANTED_CHANGE;
    let middle = 0.5 * (lower + upper);
    if seen > 0.0 { (middle / seen).clamp(1e-3, MOST_RESIZED) } else { MOST_RESIZED }
}

/// The signal of one recording, the others silent.
fn alone(columns: &PerRecord, place: usize) -> PerRecord {
    let of = |(n, column): (usize, &Vec<f64>)| {
        if n == place { column.clone() } else { vec![0.0; column.len()] }
    };
    columns.iter().enumerate().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_seen_too_much_or_too_little_is_led_to_the_middle() {
        assert_eq!(resized(30.0, WANTED_CHANGE), 1.0);
        assert_eq!(resized(65.0, WANTED_CHANGE), 0.5);
        assert_eq!(resized(0.0, WANTED_CHANGE), MOST_RESIZED);
        assert_eq!(resized(1e9, WANTED_CHANGE), 1e-3);
        // sized by one recording of several, the others may show it otherwise
        assert_eq!(resized(65.0, TAKEN_CHANGE), 1.0);
        assert_eq!(resized(f64::NAN, WANTED_CHANGE), 1.0);
    }
}
