//! Recordings under another load than the test of their bundle.
//!
//! ```text
//! b = s(k; L) − s(k; L₀)
//! ```
//!
//! with `s` the signal of the low-fidelity model of a machine `k`, `L` the load that the recording states
//! and `L₀` that of the test. The difference is first taken to be that of the nominal machine as new, then
//! that of the machine found: an eccentricity, as built or not, ripples the more the greater the load. The
//! learnt error stays that of the test.

use ema_sim::{FaultCoordinates, SimulationError};
use recordings::{ChannelName, Recording};

use crate::{
    online::observation_error::ObservationError,
    report::{Notice, NoticeCode},
    simulation::experiment::Experiment,
    unit::{monitor::UnitMonitor, quantities::Quantities},
};

/// Largest difference of the current, over its limit, that is not told.
const NOT_TOLD: f64 = 1e-4;

/// The load of a recording, with what its difference from that of the test was found to do to the signal.
#[derive(Clone, Debug)]
pub(crate) struct OtherLoad {
    load_n_m: f64,
    pub(crate) difference_a: Vec<f64>,
}

impl OtherLoad {
    /// The load that a recording states, where it is not that of the test.
    pub(crate) fn of(recording: &Recording, experiment: &Experiment) -> Option<Self> {
        let load_n_m = stated_load_n_m(recording, experiment.scenario.duration_s)?;
        let is_other = load_n_m != experiment.scenario.load_n_m;
        is_other.then(|| Self { load_n_m, difference_a: vec![0.0; experiment.samples()] })
    }

    /// The test under the load that is stated.
    pub(crate) fn test(&self, experiment: &Experiment) -> Experiment {
        let mut loaded = experiment.clone();
        loaded.scenario.load_n_m = self.load_n_m;
        loaded
    }

    /// Change of the signal of a machine with some damage by the difference of the loads, A.
    pub(crate) fn shown(
        &self,
        experiment: &Experiment,
        start_angle_rad: f64,
        damage: &FaultCoordinates,
    ) -> Result<Vec<f64>, SimulationError> {
        self.difference_a(experiment, |test| Ok(test.monitor(start_angle_rad)?.signal(damage)))
    }

    /// Change of the signal of a machine within its tolerances, by the unknowns found of it, A.
    pub(crate) fn shown_by_unit(
        &self,
        experiment: &Experiment,
        start_angle_rad: f64,
        point: &[f64],
    ) -> Result<Vec<f64>, SimulationError> {
        self.difference_a(experiment, |test| {
            let quantities = Quantities::new(test);
            UnitMonitor::new(test, &quantities, start_angle_rad).signal(&quantities.at(point))
        })
    }

    /// A signal in the test under the load that is stated, less that in the test itself.
    fn difference_a(
        &self,
        experiment: &Experiment,
        signal_a: impl Fn(&Experiment) -> Result<Vec<f64>, SimulationError>,
    ) -> Result<Vec<f64>, SimulationError> {
        let mut difference_a = signal_a(&self.test(experiment))?;
        for (value, expected) in difference_a.iter_mut().zip(signal_a(experiment)?) {
            *value -= expected;
        }
        Ok(difference_a)
    }

    /// Refuses a load under which the machine as new does not hold the test.
    pub(crate) fn check(&self) -> Result<(), ObservationError> {
        if self.difference_a.iter().all(|value| value.is_finite()) {
            Ok(())
        } else {
            Err(ObservationError::LoadTooLarge { load_n_m: self.load_n_m })
        }
    }

    /// The notice of a load that the signal shows.
    pub(crate) fn notice(&self, experiment: &Experiment) -> Option<Notice> {
        let limit_a = experiment.actuator.controller.current_limit_a;
        let is_told = self.difference_a.iter().any(|value| value.abs() > NOT_TOLD * limit_a);
        is_told.then(|| Notice {
            code: NoticeCode::LoadDiffers,
            message: format!(
                "the recording is under a load of {:.3} N·m, the test of the bundle under {} N·m; what \
                 the model says of the difference is taken off the signal, and a bundle of the test \
                 under this load would know it better",
                self.load_n_m, experiment.scenario.load_n_m
            ),
        })
    }
}

/// The load that a recording states: the mean of its `load_n_m` over the test, else that of its metadata.
fn stated_load_n_m(recording: &Recording, duration_s: f64) -> Option<f64> {
    let Some(channel) = recording.channel(ChannelName::Load) else {
        return recording.metadata.load_n_m;
    };
    let first_s = channel.times_s().first()?;
    let within = channel.times_s().iter().take_while(|&time_s| time_s - first_s <= duration_s);
    let values = &channel.values()[..within.count()];
    Some(values.iter().sum::<f64>() / values.len() as f64)
}
