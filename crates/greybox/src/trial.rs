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
    /// Multiple of the first size that it was tried at.
    multiple: f64,
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
    pub(crate) before: Before<'a>,
}

/// Trials that were made before.
#[derive(Clone, Copy)]
pub(crate) enum Before<'a> {
    /// None.
    None,
    /// In another state, with sizes that were seen there.
    Elsewhere(&'a [Tried]),
    /// In a state so near that effects do the same in it.
    Here(&'a [Tried]),
}

impl<'a> Before<'a> {
    fn tried(self) -> &'a [Tried] {
        match self {
            Self::None => &[],
            Self::Elsewhere(tried) | Self::Here(tried) => tried,
        }
    }
}

/// A shape of a question.
struct Candidate<'f> {
    family: usize,
    sizes: &'f [usize],
    plain: &'f Effect,
    multiple: f64,
}

/// The search for a size of an effect that is seen.
struct Sizing<'c> {
    plain: &'c Effect,
    place: usize,
    size: f64,
    /// Recordings that were asked so far, and that are asked now.
    among: Range<usize>,
    asked: Option<Range<usize>>,
    wanted: [f64; 2],
    /// How often it may still be changed.
    left: usize,
    /// Change of each recording; `None` where the machine cannot have the effect.
    columns: Option<PerRecord>,
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
        let (mut known, mut new) = (Vec::new(), Vec::new());
        for candidate in candidates {
            match self.known(candidate) {
                Some(tried) => known.push(tried),
                None => new.push(*candidate),
            }
        }
        let mut tried = self.of_new(&new)?;
        tried.extend(known);
        Ok(tried)
    }

    /// A candidate that was tried here before, with sizes that are seen beside this noise too.
    fn known(&self, candidate: &Candidate<'_>) -> Option<Tried> {
        let Before::Here(before) = self.before else { return None };
        let same = |tried: &&Tried| {
            tried.plain == *candidate.plain && tried.multiple == candidate.multiple
        };
        let tried = before.iter().find(same)?;
        let mut places: Vec<usize> = tried.sizes.iter().map(|(place, _)| *place).collect();
        places.dedup();
        let is_seen = |columns: &PerRecord| resized(self.seen(columns), TAKEN_CHANGE) == 1.0;
        let suits = is_nonlinear_in_size(candidate.plain.id()) || tried.columns.iter().all(is_seen);
        (suits && places == candidate.sizes)
            .then(|| Tried { family: candidate.family, ..tried.clone() })
    }

    /// Candidates that were not tried here before.
    fn of_new(&self, candidates: &[&Candidate<'_>]) -> Result<Vec<Tried>, GreyboxError> {
        let places = |candidate: &&'_ Candidate<'_>| candidate.sizes.len();
        let mut sizings: Vec<Sizing<'_>> = candidates
            .iter()
            .flat_map(|of| of.sizes.iter().map(|&place| self.sizing(of, place)))
            .collect();
        self.settle(&mut sizings)?;
        let mut sizings = sizings.into_iter();
        let mut of = |candidate: &&Candidate<'_>| {
            let sized: Vec<Sizing<'_>> = sizings.by_ref().take(places(candidate)).collect();
            tried(candidate, sized)
        };
        Ok(candidates.iter().filter_map(&mut of).collect())
    }

    /// The search for a size that is seen.
    fn sizing<'c>(&self, candidate: &'c Candidate<'_>, place: usize) -> Sizing<'c> {
        let among = 0..self.problem.records.len().min(1);
        Sizing {
            plain: candidate.plain,
            place,
            size: self.first_size(candidate, place),
            wanted: WANTED_CHANGE,
            left: if is_nonlinear_in_size(candidate.plain.id()) { 0 } else { MOST_RESIZINGS },
            asked: Some(among.clone()),
            among,
            columns: Some(PerRecord::new()),
        }
    }

    /// Finds sizes that are seen, all at once. How far off a first one is, is told by one recording
    /// where that shows the effect at all.
    fn settle(&self, sizings: &mut [Sizing<'_>]) -> Result<(), GreyboxError> {
        loop {
            let mut asking: Vec<&mut Sizing<'_>> =
                sizings.iter_mut().filter(|sizing| sizing.asked.is_some()).collect();
            if asking.is_empty() {
                return Ok(());
            }
            let changes = self.changes(&asking)?;
            for (sizing, changes) in asking.iter_mut().zip(changes) {
                self.take(sizing, changes);
            }
        }
    }

    /// Takes what a size does in the recordings asked for, and asks for more, or for another size,
    /// where that is not enough.
    fn take(&self, sizing: &mut Sizing<'_>, changes: Option<PerRecord>) {
        let all = self.problem.records.len();
        let rest = sizing.asked.take().is_some_and(|asked| asked.start > 0);
        let (Some(changes), Some(columns)) = (changes, &mut sizing.columns) else {
            sizing.columns = None;
            return;
        };
        if rest {
            columns.extend(changes);
            (sizing.among.end, sizing.wanted) = (all, TAKEN_CHANGE);
        } else {
            *columns = changes;
        }
        let seen = self.seen(columns);
        let is_told = seen > 0.0 || sizing.among.end == all;
        let (least, most) = sizing.plain.id().info().parameters[sizing.place].bounds();
        let next = (sizing.size * resized(seen, sizing.wanted)).clamp(least, most);
        if sizing.left > 0 && is_told && next != sizing.size {
            (sizing.size, sizing.left) = (next, sizing.left - 1);
            sizing.asked = Some(sizing.among.clone());
        } else if sizing.among.end < all {
            sizing.asked = Some(sizing.among.end..all);
        }
    }

    /// The size at which it was seen before, or a guess.
    fn first_size(&self, Candidate { plain, multiple, .. }: &Candidate<'_>, place: usize) -> f64 {
        let same = |tried: &&Tried| tried.plain == **plain && !is_nonlinear_in_size(plain.id());
        let mut before = self.before.tried().iter().filter(same).flat_map(|tried| &tried.sizes);
        let seen = before.find(|(of, _)| *of == place);
        let parameter = &plain.id().info().parameters[place];
        let guess = || multiple * first_size(parameter, self.scales);
        seen.map_or_else(guess, |(_, size)| *size)
    }

    /// Change of the recordings asked for by each size; `None` where the machine cannot have it.
    fn changes(&self, asking: &[&mut Sizing<'_>]) -> Result<Vec<Option<PerRecord>>, GreyboxError> {
        let states: Vec<Option<State>> = asking.iter().map(|of| self.switched_on(of)).collect();
        let asked = |of: &&mut Sizing<'_>| of.asked.clone().unwrap_or_default();
        let work: Vec<(&State, usize)> = states
            .iter()
            .zip(asking)
            .filter_map(|(state, of)| Some((state.as_ref()?, asked(of))))
            .flat_map(|(state, records)| records.map(move |record| (state, record)))
            .collect();
        let drives = self.problem.drives_each(&work).into_iter().zip(&work);
        let change = |(with, (_, record)): (Result<Vec<f64>, GreyboxError>, &(&State, usize))| {
            let less = |with: Vec<f64>| {
                with.iter().zip(&self.drive[*record]).map(|(a, b)| a - b).collect::<Vec<f64>>()
            };
            Ok(if_run(with)?.map(less))
        };
        let mut changes = drives.map(change).collect::<Vec<_>>().into_iter();
        let mut of = |(state, of): (&Option<State>, &&mut Sizing<'_>)| {
            if state.is_none() {
                return Ok(None);
            }
            // all of its own are taken, whatever one of them says
            let own: Vec<Result<_, _>> = changes.by_ref().take(asked(of).len()).collect();
            own.into_iter().collect()
        };
        states.iter().zip(asking).map(&mut of).collect()
    }

    /// The machine with an effect of a size; `None` where there is no such effect.
    fn switched_on(&self, sizing: &Sizing<'_>) -> Option<State> {
        let Sizing { plain, place, size, .. } = sizing;
        let key = plain.id().info().parameters[*place].key(self.problem.machine.geometry());
        let effect = (*plain).clone().with(key, *size).ok()?;
        let mut on = self.state.clone();
        on.add(&effect);
        Some(on)
    }

    /// Size of a change of all recordings in units of the noise, as some of them show it.
    fn seen(&self, columns: &PerRecord) -> f64 {
        let white = whitened(self.whitener, columns);
        let share = white.len() as f64 / self.problem.samples() as f64;
        libm::sqrt(dot(&white, &white) / share)
    }
}

/// A candidate with the sizes found; `None` where the machine cannot have one of them.
fn tried(candidate: &Candidate<'_>, sized: Vec<Sizing<'_>>) -> Option<Tried> {
    let &Candidate { family, plain, multiple, .. } = candidate;
    let (mut sizes, mut all) = (Vec::new(), Vec::new());
    for Sizing { place, size, columns, .. } in sized {
        let columns = columns?;
        if differs_by_record(plain.id()) {
            for record in 0..columns.len() {
                sizes.push((place, size));
                all.push(alone(&columns, record));
            }
        } else {
            sizes.push((place, size));
            all.push(columns);
        }
    }
    Some(Tried { family, plain: plain.clone(), multiple, sizes, columns: all })
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
pub(crate) fn alone(columns: &PerRecord, place: usize) -> PerRecord {
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
