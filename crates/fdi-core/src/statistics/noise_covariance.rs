//! Covariance of white noise on the phases after the envelope's filter.
//!
//! # Source
//!
//! Derived in `docs/models/diagnosis.md`, section "Observation".

use ema_sim::EnvelopeFilter;
use inference::{BandedMatrix, dot};

/// Covariance of the filtered envelope for white noise of unit variance on each phase sample.
///
/// The envelope of a conducting phase is one sample of one phase, so that its noise is white too;
/// the filter, started at zero, colours it:
///
/// ```text
/// C_ij = Σ_{n ≥ 0} g(i·d − n)·g(j·d − n)
/// ```
///
/// with `g` the filter's response to an impulse and `d` the phase samples between two of the
/// envelope.
pub fn unit_noise_covariance(
    filter: &EnvelopeFilter,
    phase_rate_hz: f64,
    samples: usize,
) -> BandedMatrix {
    let response = filter.impulse_response(phase_rate_hz);
    let keep_every = (phase_rate_hz / filter.output_hz).round().max(1.0) as usize;
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

/// Covariance for any rate of the phases: noise of equal density at the next whole multiple of the
/// output's rate.
pub(crate) fn unit_noise_at_rate(
    filter: &EnvelopeFilter,
    phase_rate_hz: f64,
    samples: usize,
) -> BandedMatrix {
    let multiple = (phase_rate_hz / filter.output_hz - 1e-6).ceil().max(1.0);
    let rate_hz = multiple * filter.output_hz;
    let whole = unit_noise_covariance(filter, rate_hz, samples);
    let mut covariance = BandedMatrix::zeros(whole.order(), whole.half_band());
    covariance.add_scaled(rate_hz / phase_rate_hz, &whole);
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
        let covariance = unit_noise_covariance(&filter, rate_hz, 100);
        let want = core::f64::consts::FRAC_PI_2 * 200.0 / rate_hz;
        let got = covariance.at(99, 99);
        // the sampled filter differs from the continuous one by (2π·f_c/f_s)² relative
        assert_abs_diff_eq!(got, want, epsilon = 1e-4 * want);
    }

    #[test]
    fn it_is_positive_definite() {
        let covariance = unit_noise_covariance(&EnvelopeFilter::DEFAULT, 10e3, 200);
        assert!(covariance.cholesky().is_ok());
    }
}
