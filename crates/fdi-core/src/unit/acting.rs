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
/// Standard deviation of a size, in typical sizes: a hundred times what one looks for, so that the
/// data decide.
const SIZE_STD: f64 = 100.0;

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
    numbers: Vec<Number>,
    /// True where each recording has numbers of its own.
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
        let numbers = info.parameters.iter().zip(scales).enumerate().filter_map(number).collect();
        Self { differs: info.differs_by_recording, base, numbers }
    }

    /// The effect in recordings held out: as it was found, but for sizes that each recording has of its
    /// own.
    pub(crate) fn held_out(effect: Effect) -> Self {
        let info = effect.id().info();
        let differs = info.differs_by_recording;
        let number = |(place, parameter): (usize, &EffectParameter)| {
            let is_own = differs && parameter.role() == Role::Amplitude;
            // by what it was found to be, so that a step is neither nothing nor all
            let largest = effect
                .values()
                .iter()
                .zip(info.parameters)
                .filter(|(_, parameter)| parameter.role() == Role::Amplitude);
            let scale = largest.map(|(value, _)| value.abs()).fold(f64::MIN_POSITIVE, f64::max);
            is_own.then_some(Number { place, scale, law: Law::Size })
        };
        let numbers = info.parameters.iter().enumerate().filter_map(number).collect();
        Self { numbers, differs, base: effect }
    }

    /// The effect with further sizes looked for, and where their unknowns stand among its own.
    pub(crate) fn with_sizes(&self, sizes: &[usize], scales: &[f64]) -> Self {
        let is_new = |place: &usize| self.numbers.iter().all(|number| number.place != *place);
        let number = |&place: &usize| Number { place, scale: scales[place], law: Law::Size };
        let mut wider = self.clone();
        wider.numbers.extend(sizes.iter().filter(|place| is_new(place)).map(number));
        wider
    }

    /// Unknowns of the effect that has further numbers, at those of this one.
    pub(crate) fn widened(&self, wider: &Self, recordings: usize, unknowns: &[f64]) -> Vec<f64> {
        let own = self.numbers.len();
        let unknown = |n: usize| {
            let (copy, at) = (n / wider.numbers.len(), n % wider.numbers.len());
            if at < own { unknowns[copy * own + at] } else { 0.0 }
        };
        (0..wider.len(recordings)).map(unknown).collect()
    }

    /// True where a size is looked for.
    pub(crate) fn seeks(&self, size: usize) -> bool {
        self.numbers.iter().any(|number| number.place == size)
    }

    pub(crate) fn base(&self) -> &Effect {
        &self.base
    }

    /// Unknowns of the effect in so many recordings.
    pub(crate) fn len(&self, recordings: usize) -> usize {
        self.numbers.len() * if self.differs { recordings } else { 1 }
    }

    /// Numbers that are looked for in one recording.
    pub(crate) fn numbers(&self) -> usize {
        self.numbers.len()
    }

    /// The unknowns that a recording has.
    pub(crate) fn of_recording(&self, recording: usize) -> core::ops::Range<usize> {
        let begin = if self.differs { recording * self.numbers.len() } else { 0 };
        begin..begin + self.numbers.len()
    }

    pub(crate) fn unknowns(&self, recordings: usize) -> Vec<Unknown> {
        let unknown = |place: usize| match self.number(place).law {
            Law::Size => Unknown { prior_std: Some(SIZE_STD), reach: REACH[0] },
            Law::Shape => Unknown { prior_std: Some(core::f64::consts::LN_2), reach: REACH[1] },
            Law::Shift => Unknown { prior_std: Some(1.0), reach: REACH[1] },
        };
        (0..self.len(recordings)).map(unknown).collect()
    }

    /// Unknowns at which sizes at some places are as given, first those of one recording, and all
    /// others none.
    pub(crate) fn at_sizes(&self, recordings: usize, places: &[usize], sizes: &[f64]) -> Vec<f64> {
        let unknown = |n: usize| {
            let number = self.number(n);
            let copy = n / self.numbers.len();
            let Some(at) = places.iter().position(|place| *place == number.place) else {
                return 0.0;
            };
            let (least, most) = self.parameter(number).bounds();
            sizes[copy * places.len() + at].clamp(least, most) / number.scale
        };
        (0..self.len(recordings)).map(unknown).collect()
    }

    /// The effect as a recording has it.
    pub(crate) fn effect(&self, recording: usize, unknowns: &[f64]) -> Effect {
        let mut effect = self.base.clone();
        for (number, unknown) in self.numbers.iter().zip(&unknowns[self.of_recording(recording)]) {
            let key = self.parameter(number).key(Geometry::Rotary);
            // within its bounds the catalogue takes every value
            let _ = effect.set(key, self.value(number, *unknown));
        }
        effect
    }

    /// Values of a number on either side of an unknown between which its slope is taken.
    pub(crate) fn sides(&self, place: usize, unknown: f64) -> [f64; 2] {
        let number = self.number(place);
        let is_free =
            |at: f64| self.value(number, at).to_bits() != self.value(number, unknown).to_bits();
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
        unknowns: &[f64],
        stds: &[f64],
    ) -> Vec<(&'static str, [f64; 2])> {
        let interval = |(number, place): (&Number, usize)| {
            let key = self.parameter(number).key(Geometry::Rotary);
            let end = |by: f64| self.value(number, unknowns[place] + by * stds[place]);
            (key, [end(-1.96), end(1.96)])
        };
        self.numbers.iter().zip(self.of_recording(0)).map(interval).collect()
    }

    fn number(&self, place: usize) -> &Number {
        &self.numbers[place % self.numbers.len()]
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
        assert_eq!(acting.sides(0, 0.0), [0.0, STEP]);
        assert_eq!(acting.sides(0, 1.0), [1.0 - STEP, 1.0 + STEP]);
        let at = acting.at_sizes(1, &sizes, &[0.05]);
        assert_relative_eq!(at[0], 2.5);
        let [(key, [from, to]), ..] = acting.intervals(&at, &[0.5, 0.1, 0.1])[..] else { panic!() };
        assert_eq!(key, "stribeck_n_m");
        assert_relative_eq!(to - from, 2.0 * 1.96 * 0.5 * 0.02, max_relative = 1e-9);
    }

    #[test]
    fn a_vibration_has_sizes_of_its_own_in_each_recording() {
        let id = EffectId::Vibration;
        let sizes = id.info().size_groups().concat();
        let acting = Acting::new(Effect::new(id, Geometry::Rotary), &sizes, &[0.1, 0.1, 1.0]);
        assert_eq!((acting.len(1), acting.len(2)), (3, 6));
        let at = acting.at_sizes(2, &sizes, &[0.1, 0.2, 0.3, 0.4]);
        let sizes_of = |recording| acting.effect(recording, &at).values()[..2].to_vec();
        assert_relative_eq!(sizes_of(0)[..], [0.1, 0.2][..]);
        assert_relative_eq!(sizes_of(1)[..], [0.3, 0.4][..], max_relative = 1e-9);
        // the frequency stays between its neighbours
        let mut far = at.clone();
        far[2] = 9.0;
        let frequency_hz = |unknowns: &[f64]| acting.effect(0, unknowns).values()[2];
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
