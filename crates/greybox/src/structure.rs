//! Free numbers of a model in a fit: rough numbers, damage, numbers of effects.

use ema_sim::{Effect, FAULT_COUNT, FaultCoordinates, MotionTerm, Role};

use crate::{
    machine::{Machine, State},
    prior::Prior,
};

/// Target of a free number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// A number that the data sheet knows only roughly, by its place among them.
    Rough(usize),
    /// A coordinate of damage.
    Fault(usize),
    /// A number of an effect, by the effect's place in the structure and its own there.
    Effect(usize, usize),
    /// A number of an effect in one recording alone.
    InRecord { record: usize, effect: usize, place: usize },
}

/// One free number.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Free {
    pub(crate) target: Target,
    pub(crate) key: String,
    pub(crate) start: f64,
    pub(crate) least: f64,
    pub(crate) most: f64,
    /// Difference with which derivatives are taken.
    pub(crate) step: f64,
    /// Most that one step of a search may move it.
    pub(crate) reach: f64,
    pub(crate) prior: Option<Prior>,
}

impl Free {
    /// How far a step from a value may lead, downwards and upwards.
    pub(crate) fn room(&self, value: f64) -> (f64, f64) {
        ((self.least - value).max(-self.reach), (self.most - value).min(self.reach))
    }
}

/// A hypothesis on what the machine does: effects, and what is free.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Structure {
    pub(crate) effects: Vec<Effect>,
    pub(crate) free: Vec<Free>,
}

/// Difference of a fault level with which derivatives are taken.
const FAULT_STEP: f64 = 0.01;

/// Most that a step of a search may change a fault level: what damage does bends within that.
const FAULT_REACH: f64 = 0.1;

/// Standard deviation of a fault level beforehand, with a tail of powers: 0.5 costs 8 nats.
const USUAL_DAMAGE: f64 = 0.05;

/// Multiples of its value that a number may be off before a calibration gives it up.
const FARTHEST: f64 = 5.0;

/// A tenth of its value, for what cannot be zero.
fn least_of(free: &Free) -> f64 {
    let positive = free.least > 0.0 && free.least < 1e-300;
    if positive { 0.1 * free.start } else { free.least }
}

impl Structure {
    /// The nominal machine with its rough numbers and its damage free.
    pub(crate) fn nominal(machine: &Machine) -> Self {
        let rough = machine.rough().iter().enumerate().map(|(place, rough)| {
            let (least, most) = rough.reach();
            Free {
                target: Target::Rough(place),
                key: rough.key.clone(),
                start: rough.value,
                least: rough.least.max(least),
                most: rough.most.min(most),
                step: 0.1 * rough.half_width,
                reach: f64::INFINITY,
                prior: Some(rough.prior()),
            }
        });
        let rough = rough.map(|free| Free { least: free.least.max(least_of(&free)), ..free });
        // beside numbers that do the same, health is likelier; alone, damage is what recordings say
        let health = Prior { mean: 0.0, std: USUAL_DAMAGE, has_tail: true };
        let of_faults = machine.has_suspects().then_some(health);
        let faults = machine.fault_coordinates().into_iter().map(|place| Free {
            target: Target::Fault(place),
            key: FaultCoordinates::NAMES[place].to_owned(),
            start: 0.0,
            least: if place < 5 { 0.0 } else { -1.0 },
            most: 1.0,
            step: FAULT_STEP,
            reach: FAULT_REACH,
            prior: of_faults,
        });
        let free = rough.chain(faults).filter(|free| free.most > free.least).collect();
        Self { effects: Vec::new(), free }
    }

    /// A healthy machine whose rough numbers are found from recordings alone: no tolerance
    /// holds, and none serves as a prior.
    ///
    /// `torque`, `speed` and `inertia` are the sizes that a number without a nominal value may
    /// have.
    pub(crate) fn calibration(machine: &Machine, torque: f64, speed: f64) -> Self {
        let free = machine.rough().iter().enumerate().map(|(place, rough)| {
            let scale = if rough.value != 0.0 {
                rough.value.abs()
            } else if rough.motion_term == Some(MotionTerm::Drag) {
                0.3 * torque / speed.max(1e-12)
            } else {
                0.3 * torque
            };
            Free {
                target: Target::Rough(place),
                key: rough.key.clone(),
                start: rough.value,
                least: rough.least.max(rough.value - FARTHEST * scale),
                most: rough.most.min(rough.value + FARTHEST * scale),
                step: 0.02 * scale,
                reach: f64::INFINITY,
                prior: None,
            }
        });
        let free = free.map(|free| Free { least: free.least.max(least_of(&free)), ..free });
        Self { effects: Vec::new(), free: free.collect() }
    }

