//! An experiment from its request to the published scores.

use fdi_core::report::{Evaluation, EvaluationSettings, SCHEMA_VERSION};

use crate::{
    noisy,
    protocol::Protocol,
    request::{EvaluationError, EvaluationRequest},
    trials,
};

/// Runs an experiment.
///
/// # Errors
///
/// [`EvaluationError`] when the setting cannot be simulated or learnt from.
pub fn evaluate(request: &EvaluationRequest<'_>) -> Result<Evaluation, EvaluationError> {
    let methods = match request.protocol {
        Protocol::Noisy => noisy::run(request)?,
        _ => trials::run(request)?,
    };
    Ok(Evaluation {
        schema_version: SCHEMA_VERSION,
        protocol: request.protocol.name().to_owned(),
        conditions: request.conditions as u64,
        seed: request.seed,
        settings: settings(request),
        methods,
    })
}

fn settings(request: &EvaluationRequest<'_>) -> EvaluationSettings {
    let setting = &request.setting;
    EvaluationSettings {
        controller_noise: setting.imperfections.controller_noise,
        digitisation: setting.imperfections.digitisation,
        sensor_noise_a: setting.sensor_noise_a,
        phase_rate_hz: setting.phase_rate_hz,
        envelope_rate_hz: request.protocol.experiment().filter.output_hz,
        snapshots: setting.snapshots as u64,
        sparse_snapshots: setting.sparse_snapshots as u64,
        largest_level: request.largest_level,
    }
}
