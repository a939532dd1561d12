//! Covariance of white noise on the phases after the envelope's filter.
//!
//! # Source
//!
//! Derived in `docs/models/diagnosis.md`, section "Observation".

use ema_sim::EnvelopeFilter;
use inference::{BandedMatrix, dot};

use crate::simulation::experiment::Experiment;

/// Covariance of the filtered envelope of a test for white noise of unit variance on each phase
/// sample, at any rate of the phases.
///
/// The envelope is a sum over the phases of one sample each, so that its noise is white too, of the
/// variance [`Envelope::noise_variance`](ema_sim::Envelope::noise_variance).
pub fn unit_noise_covariance(experiment: &Experiment, phase_rate_hz: f64) -> BandedMatrix {
    let white = filtered_white_noise(&experiment.filter, phase_rate_hz, experiment.samples());
    white.scaled(experiment.envelope.noise_variance())
}

/// Covariance of a filtered signal for white noise of unit variance before the filter, at any rate:
/// noise of equal density at the next whole multiple of the output's rate.
pub(crate) fn filtered_white_noise(
    filter: &EnvelopeFilter,
    rate_hz: f64,
    samples: usize,
) -> BandedMatrix {
    let multiple = (rate_hz / filter.output_hz - 1e-6).ceil().max(1.0);
    let whole_hz = multiple * filter.output_hz;
    let whole = at_whole_multiple(filter, whole_hz, samples);
    let mut covariance = BandedMatrix::zeros(whole.order(), whole.half_band());
    covariance.add_scaled(whole_hz / rate_hz, &whole);
    covariance
}

/// Covariance at a whole multiple of the output's rate: the filter, started at zero, colours white
/// noise.
///
/// ```text
/// C_ij = Σ_{n ≥ 0} g(i·d − n)·g(j·d − n)
/// ```
///
/// with `g` the filter's response to an impulse and `d` the samples before the filter between two
/// behind it.
fn at_whole_multiple(filter: &EnvelopeFilter, rate_hz: f64, samples: usize) -> BandedMatrix {
    let response = filter.impulse_response(rate_hz);
    let keep_every = (rate_hz / filter.output_hz).round().max(1.0) as usize;
    let reach = response.len() / keep_every;
    let mut covariance = BandedMatrix::zeros(samples, reach);
    let half_band = covariance.half_band();
    // once the response has died out the rows repeat
    let settled = reach + half_band + 1;
    for i in 0..samples {
        for j in i.saturating_sub(half_band)..=i {
            *covariance.at_mut(i, j) = if i > settled {
                covariance.at(settled, settled - (i - j))
            } else {
                let lag = (i - j) * keep_every;
                // n runs back from sample j to the start of the recording
                let count = (j * keep_every + 1).min(response.len().saturating_sub(lag));
                dot(&response[..count], &response[lag..lag + count])
            };
        }
    }
    covariance
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn law_variance_of_two_first_order_stages() {
        // For white noise at a rate far above the corner the variance of the filtered signal is
        // that of the continuous filter: ∫|H|²df·(1/f_s)·2 with |H|² = 1/(1 + (f/f_c)²)²,
        // which is (π/2)·f_c/f_s.
        let filter = EnvelopeFilter { corner_hz: 200.0, output_hz: 2000.0 };
        let rate_hz = 200e3;
        let covariance = filtered_white_noise(&filter, rate_hz, 100);
        let want = core::f64::consts::FRAC_PI_2 * 200.0 / rate_hz;
        let got = covariance.at(99, 99);
        // the sampled filter differs from the continuous one by (2π·f_c/f_s)² relative
        assert_abs_diff_eq!(got, want, epsilon = 1e-4 * want);
    }

    #[test]
    fn it_is_positive_definite() {
        let covariance = filtered_white_noise(&EnvelopeFilter::DEFAULT, 10e3, 200);
        assert!(covariance.cholesky().is_ok());
    }
}
