//! Runs that can go side by side, put together.

use crate::vectors::Vectors;

use super::{
    NARROW, Run, WIDTH,
    own_lanes::{Kept, LaneControl, OwnLanes, SideBySide},
};

/// Most runs of which [`NARROW`] go together: three narrow groups cost less than a wide one.
const MOST_NARROW: usize = 12;

/// The controller of one run, which may go beside others.
pub(crate) trait LaneLaw: Clone {
    /// Controllers side by side.
    type Lanes<const N: usize>: LaneControl<N>;

    /// True where another one differs in its numbers alone.
    fn is_like(&self, other: &Self) -> bool;

    /// Controllers side by side; `None` of none.
    fn lanes<const N: usize>(laws: &[Self]) -> Option<Self::Lanes<N>>;
}

/// A run at its start, with its controller and a command for each tick.
pub(crate) struct Member<'a, L> {
    /// Place among all runs asked for.
    pub(crate) place: usize,
    pub(crate) run: Run,
    pub(crate) law: L,
    pub(crate) commands: &'a [f64],
    pub(crate) tick_s: f64,
}

/// Runs of which some signals are kept, every `step`-th value of each.
pub(crate) struct Group<'a, L> {
    pub(crate) members: Vec<Member<'a, L>>,
    pub(crate) kept: &'a [Kept],
    pub(crate) step: usize,
}

impl<L: LaneLaw> Group<'_, L> {
    /// Runs all of them; gives the signals of each with its place. Those with the same effects go
    /// together first, then those that this leaves without another. One that still has no other
    /// beside it runs `alone`, and so do all where there are no wide vectors.
    pub(crate) fn run(
        mut self,
        alone: impl Fn(usize) -> Vec<Vec<f64>>,
        mut take: impl FnMut(usize, Vec<Vec<f64>>),
    ) {
        // runs of one length end together
        self.members.sort_by_key(|member| core::cmp::Reverse(member.commands.len()));
        let Self { members, kept, step } = self;
        let mut single = Vec::new();
        for mut alike in sets(members, |a, b| a.is_like(b) && a.run.has_effects_of(&b.run)) {
            if alike.len() == 1 && alike[0].run.may_differ_in_effects() {
                single.append(&mut alike);
            } else {
                side_by_side(alike, kept, step, &alone, &mut take);
            }
        }
        for alike in sets(single, Member::is_like) {
            side_by_side(alike, kept, step, &alone, &mut take);
        }
    }
}

impl<L: LaneLaw> Member<'_, L> {
    /// True where another one may go beside it, but for the effects of both.
    fn is_like(&self, other: &Self) -> bool {
        self.law.is_like(&other.law) && self.tick_s.to_bits() == other.tick_s.to_bits()
    }
}

/// Members in sets that are alike, in their order.
fn sets<'a, L>(
    members: Vec<Member<'a, L>>,
    is_like: impl Fn(&Member<'a, L>, &Member<'a, L>) -> bool,
) -> Vec<Vec<Member<'a, L>>> {
    let mut sets: Vec<Vec<Member<'a, L>>> = Vec::new();
    for member in members {
        match sets.iter_mut().find(|set| is_like(&set[0], &member)) {
            Some(set) => set.push(member),
            None => sets.push(vec![member]),
        }
    }
    sets
}

/// Runs members that are alike, as many at a time as go together.
fn side_by_side<L: LaneLaw>(
    members: Vec<Member<'_, L>>,
    kept: &[Kept],
    step: usize,
    alone: &impl Fn(usize) -> Vec<Vec<f64>>,
    take: &mut impl FnMut(usize, Vec<Vec<f64>>),
) {
    let mut left = members.into_iter();
    while left.len() > 0 {
        let width = if left.len() > MOST_NARROW { WIDTH } else { NARROW };
        let members: Vec<Member<'_, L>> = left.by_ref().take(width).collect();
        let places: Vec<usize> = members.iter().map(|member| member.place).collect();
        let signals = if width == WIDTH {
            in_lanes::<WIDTH, L>(members, kept, step)
        } else {
            in_lanes::<NARROW, L>(members, kept, step)
        };
        match signals {
            Some(signals) => places.iter().zip(signals).for_each(|(n, of)| take(*n, of)),
            None => places.iter().for_each(|n| take(*n, alone(*n))),
        }
    }
}

/// Runs at most `N` members that are alike; `None` where that gains nothing.
fn in_lanes<const N: usize, L: LaneLaw>(
    members: Vec<Member<'_, L>>,
    kept: &[Kept],
    step: usize,
) -> Option<Vec<Vec<Vec<f64>>>> {
    // the loops of lanes have no code for machines without wide vectors, which would be as much again
    let vectors = Vectors::of_processor()?;
    if members.len() < 2 {
        return None;
    }
    let laws: Vec<L> = members.iter().map(|member| member.law.clone()).collect();
    let commands: Vec<&[f64]> = members.iter().map(|member| member.commands).collect();
    let ticks: Vec<usize> = commands.iter().map(|command| command.len()).collect();
    let tick_s = members[0].tick_s;
    let control = L::lanes::<N>(&laws)?;
    let runs = members.into_iter().map(|member| member.run).collect();
    let lanes = OwnLanes::<N, _>::of(runs, control, tick_s, &ticks, vectors);
    Some(vectors.run(SideBySide { lanes, commands: &commands, kept, step }))
}
