//! The low-fidelity model as a function of the quantities that a current shows.

use std::sync::OnceLock;

use ema_sim::{Effect, EffectId, LowFidelity, MotorMotion, PhysicalFaults, SimulationError};

use crate::{
    simulation::{experiment::Experiment, resampling::resampled},
    unit::{
        quantities::{Quantities, UnitMachine},
        sensors::{SensorShares, simulated_shares},
        unmodelled::{EffectSlopes, small_effects},
    },
};

/// Difference of a quantity for its slope over its spread in the design: large against the kinks
/// of the controller's ticks, small against what bends.
const STEP_OF_SPREAD: f64 = 0.07;

/// Slopes of the diagnosed signal of the machine of the model file, from which every search begins:
/// recordings of one test have them in common.
#[derive(Clone, Debug)]
pub(crate) struct NominalSlopes {
    at: Vec<f64>,
    /// One row a quantity, A over its unit.
    rows: Vec<Vec<f64>>,
}

impl NominalSlopes {
    /// The slopes, where they are those at some quantities.
    pub(crate) fn at(&self, quantities: &[f64]) -> Option<&[Vec<f64>]> {
        (self.at == quantities).then_some(&self.rows)
    }
}

/// The low-fidelity model of a unit in a test, from a start angle.
#[derive(Clone, Debug)]
pub(crate) struct UnitMonitor<'a> {
    experiment: &'a Experiment,
    quantities: &'a Quantities,
    start_angle_rad: f64,
    /// Effects of the machine, those of the model file first.
    effects: Vec<Effect>,
    /// The test of the first machine, whose sampled command all have.
    test: OnceLock<LowFidelity>,
}

impl<'a> UnitMonitor<'a> {
    pub(crate) fn new(
        experiment: &'a Experiment,
        quantities: &'a Quantities,
        start_angle_rad: f64,
    ) -> Self {
        let effects = experiment.effects.clone();
        let test = OnceLock::new();
        Self { experiment, quantities, start_angle_rad, effects, test }
    }

    /// The machine with effects beside those of its model file.
    pub(crate) fn set_effects(&mut self, effects: &[Effect]) {
        self.effects = [&self.experiment.effects, effects].concat();
    }

    /// The diagnosed signal, A; not a number where the machine runs away.
    pub(crate) fn signal(&self, at: &[f64]) -> Result<Vec<f64>, SimulationError> {
        let (model, machine) = self.model(at)?;
        let mut current_a = Vec::new();
        model.simulate_current(&machine.faults, &mut current_a);
        Ok(self.filtered(&current_a))
    }

    /// Slopes of the diagnosed signal in some quantities, by their places and the spread of every quantity,
    /// one row each: central differences.
    pub(crate) fn slopes(
        &self,
        at: &[f64],
        places: impl IntoIterator<Item = usize>,
        spread: &[f64],
    ) -> Result<Vec<Vec<f64>>, SimulationError> {
        slopes_of(at, places, spread, |moved| self.signals(moved))
    }