    /// Structure with one more effect, some of whose numbers are free.
    pub(crate) fn with_effect(&self, effect: Effect, numbers: &[Number]) -> Self {
        let mut structure = self.clone();
        let place = structure.effects.len();
        let info = effect.id().info();
        for number in numbers {
            let parameter = &info.parameters[number.place];
            let (least, most) = parameter.bounds();
            let (target, start) = match number.in_record {
                Some((record, start)) => {
                    (Target::InRecord { record, effect: place, place: number.place }, start)
                }
                None => (Target::Effect(place, number.place), effect.values()[number.place]),
            };
            structure.free.push(Free {
                target,
                key: parameter.key(effect.geometry()).to_owned(),
                start,
                least: least.max(number.least),
                most: most.min(number.most),
                step: number.step,
                reach: f64::INFINITY,
                prior: None,
            });
        }
        structure.effects.push(effect);
        structure
    }

    /// Structure with an effect of another structure, which starts from what was found there.
    pub(crate) fn with_effect_of(&self, other: &Self, values: &[f64], place: usize) -> Self {
        let mut structure = self.clone();
        let here = structure.effects.len();
        for (free, value) in other.free.iter().zip(values) {
            let target = match free.target {
                Target::Effect(of, number) if of == place => Target::Effect(here, number),
                Target::InRecord { record, effect, place: number } if effect == place => {
                    Target::InRecord { record, effect: here, place: number }
                }
                _ => continue,
            };
            structure.free.push(Free { target, start: *value, ..free.clone() });
        }
        structure.effects.push(other.effects[place].clone());
        structure
    }

    /// Places of the free numbers that are one number in all recordings.
    pub(crate) fn same_everywhere(&self) -> Vec<usize> {
        let differs = |free: &Free| matches!(free.target, Target::InRecord { .. });
        (0..self.free.len()).filter(|&place| !differs(&self.free[place])).collect()
    }

    /// Structure with some of the free numbers alone; the others are as they stand in the effects.
    pub(crate) fn only(&self, kept: &[usize]) -> Self {
        let free = kept.iter().map(|&place| self.free[place].clone()).collect();
        Self { effects: self.effects.clone(), free }
    }

    /// Structure without an effect, started from what was found.
    pub(crate) fn without_effect(&self, values: &[f64], place: usize) -> Self {
        let of = |free: &Free| matches!(free.target, Target::Rough(_) | Target::Fault(_));
        let base = self.clone().started_at(values);
        let kept = base.free.iter().filter(|free| of(free)).cloned().collect();
        let mut structure = Self { effects: Vec::new(), free: kept };
        for other in (0..self.effects.len()).filter(|&other| other != place) {
            structure = structure.with_effect_of(self, values, other);
        }
        structure
    }

    /// Starts a fit from levels of friction and backlash.
    pub(crate) fn started_worn(mut self, levels: [f64; 2]) -> Self {
        for free in &mut self.free {
            if let Target::Fault(place @ 0..=1) = free.target {
                free.start = levels[place];
            }
        }
        self
    }

    /// Starts a fit from no damage.
    pub(crate) fn started_healthy(mut self) -> Self {
        for free in &mut self.free {
            if let Target::Fault(_) = free.target {
                free.start = 0.0;
            }
        }
        self
    }

    /// Starts a fit from found values.
    pub(crate) fn started_at(mut self, values: &[f64]) -> Self {
        for (free, value) in self.free.iter_mut().zip(values) {
            free.start = *value;
        }
        self
    }

    /// Starts a fit from values found for a part of it.
    pub(crate) fn started_at_part(mut self, part: &Self, values: &[f64]) -> Self {
        for (known, value) in part.free.iter().zip(values) {
            if let Some(free) = self.free.iter_mut().find(|free| free.target == known.target) {
                free.start = *value;
            }
        }
        self
    }

