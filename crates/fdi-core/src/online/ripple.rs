//! The carrier's ripple in a recording that is sampled out of step with the drive.
//!
//! ```text
//! b = F(e(t_n)) − F(e(m·T)),   t_n = n/f − τ
//! ```
//!
//! with `e` the envelope of the machine's currents at the instants of the recording and at the
//! controller's ticks `m·T`, `F` the filter, `f` the rate of the phases and `τ` the time by which the
//! command begins after the first sample. Beside ripple, samples between ticks see commutations
//! elsewhere than samples at ticks do: at 100 ppm off, an imbalance of 0.002 (k6). The ticks, and the middles
//! between them of a carrier twice as fast, stand where the ripple crosses its mean: samples in step
//! with them have none of it. Others see the same part of each period, which no filter takes off.
//!
//! Samples beside an even clock, which were brought onto it, show ripple of any size and sign: noise
//! in step with their times. Where the stamps scatter and the samples do not, there is none; the
//! currents tell.
//!
//! The ripple goes with the voltage of the supply, the inductance and the duty. It is first taken to be
//! that of the machine as new, then that of the damage found.

use ema_sim::{FaultCoordinates, HighFidelity, Imperfections, PhysicalFaults, SimulationError};
use recordings::Channel;

use crate::simulation::{
    envelope::filtered, experiment::Experiment, resampling::resampled, shifting::advanced,
};

/// Share of half a carrier period by which samples may be out of step with the start of a test.
const IN_STEP: f64 = 1e-3;
/// Share by which they may drift out of step in the course of it: a quarter of a microsecond at 20 kHz.
const STAYS_IN_STEP: f64 = 0.01;
/// Share of its predicted size from which a ripple is taken to be there: half way between none and
/// all of it.
const LEAST_SHARE: f64 = 0.5;
/// Standard deviations of differences beyond which a sample does not tell of ripple.
const MOST_STD: f64 = 4.0;

/// The ripple that samples out of step were found to show, and that was taken off them.
#[derive(Clone, Debug)]
pub(crate) struct TakenRipple {
    pub(crate) instants: SamplingInstants,
    pub(crate) ripple_a: Vec<f64>,
    /// Error of resampling without a ripple, A, where the samples may be those of the drive itself all the
    /// same: of a command that runs off them, another clock may have been the cause.
    pub(crate) without: Option<f64>,
}

/// Sampling of the phases against the ticks of the controller.
#[derive(Clone, Debug)]
pub(crate) struct SamplingInstants {
    /// Rate, Hz.
    pub(crate) rate_hz: f64,
    /// Time by which the first tick comes after the first sample, s.
    pub(crate) late_s: f64,
    /// A phase whose samples stood beside an even clock and were brought onto it, where they did.
    pub(crate) off_clock: Option<Channel>,
}

impl SamplingInstants {
    /// True where every sample stands at a tick or a whole number of half carrier periods off one.
    pub(crate) fn are_in_step(&self, carrier_hz: f64, duration_s: f64) -> bool {
        let off_whole = |halves: f64| (halves - halves.round()).abs();
        let drift = off_whole(2.0 * carrier_hz / self.rate_hz) * self.rate_hz * duration_s;
        self.off_clock.is_none()
            && drift < STAYS_IN_STEP
            && off_whole(2.0 * carrier_hz * self.late_s) < IN_STEP
    }

    /// Envelopes of a machine with some damage as these samples show it.
    pub(crate) fn shown(
        &self,
        experiment: &Experiment,
        start_angle_rad: f64,
        damage: &FaultCoordinates,
    ) -> Result<ShownEnvelope, SimulationError> {
        let model = experiment.high_fidelity(start_angle_rad, Imperfections::NONE)?;
        let instants_s = self.instants_s(&model);
        let (trace, logged) = model.simulate_logged(&PhysicalFaults::from(damage), &instants_s)?;
        let of_phases = |phases_a: [Vec<f64>; 3], angle_rad: &[f64]| {
            let phases_a = phases_a.each_ref().map(Vec::as_slice);
            let pole_pairs = experiment.actuator.motor.pole_pairs;
            experiment.envelope.of_phases_at(phases_a, angle_rad, pole_pairs)
        };
        let on_clock = |samples: &Vec<f64>| {
            let brought =
                self.off_clock.as_ref().and_then(|phase| phase.brought_onto_clock(samples));
            brought.unwrap_or_else(|| samples.clone())
        };
        let sampled_a = of_phases(
            logged.phase_currents_a.each_ref().map(on_clock),
            &on_clock(&logged.motor_angle_rad),
        );
        let straight = |channel: &[f64]| resampled(channel, model.tick_hz(), self.rate_hz);
        let straight_a = of_phases(
            trace.phase_currents_a.each_ref().map(|phase| straight(phase)),
            &straight(&trace.motor_angle_rad),
        );
        let sampled_a = advanced(&sampled_a, self.late_s * self.rate_hz);
        let at_ticks_a = of_phases(trace.phase_currents_a, &trace.motor_angle_rad);
        let (rate_hz, tick_hz) = (self.rate_hz, model.tick_hz());
        Ok(ShownEnvelope { sampled_a, straight_a, rate_hz, at_ticks_a, tick_hz })
    }

