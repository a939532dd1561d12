//! The Cramér-Rao bound: what no unbiased estimate can beat.

use ema_sim::{FAULT_COUNT, FaultCoordinates};
use inference::NotPositiveDefinite;

use crate::{
    offline::{bundle::BundleError, estimator::information, factor::Factor},
    simulation::experiment::Experiment,
    statistics::noise_covariance::unit_noise_covariance,
};

/// Differences for the bound's derivatives.
const STEP: f64 = 1e-3;

/// Standard deviations of the coordinates looked for that white noise on each phase sample
/// allows at best, on the filtered envelope, the low-fidelity model and the start angle known.
///
/// ```text
/// sd_i = √[(JᵀΣ⁻¹J)⁻¹]_ii,    Σ = a²·C
/// ```
///
/// Coordinates not looked for are `None`. `noise_a` includes quantisation, `√(a² + LSB²/12)`.
///
/// # Source
///
/// Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, Prentice Hall 1993,
/// section 3.9 (Gaussian noise).
///
/// # Errors
///
/// [`BundleError`] when the experiment cannot be simulated.
pub fn sensor_bound_std(
    experiment: &Experiment,
    coordinates: &FaultCoordinates,
    start_angle_rad: f64,
    noise_a: f64,
    phase_rate_hz: f64,
) -> Result<[Option<f64>; FAULT_COUNT], BundleError> {
    let monitor = experiment.monitor(start_angle_rad)?;
    let sought = experiment.sought_indices();
    let jacobian = monitor.jacobian(coordinates, &sought, STEP);
    let unit = unit_noise_covariance(experiment, phase_rate_hz);
    let factor = Factor::new(unit.scaled(noise_a * noise_a), None)?;
    let covariance = information(&factor, &jacobian).try_inverse();
    let covariance = covariance.ok_or(NotPositiveDefinite { row: 0, pivot: 0.0 })?;
    let mut bound = [None; FAULT_COUNT];
    for (place, &index) in sought.iter().enumerate() {
        bound[index] = Some(covariance[(place, place)].sqrt());
    }
    Ok(bound)
}
