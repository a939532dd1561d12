//! What of a model is free in a fit: rough numbers, damage, numbers of effects.

use ema_sim::{Effect, FAULT_COUNT, FaultCoordinates};

use crate::machine::{Machine, State};

/// What a free number sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// A number that the data sheet knows only roughly, by its place among them.
    Rough(usize),
    /// A coordinate of damage.
    Fault(usize),
    /// A number of an effect, by the effect's place in the structure and its own there.
    Effect(usize, usize),
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
    /// What is known of it beforehand: mean and standard deviation.
    pub(crate) prior: Option<(f64, f64)>,
}

/// A hypothesis on what the machine does: effects, and what is free.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Structure {
    pub(crate) effects: Vec<Effect>,
    pub(crate) free: Vec<Free>,
}

/// Difference of a fault level with which derivatives are taken.
const FAULT_STEP: f64 = 0.01;

impl Structure {
    /// The nominal machine with its rough numbers and its damage free.
    pub(crate) fn nominal(machine: &Machine) -> Self {
        let rough = machine.rough().into_iter().enumerate().map(|(place, rough)| Free {
            target: Target::Rough(place),
            key: rough.key,
            start: rough.value,
            least: rough.value - rough.half_width,
            most: rough.value + rough.half_width,
            step: 0.1 * rough.half_width,
            // of the uniform distribution over the tolerance
            prior: Some((rough.value, rough.half_width / libm::sqrt(3.0))),
        });
        let faults = machine.fault_coordinates().into_iter().map(|place| Free {
            target: Target::Fault(place),
            key: FaultCoordinates::NAMES[place].to_owned(),
            start: 0.0,
            least: if place < 5 { 0.0 } else { -1.0 },
            most: 1.0,
            step: FAULT_STEP,
            prior: None,
        });
        let free = rough.chain(faults).filter(|free| free.most > free.least).collect();
        Self { effects: Vec::new(), free }
    }

    /// The same with one more effect, some of whose numbers are free.
    pub(crate) fn with_effect(&self, effect: Effect, numbers: &[Number]) -> Self {
        let mut structure = self.clone();
        let place = structure.effects.len();
        let info = effect.id().info();
        for number in numbers {
            let parameter = &info.parameters[number.place];
            let (least, most) = parameter.bounds();
            let start = effect.values()[number.place];
            structure.free.push(Free {
                target: Target::Effect(place, number.place),
                key: parameter.key(effect.geometry()).to_owned(),
                start,
                least: least.max(number.least),
                most: most.min(number.most),
                step: number.step,
                prior: None,
            });
        }
        structure.effects.push(effect);
        structure
    }

    /// Starts a fit from found values.
    pub(crate) fn started_at(mut self, values: &[f64]) -> Self {
        for (free, value) in self.free.iter_mut().zip(values) {
            free.start = *value;
        }
        self
    }

    /// The state of the machine at values of the free numbers.
    pub(crate) fn state(&self, machine: &Machine, values: &[f64]) -> State {
        let mut rough: Vec<f64> = machine.rough().iter().map(|rough| rough.value).collect();
        let mut faults = [0.0; FAULT_COUNT];
        let mut effects = self.effects.clone();
        for (free, &value) in self.free.iter().zip(values) {
            match free.target {
                Target::Rough(place) => rough[place] = value,
                Target::Fault(place) => faults[place] = value,
                Target::Effect(effect, place) => {
                    let effect = &mut effects[effect];
                    let parameter = &effect.id().info().parameters[place];
                    let (least, most) = parameter.bounds();
                    let key = parameter.key(effect.geometry());
                    // within the bounds no key of the effect's own is refused
                    let _ = effect.set(key, value.clamp(least, most));
                }
            }
        }
        State { rough, faults: FaultCoordinates(faults), effects }
    }

    /// Effects with found values.
    pub(crate) fn effects_at(&self, machine: &Machine, values: &[f64]) -> Vec<Effect> {
        self.state(machine, values).effects
    }

    /// Places of the free numbers of an effect.
    pub(crate) fn places_of_effect(&self, effect: usize) -> Vec<usize> {
        let of = |free: &Free| matches!(free.target, Target::Effect(e, _) if e == effect);
        (0..self.free.len()).filter(|&place| of(&self.free[place])).collect()
    }
}

/// A number of an effect that is free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Number {
    pub(crate) place: usize,
    pub(crate) step: f64,
    pub(crate) least: f64,
    pub(crate) most: f64,
}