    /// Instants of the samples within a test, s.
    fn instants_s(&self, model: &HighFidelity) -> Vec<f64> {
        let last_s = (model.samples() - 1) as f64 / model.tick_hz();
        let within = |since_first_s: f64| (since_first_s - self.late_s).clamp(0.0, last_s);
        if let Some(phase) = &self.off_clock
            && let Some(taken_s) = phase.taken_s()
        {
            return taken_s.iter().map(|taken_s| within(taken_s - phase.times_s()[0])).collect();
        }
        let count = ((last_s + self.late_s.max(0.0)) * self.rate_hz).floor() as usize + 1;
        (0..count).map(|n| within(n as f64 / self.rate_hz)).collect()
    }
}

/// Envelopes of a simulated machine before the filter, both from the first tick on.
pub(crate) struct ShownEnvelope {
    /// As it is sampled, A.
    sampled_a: Vec<f64>,
    /// Straight between ticks, A.
    straight_a: Vec<f64>,
    rate_hz: f64,
    /// At the ticks, A.
    at_ticks_a: Vec<f64>,
    tick_hz: f64,
}

impl ShownEnvelope {
    /// Part of the filtered envelope that samples at the ticks, which the bundle knows, do not have, A.
    pub(crate) fn ripple_a(&self, experiment: &Experiment) -> Vec<f64> {
        let expected_a = filtered(&self.at_ticks_a, self.tick_hz, experiment);
        let mut ripple_a = filtered(&self.sampled_a, self.rate_hz, experiment);
        for (value, expected) in ripple_a.iter_mut().zip(expected_a) {
            *value -= expected;
        }
        ripple_a
    }

    /// Tells whether an envelope before its filter has the ripple: samples whose stamps scatter, and
    /// that were taken evenly all the same, have none.
    ///
    /// With `d` the second differences of the ripple and `e` those of what the envelope is off the
    /// straight one, the share `Σ d·e / Σ d²` is near one or near none. Where current jumps, both are
    /// of the machine and not of the carrier, and are left out.
    pub(crate) fn is_in(&self, envelope_a: &[f64]) -> bool {
        let ripple = self.sampled_a.iter().zip(&self.straight_a).map(|(a, b)| a - b);
        let off = envelope_a.iter().zip(&self.straight_a).map(|(a, b)| a - b);
        let [ripple, off] = [ripple.collect::<Vec<_>>(), off.collect()].map(|of| bends(&of));
        let most = [&ripple, &off].map(|of| MOST_STD * usual_size(of));
        let (mut product, mut square) = (0.0, 0.0);
        for (d, e) in ripple.iter().zip(&off) {
            if d.abs() <= most[0] && e.abs() <= most[1] {
                product += d * e;
                square += d * d;
            }
        }
        product > LEAST_SHARE * square
    }

    /// White noise of an envelope before its filter beside this one, A: by second differences, which
    /// the rest of the machine moves little.
    pub(crate) fn noise_beside_a(&self, envelope_a: &[f64]) -> f64 {
        let off: Vec<f64> = envelope_a.iter().zip(&self.sampled_a).map(|(a, b)| a - b).collect();
        white_noise(&off)
    }
}

/// Standard deviation of the white noise of a signal whose rest is smooth, by second differences.
pub(crate) fn white_noise(of: &[f64]) -> f64 {
    // a sample and half of either neighbour
    usual_size(&bends(of)) / 1.5f64.sqrt()
}

/// Second differences.
fn bends(of: &[f64]) -> Vec<f64> {
    of.windows(3).map(|three| three[1] - 0.5 * (three[0] + three[2])).collect()
}

/// Standard deviation by the median of magnitudes, which rare large ones do not move.
fn usual_size(of: &[f64]) -> f64 {
    /// Median of the magnitude of a standard normal.
    const MEDIAN: f64 = 0.674_49;
    let mut sizes: Vec<f64> = of.iter().map(|value| value.abs()).collect();
    if sizes.is_empty() {
        return 0.0;
    }
    let middle = sizes.len() / 2;
    *sizes.select_nth_unstable_by(middle, f64::total_cmp).1 / MEDIAN
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_and_middles_of_carrier_periods_are_in_step() {
        let is_in_step = |rate_hz, late_s| {
            SamplingInstants { rate_hz, late_s, off_clock: None }.are_in_step(20e3, 0.5)
        };
        for rate_hz in [10e3, 5e3, 20e3, 40e3, 4e3] {
            assert!(is_in_step(rate_hz, 0.0) && is_in_step(rate_hz, 2.5e-5), "{rate_hz}");
            assert!(!is_in_step(rate_hz, 1e-5), "{rate_hz}");
        }
        assert!(!is_in_step(7e3, 0.0) && !is_in_step(100e3, 0.0));
        // 5 ppm: a tenth of half a carrier period over the test
        assert!(!is_in_step(10_000.05, 0.0));
    }
}
