//! Effects whose numbers are looked for, as unknowns near one.
//!
//! ```text
//! size       s = u·s₀            s₀ its typical size on the machine
//! shape      a = a₀·e^u          u normal with ln 2
//! place, frequency  b = b₀ + u·w          u normal with one, w the distance of two that are tried
//! ```
//!
//! A size has no prior but the bounds of the catalogue. Orders and switches stay as they are tried.

use ema_sim::{Effect, EffectParameter, Geometry, Role};
use inference::Unknown;

/// Difference of an unknown for its slope.
const STEP: f64 = 0.3;
/// Most that one step may move a size, in typical sizes, and another number.
const REACH: [f64; 2] = [10.0, 1.0];
/// Most that a place or frequency moves, in half distances of two that are tried: beyond, another that
/// was tried is nearer.
const MOST_SHIFT: f64 = 1.5;
/// Standard deviation of a size, in typical sizes: so far beyond what one looks for that the data alone
/// decide, and sizes that do the same stay finite.
const SIZE_STD: f64 = 1e4;

/// A number of an effect that is looked for.
#[derive(Clone, Copy, Debug)]
struct Number {
    place: usize,
    scale: f64,
    law: Law,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Law {
    Size,
    Shape,
    Shift,
}

/// An effect whose numbers are looked for.
#[derive(Clone, Debug)]
pub(crate) struct Acting {
    base: Effect,
    sizes: Vec<Number>,
    shapes: Vec<Number>,
    /// True where each recording has sizes of its own.
    differs: bool,
}

impl Acting {
    /// An effect with the shape that it is tried with, some of its sizes looked for, by the typical
    /// size or distance of each of its numbers.
    pub(crate) fn new(base: Effect, sizes: &[usize], scales: &[f64]) -> Self {
        let info = base.id().info();
        let number = |(place, (parameter, &scale)): (usize, (&EffectParameter, &f64))| {
            let law = match parameter.role() {
                Role::Amplitude if !sizes.contains(&place) => return None,
                Role::Amplitude => Law::Size,
                Role::Shape(multiples) if multiples.len() > 1 => Law::Shape,
                Role::Place | Role::Frequency => Law::Shift,
                _ => return None,
            };
            (scale > 0.0 || law == Law::Shape).then_some(Number { place, scale, law })
        };
        let numbers = info.parameters.iter().zip(scales).enumerate().filter_map(number);
        let (sizes, shapes) = numbers.partition(|number| number.law == Law::Size);
        Self { differs: info.differs_by_recording, base, sizes, shapes }
    }

    /// The effect in recordings held out: as it was found, but for sizes that each recording has of its
    /// own.
    pub(crate) fn held_out(&self, recordings: usize, unknowns: &[f64]) -> Self {
        let sizes_of = |recording: usize| {
            let effect = self.effect(recording, unknowns);
            self.sizes.iter().map(|one| effect.values()[one.place].abs()).collect::<Vec<f64>>()
        };
        let largest = (0..recordings).flat_map(sizes_of).fold(f64::MIN_POSITIVE, f64::max);
        let sizes = if self.differs { self.sizes.clone() } else { Vec::new() };
        // by what they were found to be, so that a step is neither nothing nor all
        let sizes = sizes.into_iter().map(|one| Number { scale: largest, ..one }).collect();
        let base = self.effect(0, unknowns);
        Self { base, sizes, shapes: Vec::new(), differs: self.differs }
    }

    /// The effect with further sizes looked for.
    pub(crate) fn with_sizes(&self, sizes: &[usize], scales: &[f64]) -> Self {
        let mut wider = self.clone();
        for &place in sizes {
            if !self.seeks(place) && scales[place] > 0.0 {
                wider.sizes.push(Number { place, scale: scales[place], law: Law::Size });
            }
        }
        wider
    }

    /// Unknowns of the effect that has further sizes, at those of this one.
    pub(crate) fn widened(&self, wider: &Self, recordings: usize, unknowns: &[f64]) -> Vec<f64> {
        let (own, all) = (self.sizes.len(), wider.sizes.len());
        let copies = self.copies(recordings);
        let mut widened = Vec::new();
        for copy in 0..copies {
            widened.extend(&unknowns[copy * own..(copy + 1) * own]);
            widened.resize((copy + 1) * all, 0.0);
        }
        widened.extend(&unknowns[copies * own..]);
        widened
    }

