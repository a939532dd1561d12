//! The sensors that record the phase currents: noise and digitisation.

use crate::{
    noise::NoiseSource, parameter::within, parameter_error::ParameterError, params::Controller,
};

/// An analogue-to-digital converter, symmetric about zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Converter {
    /// Bits of its word.
    pub bits: u32,
    /// Largest current shown, of either sign.
    pub range_a: f64,
}

impl Converter {
    /// Twelve bits over ±20 A.
    pub const DEFAULT: Self = Self { bits: 12, range_a: 20.0 };

    /// Converter of a drive; without a stated range it spans the largest current that the
    /// controller asks for, A.
    pub fn of_drive(bits: u32, stated_range_a: Option<f64>, controller: &Controller) -> Self {
        Self { bits, range_a: stated_range_a.unwrap_or(controller.current_limit_a) }
    }

    /// Step of the converter, `2·range/2^bits`.
    pub fn step_a(&self) -> f64 {
        2.0 * self.range_a / libm::exp2(f64::from(self.bits))
    }

    /// The nearest step within the range.
    fn read(&self, current_a: f64) -> f64 {
        let step = self.step_a();
        let most = libm::floor(self.range_a / step) - 1.0;
        step * libm::floor(current_a / step + 0.5).clamp(-most - 1.0, most)
    }
}

/// The current sensors of three phases.
///
/// # Examples
///
/// ```
/// use ema_sim::{Converter, PhaseSensors};
///
/// let sensors = PhaseSensors { noise_a: 0.020, converter: Some(Converter::DEFAULT) };
/// let quiet = vec![0.0; 1000];
/// let [a, b, _] = sensors.measure([&quiet, &quiet, &quiet], 7);
/// assert_ne!(a, b, "the phases have noise of their own");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhaseSensors {
    /// White noise on each sample of each phase, rms.
    pub noise_a: f64,
    /// The converter; `None` for one without steps.
    pub converter: Option<Converter>,
}

/// Distance between the seeds of the phases' noise.
const PHASE_STREAM: u64 = 0xd1b5_4a32_d192_ed03;

/// Range below which a converter tells nothing from nothing.
const LEAST_RANGE_A: f64 = 1e-6;

impl PhaseSensors {
    /// Beyond the noise and the range of any current sensor, A.
    pub const MOST_A: f64 = 1e6;

    /// Refuses sensors that nobody has.
    ///
    /// # Errors
    ///
    /// [`ParameterError::OutOfBounds`] for `noise-a` that is not from 0 to 1 MA, for `adc-range-a`
    /// that is not from 1 µA to 1 MA, and for `adc-bits` that are not from 1 to 32.
    pub fn check(&self) -> Result<(), ParameterError> {
        within("noise-a", self.noise_a, 0.0, Self::MOST_A)?;
        let Some(converter) = &self.converter else { return Ok(()) };
        within("adc-range-a", converter.range_a, LEAST_RANGE_A, Self::MOST_A)?;
        within("adc-bits", f64::from(converter.bits), 1.0, 32.0)
    }

    /// Readings of the sensors for three currents; equal seeds give equal noise.
    pub fn measure(&self, phases_a: [&[f64]; 3], seed: u64) -> [Vec<f64>; 3] {
        let mut phase = 0;
        phases_a.map(|currents| {
            phase += 1;
            let mut noise = NoiseSource::new(seed.wrapping_add(PHASE_STREAM.wrapping_mul(phase)));
            currents
                .iter()
                .map(|current| {
                    let noisy = current + self.noise_a * noise.normal();
                    self.converter.map_or(noisy, |converter| converter.read(noisy))
                })
                .collect()
        })
    }

    /// Variance of the noise on a sample, quantisation as white noise included,
    /// `a² + LSB²/12`.
    pub fn variance_a2(&self) -> f64 {
        let step = self.converter.map_or(0.0, |converter| converter.step_a());
        self.noise_a * self.noise_a + step * step / 12.0
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    #[test]
    fn law_variance_of_the_measured_noise() {
        let sensors = PhaseSensors { noise_a: 0.02, converter: Some(Converter::DEFAULT) };
        let quiet = vec![0.0; 100_000];
        let [a, ..] = sensors.measure([&quiet, &quiet, &quiet], 3);
        let variance = a.iter().map(|x| x * x).sum::<f64>() / 1e5;
        // five standard errors, √(2/n): false failure below 1e-6, and seeded
        assert_abs_diff_eq!(
            variance / sensors.variance_a2(),
            1.0,
            epsilon = 5.0 * (2.0f64 / 1e5).sqrt()
        );
    }

    #[test]
    fn sensors_that_nobody_has_are_refused_by_name() {
        let told = |noise_a: f64, converter| {
            PhaseSensors { noise_a, converter }.check().map_err(|error| error.to_string())
        };
        let of = |bits, range_a| Some(Converter { bits, range_a });
        assert_eq!(told(0.02, of(12, 20.0)), Ok(()));
        let expected = |text: &str| Err(text.to_owned());
        assert_eq!(
            told(1e300, None),
            expected("`noise-a` is 1e300, expected a number from 0 to 1000000")
        );
        assert!(told(f64::NAN, None).is_err() && told(-1.0, None).is_err());
        assert_eq!(
            told(0.0, of(12, 1e-300)),
            expected("`adc-range-a` is 1e-300, expected a number from 0.000001 to 1000000")
        );
        assert_eq!(
            told(0.0, of(40, 20.0)),
            expected("`adc-bits` is 40, expected a number from 1 to 32")
        );
    }

    #[test]
    fn a_converter_without_a_range_spans_the_current_that_is_asked_for() {
        let controller = &crate::presets::EMA_48.controller;
        let of = |range_a| Converter::of_drive(12, range_a, controller);
        assert_eq!(of(None), Converter { bits: 12, range_a: controller.current_limit_a });
        assert_eq!(of(Some(3.0)), Converter { bits: 12, range_a: 3.0 });
    }

    #[test]
    fn the_converter_saturates() {
        assert_eq!(Converter::DEFAULT.read(100.0), 20.0 - Converter::DEFAULT.step_a());
        assert_eq!(Converter::DEFAULT.read(-100.0), -20.0);
    }
}
