//! The setting of the searches: ideal electronics, no noise of the sensors.

use experiments::{Clock, Contender, EvaluationRequest, EvaluationSetting, Protocol};
use fdi_core::ema_sim::Imperfections;

use super::case::SEEDS;
use crate::processor::jobs;

/// Root seed, that of the page.
pub(super) const SEED: u64 = 1;

/// The request of searches with some methods on every thread.
pub(super) fn request<'a>(
    problem: Protocol,
    contenders: &'a [Contender],
    clock: Option<Clock<'a>>,
) -> EvaluationRequest<'a> {
    EvaluationRequest {
        protocol: problem,
        setting: EvaluationSetting {
            imperfections: Imperfections::NONE,
            sensor_noise_a: 0.0,
            phase_rate_hz: 10_000.0,
            snapshots: 100,
            sparse_snapshots: 0,
        },
        conditions: SEEDS,
        contenders,
        healthy: 0,
        largest_level: 1.0,
        max_evaluations: None,
        seed: SEED,
        jobs: jobs(),
        clock,
    }
}
