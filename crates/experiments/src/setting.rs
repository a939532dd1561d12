//! Electronics and sensors of an experiment's recordings, and the bundle that is learnt for them.

use fdi_core::{
    Bundle, Condition, Dataset, DatasetRequest, EnvelopeSignal, Experiment, ReferenceDesign,
    RootSeed,
    ema_sim::{Converter, Imperfections, PhaseSensors, PhysicalFaults, Scenario, SimulationError},
    in_parallel, resampled,
};

use crate::request::EvaluationError;

/// Sensors of the phase currents with the seed of their noise in one recording.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SeededSensors {
    sensors: PhaseSensors,
    seed: u64,
}

/// Electronics, sensors and what is known beforehand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvaluationSetting {
    /// Noise inside the controller and digitisation inside the loop, of recordings and reference
    /// signals alike (with seeds of their own).
    pub imperfections: Imperfections,
    /// Independent white noise on each phase sample, rms, A; a 12-bit converter over ±20 A
    /// follows it. Zero: neither noise nor converter.
    pub sensor_noise_a: f64,
    /// Rate of the phase samples.
    pub phase_rate_hz: f64,
    /// Reference signals of the design `incipient`.
    pub snapshots: usize,
    /// Reference signals of the design `sparse`: faults mostly absent.
    pub sparse_snapshots: usize,
}

impl EvaluationSetting {
    /// Noise of a phase sample, quantisation included, A.
    pub fn noise_a(&self) -> f64 {
        self.sensors().map_or(0.0, |sensors| sensors.variance_a2().sqrt())
    }

    pub(crate) fn sensors(&self) -> Option<PhaseSensors> {
        (self.sensor_noise_a > 0.0).then_some(PhaseSensors {
            noise_a: self.sensor_noise_a,
            converter: Some(Converter::DEFAULT),
        })
    }

    /// The sensors with the noise of one recording; `None` where there is neither noise nor
    /// converter.
    pub(crate) fn seeded_sensors(&self, seed: u64) -> Option<SeededSensors> {
        self.sensors().map(|sensors| SeededSensors { sensors, seed })
    }

    /// The signal of a condition as the sensors show it.
    pub(crate) fn signal(
        &self,
        experiment: &Experiment,
        condition: &Condition,
        sensors: Option<SeededSensors>,
    ) -> Result<Vec<f64>, SimulationError> {
        let envelope_a = self.delayed_envelope(experiment, condition, sensors, 0.0)?;
        Ok(experiment.filtered_envelope(&envelope_a, self.phase_rate_hz))
    }

    /// Envelope of a condition before the filter, in a recording whose command comes late.
    ///
    /// The delay is rounded to the nearest phase sample; until the command comes all stands as at
    /// its start.
    pub(crate) fn delayed_envelope(
        &self,
        experiment: &Experiment,
        condition: &Condition,
        sensors: Option<SeededSensors>,
        delay_s: f64,
    ) -> Result<Vec<f64>, SimulationError> {
        let duration_s = experiment.scenario.duration_s + (-delay_s).max(0.0);
        let scenario = Scenario { duration_s, ..experiment.scenario.clone() };
        let experiment = &Experiment { scenario, ..experiment.clone() };
        let model = experiment
            .high_fidelity(condition.start_angle_rad, self.imperfections)?
            .with_seed(condition.noise_seed);
        let mut trace = model.simulate(&PhysicalFaults::from(&condition.coordinates()));
        let (from_hz, to_hz) = (trace.rate_hz, self.phase_rate_hz);
        for channel in &mut trace.phase_currents_a {
            *channel = resampled(channel, from_hz, to_hz);
        }
        trace.motor_angle_rad = resampled(&trace.motor_angle_rad, from_hz, to_hz);
        trace.rate_hz = to_hz;
        let late = (delay_s * to_hz).round() as i64;
        for channel in trace.phase_currents_a.iter_mut().chain([&mut trace.motor_angle_rad]) {
            *channel = later(channel, late);
        }
        if let Some(SeededSensors { sensors, seed }) = sensors {
            let [a, b, c] = &trace.phase_currents_a;
            trace.phase_currents_a = sensors.measure([a, b, c], seed);
        }
        let pole_pairs = experiment.actuator.motor.pole_pairs;
        Ok(trace.envelope_a(experiment.envelope, pole_pairs))
    }

    /// The experiment with the monitor sampled as the phases are.
    pub(crate) fn experiment(&self, experiment: &Experiment) -> Experiment {
        Experiment { phase_rate_hz: Some(self.phase_rate_hz), ..experiment.clone() }
    }

    /// A signal with the noise and the rate of this setting, as a diagnosis takes it.
    pub(crate) fn observed(&self, signal_a: Vec<f64>) -> EnvelopeSignal {
        EnvelopeSignal::new(signal_a, self.phase_rate_hz, self.noise_a())
    }

    /// The bundle learnt in this setting: reference signals at the rate of the phases, without
    /// noise of the sensors.
    pub(crate) fn bundle(
        &self,
        experiment: &Experiment,
        seed: u64,
        jobs: usize,
    ) -> Result<Bundle, EvaluationError> {
        let experiment = &self.experiment(experiment);
        let mut datasets = Vec::new();
        for (design, conditions) in [
            (ReferenceDesign::Incipient, self.snapshots),
            (ReferenceDesign::Sparse, self.sparse_snapshots),
        ] {
            if conditions == 0 && design == ReferenceDesign::Sparse {
                continue;
            }
            let imperfections = self.imperfections;
            let request = DatasetRequest { design, conditions, seed, imperfections, jobs };
            let conditions = Dataset::conditions(experiment, &request)?;
            let signals_a = in_parallel(&conditions, jobs, |_, condition| {
                self.signal(experiment, condition, None)
            })?;
            datasets.push(Dataset { design, seed, imperfections, conditions, signals_a });
        }
        Ok(Bundle::build(experiment, datasets, self.noise_a(), RootSeed(seed))?)
    }
}

/// A channel later by some samples; the first is held, what comes after the end is not there.
fn later(channel: &[f64], samples: i64) -> Vec<f64> {
    let count = channel.len() as i64 - (-samples).max(0);
    (0..count).map(|n| channel[(n - samples).max(0) as usize]).collect()
}