    /// True where a size is looked for.
    pub(crate) fn seeks(&self, size: usize) -> bool {
        self.sizes.iter().any(|number| number.place == size)
    }

    /// Sets of sizes: one, or one a recording.
    fn copies(&self, recordings: usize) -> usize {
        if self.differs { recordings } else { 1 }
    }

    pub(crate) fn base(&self) -> &Effect {
        &self.base
    }

    /// Sizes and shapes that are looked for in one recording.
    pub(crate) fn numbers(&self) -> usize {
        self.sizes.len() + self.shapes.len()
    }

    /// Unknowns of the effect in so many recordings: sizes, of one recording after the other where each
    /// has its own, then shapes, which all have in common.
    pub(crate) fn len(&self, recordings: usize) -> usize {
        self.sizes.len() * self.copies(recordings) + self.shapes.len()
    }

    /// Places of the unknowns that a recording of so many has.
    pub(crate) fn of_recording(&self, recording: usize, recordings: usize) -> Vec<usize> {
        let begin = if self.differs { recording * self.sizes.len() } else { 0 };
        let shapes = self.sizes.len() * self.copies(recordings);
        let sizes = begin..begin + self.sizes.len();
        sizes.chain(shapes..shapes + self.shapes.len()).collect()
    }

    pub(crate) fn unknowns(&self, recordings: usize) -> Vec<Unknown> {
        let unknown = |place: usize| match self.number(place, recordings).law {
            Law::Size => Unknown { prior_std: Some(SIZE_STD), reach: REACH[0] },
            Law::Shape => Unknown { prior_std: Some(core::f64::consts::LN_2), reach: REACH[1] },
            Law::Shift => Unknown { prior_std: Some(1.0), reach: REACH[1] },
        };
        (0..self.len(recordings)).map(unknown).collect()
    }

    /// Unknowns at which sizes at some places are as given, first those of one recording, and all
    /// others none.
    pub(crate) fn at_sizes(&self, recordings: usize, places: &[usize], sizes: &[f64]) -> Vec<f64> {
        let mut unknowns = Vec::new();
        for copy in 0..self.copies(recordings) {
            for number in &self.sizes {
                let at = places.iter().position(|place| *place == number.place);
                let (least, most) = self.parameter(number).bounds();
                unknowns.push(at.map_or(0.0, |at| {
                    sizes[copy * places.len() + at].clamp(least, most) / number.scale
                }));
            }
        }
        unknowns.resize(self.len(recordings), 0.0);
        unknowns
    }

    /// The effect as a recording has it.
    pub(crate) fn effect(&self, recording: usize, unknowns: &[f64]) -> Effect {
        let mut effect = self.base.clone();
        let begin = if self.differs { recording * self.sizes.len() } else { 0 };
        let shapes = unknowns.len() - self.shapes.len();
        let sizes = self.sizes.iter().zip(&unknowns[begin..]);
        for (number, unknown) in sizes.chain(self.shapes.iter().zip(&unknowns[shapes..])) {
            let key = self.parameter(number).key(Geometry::Rotary);
            // within its bounds the catalogue takes every value
            let _ = effect.set(key, self.value(number, *unknown));
        }
        effect
    }

    /// Values of a number on either side of an unknown between which its slope is taken.
    pub(crate) fn sides(&self, place: usize, recordings: usize, unknown: f64) -> [f64; 2] {
        let number = self.number(place, recordings);
        let own = self.value(number, unknown).to_bits();
        let is_free = |at: f64| self.value(number, at).to_bits() != own;
        let (below, above) = (unknown - STEP, unknown + STEP);
        match (is_free(below), is_free(above)) {
            (false, true) => [unknown, above],
            (true, false) => [below, unknown],
            _ => [below, above],
        }
    }

    /// 95 % interval of each number in the first recording: its key and ends.
    pub(crate) fn intervals(
        &self,
        recordings: usize,
        unknowns: &[f64],
        stds: &[f64],
    ) -> Vec<(&'static str, [f64; 2])> {
        let interval = |place: usize| {
            let number = self.number(place, recordings);
            let key = self.parameter(number).key(Geometry::Rotary);
            let end = |by: f64| self.value(number, unknowns[place] + by * stds[place]);
            (key, [end(-1.96), end(1.96)])
        };
        self.of_recording(0, recordings).into_iter().map(interval).collect()
    }

