//! An experiment from its request to the published scores.

use fdi_core::report::{Evaluation, EvaluationSettings, SCHEMA_VERSION};

use crate::{
    noisy,
    request::{EvaluationError, EvaluationRequest},
    trials,
};

/// Runs an experiment.
///
/// # Errors
///
/// [`EvaluationError`] when the setting cannot be simulated or learnt from.
pub fn evaluate(request: &EvaluationRequest<'_>) -> Result<Evaluation, EvaluationError> {
    let methods =
        if request.protocol.is_noisy() { noisy::run(request)? } else { trials::run(request)? };
    let envelope_rate_hz = request.protocol.experiment()?.filter.output_hz;
    Ok(Evaluation {
        schema_version: SCHEMA_VERSION,
        protocol: request.protocol.name().to_owned(),
        conditions: request.conditions as u64,
        seed: request.seed,
        settings: settings(request, envelope_rate_hz),
        methods,
    })
}

fn settings(request: &EvaluationRequest<'_>, envelope_rate_hz: f64) -> EvaluationSettings {
    let setting = &request.setting;
    EvaluationSettings {
        controller_noise: setting.imperfections.controller_noise,
        digitisation: setting.imperfections.digitisation,
        sensor_noise_a: setting.sensor_noise_a,
        phase_rate_hz: setting.phase_rate_hz,
        envelope_rate_hz,
        snapshots: setting.snapshots as u64,
        sparse_snapshots: setting.sparse_snapshots as u64,
        largest_level: request.largest_level,
    }
}
