//! The carrier's ripple in a recording that is sampled out of step with the drive.
//!
//! ```text
//! b = F(e(t_n)) − F(ē(n/f)),   t_n = n/f − τ
//! ```
//!
//! with `e` the envelope of the machine's currents at the instants of the recording, `ē` the
//! one that is straight between the controller's ticks, `F` the filter, `f` the rate of the phases
//! and `τ` the time by which the command begins after the first sample. The ticks, and the middles
//! between them of a carrier twice as fast, stand where the ripple crosses its mean: samples in step
//! with them have none of it. Others see the same part of each period, which no filter takes off.
//!
//! The ripple goes with the voltage of the supply, the inductance and the duty. It is first taken to be
//! that of the machine as new, then that of the damage found.

use ema_sim::{FaultCoordinates, HighFidelity, Imperfections, PhysicalFaults, SimulationError};

use crate::simulation::{envelope::filtered, experiment::Experiment, resampling::resampled};

/// Share of half a carrier period by which samples may be out of step.
const IN_STEP: f64 = 1e-3;

/// The ripple that samples out of step were found to show, and that was taken off them.
#[derive(Clone, Debug)]
pub(crate) struct TakenRipple {
    pub(crate) instants: SamplingInstants,
    pub(crate) ripple_a: Vec<f64>,
}

/// Sampling of the phases against the ticks of the controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SamplingInstants {
    /// Rate, Hz.
    pub(crate) rate_hz: f64,
    /// Time by which the first tick comes after the first sample, s.
    pub(crate) late_s: f64,
}

impl SamplingInstants {
    /// True where every sample stands at a tick or a whole number of half carrier periods off one.
    pub(crate) fn are_in_step(&self, carrier_hz: f64) -> bool {
        let is_whole = |halves: f64| (halves - halves.round()).abs() < IN_STEP;
        is_whole(2.0 * carrier_hz / self.rate_hz) && is_whole(2.0 * carrier_hz * self.late_s)
    }

    /// The ripple of a machine with some damage in the filtered envelope of these samples, which
    /// `advanced` brings to the ticks, A.
    pub(crate) fn ripple_a(
        &self,
        experiment: &Experiment,
        start_angle_rad: f64,
        damage: &FaultCoordinates,
        advanced: impl Fn(&[f64]) -> Vec<f64>,
    ) -> Result<Vec<f64>, SimulationError> {
        let model = experiment.high_fidelity(start_angle_rad, Imperfections::NONE)?;
        let instants_s = self.instants_s(&model);
        let (trace, logged) = model.simulate_logged(&PhysicalFaults::from(damage), &instants_s)?;
        let of_phases = |phases_a: &[Vec<f64>; 3], angle_rad: &[f64]| {
            let [a, b, c] = phases_a;
            let pole_pairs = experiment.actuator.motor.pole_pairs;
            experiment.envelope.of_phases_at([a, b, c], angle_rad, pole_pairs)
        };
        let seen_a = of_phases(&logged.phase_currents_a, &logged.motor_angle_rad);
        let straight = |channel: &[f64]| resampled(channel, model.tick_hz(), self.rate_hz);
        let straight_a = of_phases(
            &trace.phase_currents_a.each_ref().map(|phase| straight(phase)),
            &straight(&trace.motor_angle_rad),
        );
        let expected_a = filtered(&straight_a, self.rate_hz, experiment);
        let mut ripple_a = filtered(&advanced(&seen_a), self.rate_hz, experiment);
        for (value, expected) in ripple_a.iter_mut().zip(expected_a) {
            *value -= expected;
        }
        Ok(ripple_a)
    }

    /// Instants of the samples within a test, s.
    fn instants_s(&self, model: &HighFidelity) -> Vec<f64> {
        let last_s = (model.samples() - 1) as f64 / model.tick_hz();
        let count = ((last_s + self.late_s.max(0.0)) * self.rate_hz).floor() as usize + 1;
        (0..count).map(|n| (n as f64 / self.rate_hz - self.late_s).clamp(0.0, last_s)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_and_middles_of_carrier_periods_are_in_step() {
        let is_in_step =
            |rate_hz: f64, late_s: f64| SamplingInstants { rate_hz, late_s }.are_in_step(20e3);
        for rate_hz in [10e3, 5e3, 20e3, 40e3, 4e3] {
            assert!(is_in_step(rate_hz, 0.0) && is_in_step(rate_hz, 2.5e-5), "{rate_hz}");
            assert!(!is_in_step(rate_hz, 1e-5), "{rate_hz}");
        }
        assert!(!is_in_step(7e3, 0.0) && !is_in_step(100e3, 0.0));
    }
}
