//! The low-fidelity model with its learnt error beside a recording.

use ema_sim::{Effect, SimulationError};

use crate::{
    offline::error_model::combination,
    simulation::experiment::Experiment,
    unit::{
        error::UnitError, evidence::TemperatureReading, monitor::UnitMonitor,
        quantities::Quantities, search::Observed, sensors::SensorShares,
    },
};

/// A recording with the model that is to explain it.
#[derive(Clone, Debug)]
pub(crate) struct Modelled<'a> {
    pub(crate) quantities: &'a Quantities,
    pub(crate) error: &'a UnitError,
    pub(crate) observed: &'a Observed<'a>,
    monitor: UnitMonitor<'a>,
    /// Shares of the sensors at the last point.
    shares: Option<SensorShares>,
    /// Simulations of the low-fidelity model so far.
    pub(crate) evaluations: u64,
}

impl<'a> Modelled<'a> {
    pub(crate) fn new(
        experiment: &'a Experiment,
        quantities: &'a Quantities,
        error: &'a UnitError,
        observed: &'a Observed<'a>,
    ) -> Self {
        let monitor = UnitMonitor::new(experiment, quantities, observed.start_angle_rad);
        Self { quantities, error, observed, monitor, shares: None, evaluations: 0 }
    }

    /// The machine with effects beside those of its model file.
    pub(crate) fn set_effects(&mut self, effects: &[Effect]) {
        self.monitor.set_effects(effects);
    }

    /// `y − y_LF(q) − m(q)` less what the sensors add, A.
    pub(crate) fn residual_a(&mut self, point: &[f64]) -> Result<Vec<f64>, SimulationError> {
        let at = self.quantities.at(point);
        self.evaluations += 1;
        let (mut signal, shares) = if let Some(measured) = self.observed.shares {
            let mut signal = self.monitor.signal(&at)?;
            self.error.add_mean(&at, &mut signal);
            let shares = measured.with_expected_sum(&signal);
            (signal, shares)
        } else {
            let (mut signal, shares) = self.monitor.sensed(&at)?;
            self.error.add_mean(&at, &mut signal);
            (signal, shares)
        };
        shares.add(self.quantities.layout(), point, &mut signal);
        self.shares = Some(shares);
        for (value, measured) in signal.iter_mut().zip(self.observed.signal_a) {
            *value = measured - *value;
        }
        Ok(signal)
    }

    /// Slopes in all that the signal shows, the errors of the sensors last and as they are at the
    /// last residual: one row each.
    ///
    /// The learnt error's own slopes stay out: a trend learnt on a few hundred units has noise, which
    /// a search takes for knowledge of what the signal does not show.
    pub(crate) fn shown_slopes(&mut self, point: &[f64]) -> Result<Vec<Vec<f64>>, SimulationError> {
        let at = self.quantities.at(point);
        let kept = self.observed.nominal_slopes.and_then(|kept| kept.at(&at));
        let mut slopes = if let Some(kept) = kept {
            kept.to_vec()
        } else {
            self.evaluations += 2 * at.len() as u64;
            self.monitor.slopes(&at, 0..at.len(), &self.error.spread)?
        };
        let shares = self.shares.as_ref();
        let numbers = self.quantities.layout().numbers.iter();
        let of_sensors = numbers.filter_map(|number| shares?.of(number.acts));
        slopes.extend(of_sensors.map(<[f64]>::to_vec));
        Ok(slopes)
    }

    /// Slopes in the unknowns, by slopes in all that the signal shows.
    pub(crate) fn unknown_slopes(&self, point: &[f64], shown: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let samples = self.observed.signal_a.len();
        let by_unknown = self.quantities.shown_slopes(point);
        by_unknown.iter().map(|by| combination(by, shown, samples)).collect()
    }

    /// The model's signal at a point with effects beside those of the model file in the place of
    /// those that it has, without learnt error and sensors, A.
    pub(crate) fn signal_with(
        &mut self,
        point: &[f64],
        effects: &[Effect],
    ) -> Result<Vec<f64>, SimulationError> {
        self.evaluations += 1;
        let mut monitor = self.monitor.clone();
        monitor.set_effects(effects);
        monitor.signal(&self.quantities.at(point))
    }

    /// Place of the winding's temperature among the unknowns, and its reading.
    pub(crate) fn temperature(&self) -> Option<(usize, TemperatureReading)> {
        self.quantities.layout().temperature().zip(self.observed.temperature)
    }
}
