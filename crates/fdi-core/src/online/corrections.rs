//! Parts of a signal that are of how it was recorded: the carrier's ripple, another load.
//!
//! Both depend on the machine, and are taken off as those of the nominal one as new first, then as those
//! of the one found.

use ema_sim::{FAULT_COUNT, FaultCoordinates, SimulationError};
use recordings::Channel;

use crate::{
    online::{
        observation::Observation,
        other_load::OtherLoad,
        posterior::Posterior,
        ripple::{SamplingInstants, TakenRipple},
    },
    simulation::{experiment::Experiment, shifting::advanced},
};

impl Observation {
    /// Tells whether the phases were sampled out of step with the controller, from a start on that is
    /// known, so that they show ripple.
    pub(super) fn out_of_step(
        &self,
        phase: &Channel,
        late_s: f64,
        experiment: &Experiment,
    ) -> Option<SamplingInstants> {
        let off_clock = phase.taken_s().map(|_| phase.clone());
        let instants = SamplingInstants { rate_hz: self.phase_rate_hz, late_s, off_clock };
        let carrier_hz = experiment.actuator.inverter.carrier_hz;
        let is_out = !instants.are_in_step(carrier_hz, experiment.scenario.duration_s);
        (is_out && self.start_std_s() == 0.0).then_some(instants)
    }

    /// Takes the ripple of a machine as new off the signal, where the currents show it or samples on a
    /// clock must have it.
    pub(super) fn take_ripple_if_shown(
        &mut self,
        instants: SamplingInstants,
        may_be_none: bool,
        experiment: &Experiment,
    ) -> Result<(), SimulationError> {
        let Some(angle_rad) = self.start_angle_rad else { return Ok(()) };
        let as_new = FaultCoordinates([0.0; FAULT_COUNT]);
        let shown = instants.shown(experiment, angle_rad, &as_new)?;
        let resampling_error_a = self.resampling_error_a;
        if let Some(envelope) = &self.envelope {
            let from_start = advanced(&envelope.samples_a, instants.late_s * envelope.rate_hz);
            if instants.off_clock.is_some() && !shown.is_in(&from_start) {
                return Ok(());
            }
            let left_a = self.left_of_ripple_a(shown.noise_beside_a(&from_start), experiment);
            self.resampling_error_a = resampling_error_a.hypot(left_a);
        }
        let ripple_a = vec![0.0; self.signal_a.len()];
        let without = may_be_none.then_some(resampling_error_a);
        self.ripple = Some(TakenRipple { instants, ripple_a, without });
        self.take_ripple(shown.ripple_a(experiment));
        Ok(())
    }

    /// Noise on each phase sample that an envelope less its ripple has beyond that of the sensors and of
    /// the drive's current feedback, A: what the prediction of the ripple misses.
    fn left_of_ripple_a(&self, noise_of_envelope_a: f64, experiment: &Experiment) -> f64 {
        let Some(sensors_a) = self.noise_beside_gains_a().or(self.measured_noise_a) else {
            return 0.0;
        };
        let feedback_a2 = experiment.actuator.sensing.current_noise_half_width_a.powi(2) / 3.0;
        let of_phase = experiment.envelope.noise_variance();
        let left_a2 = (noise_of_envelope_a.powi(2) - feedback_a2) / of_phase - sensors_a.powi(2);
        left_a2.max(0.0).sqrt()
    }

    /// Takes the ripple of a machine with some damage off the signal, in place of what was taken off
    /// before.
    fn take_ripple_of(
        &mut self,
        damage: &FaultCoordinates,
        experiment: &Experiment,
    ) -> Result<(), SimulationError> {
        let (Some(taken), Some(angle_rad)) = (&self.ripple, self.start_angle_rad) else {
            return Ok(());
        };
        let shown = taken.instants.shown(experiment, angle_rad, damage)?;
        self.take_ripple(shown.ripple_a(experiment));
        Ok(())
    }

    /// The observation with its ripple as it was recorded, where it may be that of samples in step.
    pub(crate) fn as_in_step(&self) -> Option<Self> {
        let resampling_error_a = self.ripple.as_ref()?.without?;
        let mut in_step = Self { resampling_error_a, ..self.clone() };
        in_step.take_ripple(vec![0.0; self.signal_a.len()]);
        in_step.ripple = None;
        Some(in_step)
    }

    /// Takes ripple off the signal, in place of what was taken off before.
    fn take_ripple(&mut self, ripple_a: Vec<f64>) {
        let Some(taken) = &mut self.ripple else { return };
        take_off(&mut self.signal_a, &mut taken.ripple_a, ripple_a);
    }

    /// Takes off what the difference of the load does to the signal of the nominal machine as new.
    pub(super) fn take_load(&mut self, experiment: &Experiment) -> Result<(), SimulationError> {
        let as_new = FaultCoordinates([0.0; FAULT_COUNT]);
        self.take_load_by(|load, start_rad| load.shown(experiment, start_rad, &as_new))
    }

    /// Takes off what the difference of the load is said to do to the signal of a machine from a start of
    /// the rotor, in place of what was taken off before.
    fn take_load_by(
        &mut self,
        shown_a: impl FnOnce(&OtherLoad, f64) -> Result<Vec<f64>, SimulationError>,
    ) -> Result<(), SimulationError> {
        let Some(load) = &mut self.other_load else { return Ok(()) };
        let shown_a = shown_a(load, self.start_angle_rad.unwrap_or_default())?;
        take_off(&mut self.signal_a, &mut load.difference_a, shown_a);
        Ok(())
    }

    /// True where some damage changes what is to be taken off the signal.
    pub(crate) fn depends_on_damage(&self) -> bool {
        self.ripple.is_some() || self.other_load.is_some()
    }

    /// Takes off the signal what ripple and load do to the machine that was found, in place of what was
    /// taken off before.
    pub(crate) fn correct_for(
        &mut self,
        found: &Posterior,
        experiment: &Experiment,
    ) -> Result<(), SimulationError> {
        let damage = found.damage();
        self.take_ripple_of(&damage, experiment)?;
        self.take_load_by(|load, start_rad| match &found.explained {
            Some(unit) => load.shown_by_unit(experiment, start_rad, &unit.point),
            None => load.shown(experiment, start_rad, &damage),
        })
    }
}

/// Takes a part off a signal in place of what was taken off before.
fn take_off(signal_a: &mut [f64], taken_a: &mut Vec<f64>, part_a: Vec<f64>) {
    let before_a = core::mem::replace(taken_a, part_a);
    for ((value, part_a), before_a) in signal_a.iter_mut().zip(taken_a).zip(before_a) {
        *value += before_a - *part_a;
    }
}
