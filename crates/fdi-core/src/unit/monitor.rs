//! The low-fidelity model as a function of the quantities that a current shows.

use ema_sim::{Effect, EffectId, LowFidelity, LowFidelityTrace, SimulationError};

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
pub(crate) const STEP_OF_SPREAD: f64 = 0.07;

/// The low-fidelity model of a unit in a test, from a start angle.
#[derive(Clone, Debug)]
pub(crate) struct UnitMonitor<'a> {
    experiment: &'a Experiment,
    quantities: &'a Quantities,
    start_angle_rad: f64,
    /// Effects of the machine, those of the model file first.
    effects: Vec<Effect>,
}

impl<'a> UnitMonitor<'a> {
    pub(crate) fn new(
        experiment: &'a Experiment,
        quantities: &'a Quantities,
        start_angle_rad: f64,
    ) -> Self {
        let effects = experiment.effects.clone();
        Self { experiment, quantities, start_angle_rad, effects }
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
        let slope = |place: usize| {
            let step = STEP_OF_SPREAD * spread[place];
            let side = |by: f64| {
                let mut moved = at.to_vec();
                moved[place] += by;
                self.signal(&moved)
            };
            let (above, below) = (side(step)?, side(-step)?);
            Ok(above.iter().zip(below).map(|(a, b)| (a - b) / (2.0 * step)).collect())
        };
        places.into_iter().map(slope).collect()
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
        let slope = |(effect, size): &(Effect, f64)| {
            let effects: Vec<Effect> = self.effects.iter().chain([effect]).cloned().collect();
            let with = model.clone().with_effects(&effects).ok()?;
            let mut current_a = Vec::new();
            with.simulate_current(&machine.faults, &mut current_a);
            let with = self.filtered(&current_a);
            Some(with.iter().zip(&without).map(|(a, b)| (a - b) / size).collect::<Vec<f64>>())
        };
        let slopes = small_effects(&model.scales(&trace), effects).into_iter();
        let slopes = slopes.filter_map(|(effect, amplitudes)| {
            let rows = amplitudes.iter().map(slope).collect::<Option<Vec<_>>>()?;
            Some(EffectSlopes { effect, rows })
        });
        Ok(slopes.collect())
    }

    /// A run of the model with its machine.
    pub(crate) fn run(
        &self,
        at: &[f64],
    ) -> Result<(LowFidelityTrace, UnitMachine), SimulationError> {
        let (model, machine) = self.model(at)?;
        Ok((model.simulate(&machine.faults), machine))
    }

    fn model(&self, at: &[f64]) -> Result<(LowFidelity, UnitMachine), SimulationError> {
        let machine = self.quantities.machine(self.experiment, at);
        let scenario = machine.scenario.clone().turned_to(self.start_angle_rad);
        let model = LowFidelity::new(&machine.actuator, &scenario)?;
        Ok((model.with_effects(&self.effects)?, machine))
    }

    /// A channel of the model through the filter of the experiment.
    pub(crate) fn filtered(&self, channel: &[f64]) -> Vec<f64> {
        let own_hz = self.experiment.actuator.controller.sample_hz;
        match self.experiment.phase_rate_hz {
            Some(rate_hz) if rate_hz < own_hz => {
                let sampled = resampled(channel, own_hz, rate_hz);
                self.experiment.filter.apply(&sampled, rate_hz)
            }
            _ => self.experiment.filter.apply(channel, own_hz),
        }
    }
}