    fn number(&self, place: usize, recordings: usize) -> &Number {
        let sizes = self.sizes.len() * self.copies(recordings);
        if place < sizes {
            &self.sizes[place % self.sizes.len()]
        } else {
            &self.shapes[place - sizes]
        }
    }

    fn parameter(&self, number: &Number) -> &'static EffectParameter {
        &self.base.id().info().parameters[number.place]
    }

    fn value(&self, number: &Number, unknown: f64) -> f64 {
        let at = self.base.values()[number.place];
        let value = match number.law {
            Law::Size => number.scale * unknown,
            Law::Shape => at * unknown.exp(),
            Law::Shift => at + number.scale * unknown.clamp(-MOST_SHIFT, MOST_SHIFT),
        };
        let (least, most) = self.parameter(number).bounds();
        value.clamp(least, most)
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use ema_sim::EffectId;

    use super::*;

    #[test]
    fn unknowns_near_one_give_the_numbers_of_an_effect_within_its_bounds() {
        let stribeck = Effect::new(EffectId::Stribeck, Geometry::Rotary);
        let sizes = EffectId::Stribeck.info().size_groups().concat();
        let acting = Acting::new(stribeck.clone(), &sizes, &[0.02, 0.0, 0.0]);
        assert_eq!((acting.len(1), acting.len(5)), (3, 3));
        let effect = acting.effect(0, &[1.5, core::f64::consts::LN_2, 0.0]);
        assert_relative_eq!(effect.values()[0], 0.03);
        assert_relative_eq!(effect.values()[1], 2.0 * stribeck.values()[1]);
        assert_eq!(effect.values()[2], stribeck.values()[2]);
        // a friction that cannot be less than none is differenced to one side
        assert!(acting.effect(0, &[-3.0, 0.0, 0.0]).is_off());
        assert_eq!(acting.sides(0, 1, 0.0), [0.0, STEP]);
        assert_eq!(acting.sides(0, 1, 1.0), [1.0 - STEP, 1.0 + STEP]);
        let at = acting.at_sizes(1, &sizes, &[0.05]);
        assert_relative_eq!(at[0], 2.5);
        let [(key, [from, to]), ..] = acting.intervals(1, &at, &[0.5, 0.1, 0.1])[..] else {
            panic!()
        };
        assert_eq!(key, "stribeck_n_m");
        assert_relative_eq!(to - from, 2.0 * 1.96 * 0.5 * 0.02, max_relative = 1e-9);
    }

    #[test]
    fn a_vibration_has_sizes_of_its_own_in_each_recording() {
        let id = EffectId::Vibration;
        let sizes = id.info().size_groups().concat();
        let acting = Acting::new(Effect::new(id, Geometry::Rotary), &sizes, &[0.1, 0.1, 1.0]);
        assert_eq!((acting.len(1), acting.len(2)), (3, 5));
        assert_eq!(acting.of_recording(1, 2), [2, 3, 4]);
        let at = acting.at_sizes(2, &sizes, &[0.1, 0.2, 0.3, 0.4]);
        let sizes_of = |recording| acting.effect(recording, &at).values()[..2].to_vec();
        assert_relative_eq!(sizes_of(0)[..], [0.1, 0.2][..]);
        assert_relative_eq!(sizes_of(1)[..], [0.3, 0.4][..], max_relative = 1e-9);
        // the frequency stays between its neighbours
        let mut far = at.clone();
        far[4] = 9.0;
        let frequency_hz = |unknowns: &[f64]| acting.effect(1, unknowns).values()[2];
        assert_relative_eq!(frequency_hz(&far) - frequency_hz(&at), MOST_SHIFT);
    }

    #[test]
    fn further_sizes_keep_those_found() {
        let id = EffectId::Imbalance;
        let groups = id.info().size_groups();
        let narrow = Acting::new(Effect::new(id, Geometry::Rotary), &groups[0], &[0.1, 0.1, 0.1]);
        let wide = narrow.with_sizes(&groups[1], &[0.1, 0.1, 0.1]);
        assert!(!narrow.seeks(groups[1][0]) && wide.seeks(groups[1][0]));
        let at = narrow.widened(&wide, 1, &[2.0, 3.0]);
        assert_eq!(at, [2.0, 3.0, 0.0]);
        assert_eq!(narrow.effect(0, &[2.0, 3.0]), wide.effect(0, &at));
    }
}
