//! Effect of the drive's own noise on the diagnosed signal, from the low-fidelity model with that
//! noise in its loops.
//!
//! ```text
//! S_e = cov(y_LF(c, electronics) − y_LF(c)) + w²/3·C
//! ```
//!
//! The first term is the scatter of runs of the low-fidelity model with noise on its speed and
//! steps in its encoder and set-point, at the conditions of the reference signals; the second
//! the uniform noise of half width `w` on the current feedback, which the current follows well
//! beyond the envelope's filter. No reference signal takes part: it says which shape the noise
//! has, and costs a fraction of a millisecond a run where a reference signal costs several.
//!
//! # Source
//!
//! Derived in `docs/models/diagnosis.md`, section "Error of the monitor"; `w²/3` is the variance of a
//! uniform distribution.

use ema_sim::{Imperfections, SimulationError};
use inference::{BandedMatrix, tapered_covariance};

use crate::{
    offline::dataset::{Condition, Dataset, monitor_signals, sought_coordinates},
    simulation::{experiment::Experiment, high_fidelity_signal::HighFidelitySignal},
    statistics::noise_covariance::filtered_white_noise,
};

/// Samples of all runs together; a run of the chirp has a thousand.
const SAMPLES: usize = 400_000;
/// Runs at least.
const LEAST_RUNS: usize = 100;
/// Keeps the low-fidelity model's noise apart from that of the reference signals.
const STREAM: u64 = 0x6a09_e667_f3bc_c909;

/// The covariance of the drive's noise, A²: tapered scatter of the [`noise_of_loops`], and the noise
/// of the current feedback.
pub(crate) fn electronics_covariance(
    experiment: &Experiment,
    datasets: &[&Dataset],
    scatter: &[Vec<f64>],
    support_samples: usize,
) -> BandedMatrix {
    let carrier_hz = experiment.actuator.inverter.carrier_hz;
    let half_width_a = experiment.actuator.sensing.current_noise_half_width_a;
    let loops = tapered_covariance(scatter, support_samples);
    let feedback = filtered_white_noise(&experiment.filter, carrier_hz, experiment.samples());
    if datasets.iter().any(|dataset| dataset.imperfections.controller_noise) {
        loops.plus_scaled(half_width_a * half_width_a / 3.0, &feedback)
    } else {
        loops
    }
}

/// Runs of the low-fidelity model with noise less those without, centred, A; `None` where all
/// reference signals are of ideal electronics.
///
/// # Errors
///
/// [`SimulationError`] when the low-fidelity model cannot be run.
pub(crate) fn noise_of_loops(
    experiment: &Experiment,
    datasets: &[&Dataset],
) -> Result<Option<Vec<Vec<f64>>>, SimulationError> {
    let conditions: Vec<(&Condition, &Dataset)> = datasets
        .iter()
        .filter(|dataset| dataset.imperfections != Imperfections::NONE)
        .flat_map(|dataset| dataset.conditions.iter().map(move |c| (c, *dataset)))
        .collect();
    if conditions.is_empty() {
        return Ok(None);
    }
    let runs = (SAMPLES / experiment.samples().max(1)).max(LEAST_RUNS);
    let place_of = |run: usize| run * conditions.len() / runs;
    let mut places: Vec<usize> = (0..runs).map(place_of).collect();
    places.dedup();
    let simulated: Vec<Condition> = places.iter().map(|&place| *conditions[place].0).collect();
    let ideal = monitor_signals(experiment, &simulated)?;
    let mut scatter = Vec::with_capacity(runs);
    for run in 0..runs {
        let (condition, dataset) = conditions[place_of(run)];
        let place = places.partition_point(|&place| place < place_of(run));
        let seed = condition.noise_seed ^ STREAM.wrapping_mul(run as u64 + 1);
        let angle_rad = condition.start_angle_rad;
        let mut noisy = experiment.noisy_monitor(angle_rad, dataset.imperfections, seed)?;
        let coordinates = condition.coordinates();
        let mut difference = noisy.signal(&coordinates);
        for (value, ideal) in difference.iter_mut().zip(&ideal[place]) {
            *value -= ideal;
        }
        scatter.push(difference);
    }
    centre(&mut scatter);
    Ok(Some(scatter))
}

/// Noise of the electronics in the reference signals of a dataset: these less the
/// model without noise at the same conditions.
pub(crate) fn electronics_noise(
    experiment: &Experiment,
    dataset: &Dataset,
) -> Result<Vec<Vec<f64>>, SimulationError> {
    let rate_hz = experiment.phase_rate_hz.unwrap_or(experiment.actuator.controller.sample_hz);
    let points = sought_coordinates(experiment, dataset);
    let conditions = dataset.conditions.iter().zip(&dataset.signals_a).zip(points);
    conditions
        .map(|((condition, reference), point)| {
            let (start_rad, electronics) = (condition.start_angle_rad, dataset.imperfections);
            let monitor = HighFidelitySignal::new(experiment, start_rad, electronics, rate_hz)?;
            Ok(monitor.residual(reference, &point))
        })
        .collect()
}

/// Takes the mean over the runs off each of them.
fn centre(runs: &mut [Vec<f64>]) {
    let samples = runs.first().map_or(0, Vec::len);
    for sample in 0..samples {
        let mean = runs.iter().map(|run| run[sample]).sum::<f64>() / runs.len() as f64;
        for run in runs.iter_mut() {
            run[sample] -= mean;
        }
    }
}
