//! Samples of a recording among the ticks of a controller.

use super::{between::at_ticks, run::MachineTestError};
use crate::scenario::Command;

/// Deviation of a ratio of rates from a whole number that a clock may have.
const CLOCK_REL: f64 = 1e-4;
/// Ticks in a sample, least and most.
const TICKS_PER_SAMPLE: [f64; 2] = [1e-3, 1e6];

/// Rates of a recording and of the controller that it is of.
///
/// | rates | what a sample shows |
/// | --- | --- |
/// | a whole number of ticks in a sample | its tick |
/// | recording slower, otherwise | a value straight between the ticks around it |
/// | recording faster | of the controller's output the tick before, held; of motion a value between |
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sampling {
    ticks_per_sample: f64,
    sample_hz: f64,
}

impl Sampling {
    /// Sampling at a rate of a controller's ticks.
    ///
    /// # Errors
    ///
    /// [`MachineTestError::Rate`] for rates that differ by more than any recording's do.
    pub(super) fn new(rate_hz: f64, sample_hz: f64) -> Result<Self, MachineTestError> {
        let ratio = sample_hz / rate_hz;
        let [least, most] = TICKS_PER_SAMPLE;
        if !(ratio >= least && ratio <= most) {
            return Err(MachineTestError::Rate { rate_hz, sample_hz });
        }
        let whole = libm::round(ratio);
        let is_whole = whole >= 1.0 && (ratio - whole).abs() < CLOCK_REL * whole;
        Ok(Self { ticks_per_sample: if is_whole { whole } else { ratio }, sample_hz })
    }

    /// Number of ticks in a sample, where it is a whole one.
    fn step(&self) -> Option<usize> {
        let whole = libm::round(self.ticks_per_sample);
        (whole == self.ticks_per_sample).then_some(whole as usize)
    }

    /// A signal of motion at the samples, given at the ticks.
    pub(super) fn of_motion(&self, ticks: &[f64], samples: usize) -> Vec<f64> {
        self.shown(ticks, samples, false)
    }

    /// The controller's output at the samples, given at the ticks.
    pub(super) fn of_output(&self, ticks: &[f64], samples: usize) -> Vec<f64> {
        self.shown(ticks, samples, self.ticks_per_sample < 1.0)
    }

    fn shown(&self, ticks: &[f64], samples: usize, held: bool) -> Vec<f64> {
        if let Some(step) = self.step() {
            return ticks.iter().step_by(step).take(samples).copied().collect();
        }
        if ticks.is_empty() {
            return Vec::new();
        }
        let last = ticks.len() - 1;
        let at = |sample: usize| {
            let place = sample as f64 * self.ticks_per_sample;
            let before = (place as usize).min(last);
            let part = if held { 0.0 } else { (place - before as f64).min(1.0) };
            ticks[before] + part * (ticks[(before + 1).min(last)] - ticks[before])
        };
        (0..samples).map(at).collect()
    }

    /// A measured signal at the ticks, straight between the samples and constant after the last.
    pub(super) fn at_ticks(&self, samples: &[f64]) -> Vec<f64> {
        let last = samples.len().saturating_sub(1);
        let ticks = libm::round(samples.len() as f64 * self.ticks_per_sample) as usize;
        let at = |tick: usize| {
            let place = tick as f64 / self.ticks_per_sample;
            let before = (place as usize).min(last);
            let next = samples[(before + 1).min(last)];
            samples[before] + (next - samples[before]) * (place - before as f64)
        };
        (0..ticks).map(at).collect()
    }

    /// A measured position as the controller saw it, smooth between the samples.
    pub(super) fn of_sensor(&self, samples: &[f64]) -> Vec<f64> {
        let ticks = libm::ceil(samples.len() as f64 * self.ticks_per_sample) as usize;
        at_ticks(samples, self.ticks_per_sample, ticks)
    }

    /// A recorded command as the controller was given it.
    pub(super) fn command(&self, samples: &[f64], rate_hz: f64) -> Command {
        if self.ticks_per_sample == 1.0 {
            return Command::Recorded { values_rad: samples.to_vec(), rate_hz };
        }
        let ticks = libm::ceil(samples.len() as f64 * self.ticks_per_sample) as usize;
        let values_rad = at_ticks(samples, self.ticks_per_sample, ticks);
        Command::Recorded { values_rad, rate_hz: self.sample_hz }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_whole_number_of_ticks_shows_ticks() {
        let ticks: Vec<f64> = (0..40).map(f64::from).collect();
        let sampling = Sampling::new(250.000_01, 1000.0).unwrap();
        assert_eq!(sampling.of_motion(&ticks, 10), sampling.of_output(&ticks, 10));
        assert_eq!(sampling.of_motion(&ticks, 3), [0.0, 4.0, 8.0]);
    }

    #[test]
    fn other_rates_show_what_lies_between() {
        let ticks: Vec<f64> = (0..40).map(f64::from).collect();
        let slower = Sampling::new(800.0, 1000.0).unwrap();
        assert_eq!(slower.of_output(&ticks, 4), [0.0, 1.25, 2.5, 3.75]);
        let faster = Sampling::new(2000.0, 1000.0).unwrap();
        assert_eq!(faster.of_output(&ticks, 5), [0.0, 0.0, 1.0, 1.0, 2.0]);
        assert_eq!(faster.of_motion(&ticks, 5), [0.0, 0.5, 1.0, 1.5, 2.0]);
        assert_eq!(faster.at_ticks(&[0.0, 1.0, 2.0, 3.0]), [0.0, 2.0]);
    }

    #[test]
    fn rates_of_no_recording_are_refused() {
        for rate_hz in [0.0, -1.0, f64::NAN, 1e9] {
            let refused = Sampling::new(rate_hz, 1000.0);
            assert!(matches!(refused, Err(MachineTestError::Rate { .. })), "{rate_hz}");
        }
    }
}