    /// Cost of values by what is known beforehand, nats.
    pub(crate) fn cost_of(&self, values: &[f64]) -> f64 {
        let of = |(free, value): (&Free, &f64)| free.prior.map_or(0.0, |prior| prior.cost(*value));
        self.free.iter().zip(values).map(of).sum()
    }

    /// Where its numbers start.
    pub(crate) fn starts(&self) -> Vec<f64> {
        self.free.iter().map(|free| free.start).collect()
    }

    /// The state of the machine at values of the free numbers.
    pub(crate) fn state(&self, machine: &Machine, values: &[f64]) -> State {
        let mut state = self.state_elsewhere(machine, values);
        for (free, &value) in self.free.iter().zip(values) {
            if let Target::InRecord { record, effect, place } = free.target {
                while state.in_record.len() <= record {
                    state.in_record.push(state.effects.clone());
                }
                set(&mut state.in_record[record][effect], place, value);
            }
        }
        state
    }

    /// State of the machine in recordings that were not fitted: what differs between recordings is
    /// not
    /// known there and left out.
    pub(crate) fn state_elsewhere(&self, machine: &Machine, values: &[f64]) -> State {
        let mut rough: Vec<f64> = machine.rough().iter().map(|rough| rough.value).collect();
        let mut faults = [0.0; FAULT_COUNT];
        let mut effects = self.effects.clone();
        for (free, &value) in self.free.iter().zip(values) {
            match free.target {
                Target::Rough(place) => rough[place] = value,
                Target::Fault(place) => faults[place] = value,
                Target::Effect(effect, place) => set(&mut effects[effect], place, value),
                Target::InRecord { .. } => {}
            }
        }
        State { rough, faults: FaultCoordinates(faults), effects, in_record: Vec::new() }
    }

    /// The effects that differ between recordings, each with its typical size.
    pub(crate) fn by_record(&self, values: &[f64]) -> Vec<(usize, f64)> {
        let mut found: Vec<(usize, f64, usize)> = Vec::new();
        for (free, value) in self.free.iter().zip(values) {
            let Target::InRecord { effect, .. } = free.target else { continue };
            match found.iter_mut().find(|(known, ..)| *known == effect) {
                Some((_, squares, count)) => {
                    *squares += value * value;
                    *count += 1;
                }
                None => found.push((effect, value * value, 1)),
            }
        }
        let typical = |(effect, squares, count): (usize, f64, usize)| {
            (effect, libm::sqrt(2.0 * squares / count as f64))
        };
        found.into_iter().map(typical).collect()
    }

    /// Effects with found values; of what differs between recordings those of the first.
    pub(crate) fn effects_at(&self, machine: &Machine, values: &[f64]) -> Vec<Effect> {
        let mut state = self.state(machine, values);
        if state.in_record.is_empty() { state.effects } else { state.in_record.swap_remove(0) }
    }

    /// Places of the free numbers that are sizes of an effect, the same in all recordings.
    pub(crate) fn sizes_of_effect(&self, effect: usize) -> Vec<usize> {
        let parameters = self.effects[effect].id().info().parameters;
        let is_size = |place: &usize| match self.free[*place].target {
            Target::Effect(_, number) => parameters[number].role() == Role::Amplitude,
            _ => false,
        };
        self.places_of_effect(effect).into_iter().filter(is_size).collect()
    }

    /// Places of the free numbers of an effect.
    pub(crate) fn places_of_effect(&self, effect: usize) -> Vec<usize> {
        let of = |free: &Free| match free.target {
            Target::Effect(of, _) | Target::InRecord { effect: of, .. } => of == effect,
            _ => false,
        };
        (0..self.free.len()).filter(|&place| of(&self.free[place])).collect()
    }
}

/// Sets a number of an effect, within its bounds.
pub(crate) fn set(effect: &mut Effect, place: usize, value: f64) {
    let parameter = &effect.id().info().parameters[place];
    let (least, most) = parameter.bounds();
    let key = parameter.key(effect.geometry());
    // within the bounds no key of the effect's own is refused
    let _ = effect.set(key, value.clamp(least, most));
}

/// A number of an effect that is free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Number {
    pub(crate) place: usize,
    /// The recording and the value to start from, where each recording has its own.
    pub(crate) in_record: Option<(usize, f64)>,
    pub(crate) step: f64,
    pub(crate) least: f64,
    pub(crate) most: f64,
}