    /// The diagnosed signals of several machines, which run side by side.
    fn signals(&self, at: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, SimulationError> {
        let models = at.iter().map(|at| self.model(at)).collect::<Result<Vec<_>, _>>()?;
        let tests: Vec<_> =
            models.iter().map(|(model, machine)| (model, &machine.faults)).collect();
        Ok(self.filtered_currents(&tests))
    }

    fn filtered_currents(&self, tests: &[(&LowFidelity, &PhysicalFaults)]) -> Vec<Vec<f64>> {
        let mut currents_a = Vec::new();
        LowFidelity::simulate_tests(tests, &mut currents_a);
        self.filtered_each(&currents_a)
    }

    /// The diagnosed signal with what gains and offsets of the phases' sensors add to it.
    pub(crate) fn sensed(&self, at: &[f64]) -> Result<(Vec<f64>, SensorShares), SimulationError> {
        let (model, machine) = self.model(at)?;
        let trace = model.simulate(&machine.faults);
        let shares = simulated_shares(&trace, self.experiment, |channel| self.filtered(channel));
        Ok((self.filtered(&trace.current_a), shares))
    }

    /// Slopes of the diagnosed signal in the amplitudes of each of some effects that the model
    /// takes, A over the unit of each.
    pub(crate) fn effect_slopes(
        &self,
        at: &[f64],
        effects: &[EffectId],
    ) -> Result<Vec<EffectSlopes>, SimulationError> {
        let (model, machine) = self.model(at)?;
        let trace = model.simulate(&machine.faults);
        let without = self.filtered(&trace.current_a);
        let small = small_effects(&model.scales(&trace), effects);
        let with = small.iter().map(|(_, amplitudes)| {
            let with = |(effect, _): &(Effect, f64)| {
                let effects: Vec<Effect> = self.effects.iter().chain([effect]).cloned().collect();
                model.clone().with_effects(&effects).ok()
            };
            amplitudes.iter().map(with).collect::<Option<Vec<LowFidelity>>>()
        });
        let with: Vec<Option<Vec<LowFidelity>>> = with.collect();
        let tests: Vec<_> =
            with.iter().flatten().flatten().map(|model| (model, &machine.faults)).collect();
        let mut signals = self.filtered_currents(&tests).into_iter();
        let taken = small.into_iter().zip(with).filter(|(_, with)| with.is_some());
        let slopes = taken.map(|((effect, amplitudes), _)| {
            let sizes = amplitudes.iter().map(|(_, size)| size);
            let rows = sizes.zip(signals.by_ref()).map(|(size, with)| {
                with.iter().zip(&without).map(|(a, b)| (a - b) / size).collect::<Vec<f64>>()
            });
            EffectSlopes { effect, rows: rows.collect() }
        });
        Ok(slopes.collect())
    }

    /// Slopes of the diagnosed signal of the machine of the model file in every quantity.
    pub(crate) fn nominal_slopes(&self, spread: &[f64]) -> Result<NominalSlopes, SimulationError> {
        let at = self.quantities.nominal();
        let rows = self.slopes(&at, 0..at.len(), spread)?;
        Ok(NominalSlopes { at, rows })
    }

    /// A run of the model with its machine.
    pub(crate) fn run(&self, at: &[f64]) -> Result<(MotorMotion, UnitMachine), SimulationError> {
        Ok(self.runs(&[at.to_vec()])?.swap_remove(0))
    }

    /// Runs of several machines, side by side, with the machines.
    pub(crate) fn runs(
        &self,
        at: &[Vec<f64>],
    ) -> Result<Vec<(MotorMotion, UnitMachine)>, SimulationError> {
        let models = at.iter().map(|at| self.model(at)).collect::<Result<Vec<_>, _>>()?;
        let tests: Vec<_> =
            models.iter().map(|(model, machine)| (model, &machine.faults)).collect();
        let motions = LowFidelity::simulate_motions(&tests);
        Ok(motions.into_iter().zip(models.into_iter().map(|(_, machine)| machine)).collect())
    }

    fn model(&self, at: &[f64]) -> Result<(LowFidelity, UnitMachine), SimulationError> {
        let machine = self.quantities.machine(self.experiment, at);
        let test = if let Some(test) = self.test.get() {
            test
        } else {
            let scenario = machine.scenario.clone().turned_to(self.start_angle_rad);
            let test = LowFidelity::new(&machine.actuator, &scenario)?;
            self.test.get_or_init(|| test)
        };
        let model = test.on_actuator(&machine.actuator)?;
        let model = model.under_constant_load(machine.scenario.load_n_m)?;
        Ok((model.with_effects(&self.effects)?, machine))
    }

    /// A channel of the model through the filter of the experiment.
    pub(crate) fn filtered(&self, channel: &[f64]) -> Vec<f64> {
        self.filtered_each(&[channel]).swap_remove(0)
    }

    /// Channels of the model through the filter of the experiment.
    pub(crate) fn filtered_each<S: AsRef<[f64]>>(&self, channels: &[S]) -> Vec<Vec<f64>> {
        let Experiment { filter, phase_rate_hz, .. } = self.experiment;
        let own_hz = self.experiment.actuator.controller.sample_hz;
        match *phase_rate_hz {
            Some(rate_hz) if rate_hz < own_hz => {
                let sampled = |channel: &S| resampled(channel.as_ref(), own_hz, rate_hz);
                filter.apply_each(&channels.iter().map(sampled).collect::<Vec<_>>(), rate_hz)
            }
            _ => filter.apply_each(channels, own_hz),
        }
    }
}

/// Slopes of a function of the quantities in some of them, by their places and the spread of every
/// quantity, one row each: central differences, of all places at once.
pub(crate) fn slopes_of<E>(
    at: &[f64],
    places: impl IntoIterator<Item = usize>,
    spread: &[f64],
    function: impl FnOnce(&[Vec<f64>]) -> Result<Vec<Vec<f64>>, E>,
) -> Result<Vec<Vec<f64>>, E> {
    let places: Vec<usize> = places.into_iter().collect();
    let step = |place: usize| STEP_OF_SPREAD * spread[place];
    let sides = places.iter().flat_map(|&place| {
        [step(place), -step(place)].map(|by| {
            let mut moved = at.to_vec();
            moved[place] += by;
            moved
        })
    });
    let values = function(&sides.collect::<Vec<_>>())?;
    let slope = |(&place, sides): (&usize, &[Vec<f64>])| {
        let pairs = sides[0].iter().zip(&sides[1]);
        pairs.map(|(above, below)| (above - below) / (2.0 * step(place))).collect()
    };
    Ok(places.iter().zip(values.chunks(2)).map(slope).collect())
}
