//! Tests of EMA-48 that are planned, and one that was put together by hand.

use fdi_core::{
    Experiment, PlanError, PlanRequest, PlannedTest, RootSeed,
    ema_sim::{FaultId, presets},
    motion_limits, plan_test,
};

use super::learnt::over_days;
use crate::request::EvaluationError;

/// Load of all tests that are compared, that of the chirp, N·m.
const LOAD_N_M: f64 = 0.5;
/// Rate of a command, Hz.
const RATE_HZ: f64 = 1000.0;
/// Slow triangle of the test by hand: amplitude at the surface and length.
const SLOW: (f64, f64) = (0.030, 5.0);
/// Speeds of the rotor in its plateaus, rad/s, and their length together, s.
const PLATEAUS_RAD_PER_S: [f64; 9] = [50.0, 100.0, 150.0, 200.0, 250.0, 300.0, 350.0, 400.0, 450.0];
const PLATEAUS_S: f64 = 3.8;

/// A request for a test of EMA-48 that tells all faults, beside four recordings as new, within the
/// limits that are taken where none are given.
pub fn plan_request(within_s: f64, seed: u64, jobs: usize) -> PlanRequest {
    let sizes = FaultId::ALL.into_iter().filter(|fault| *fault != FaultId::EccentricityPhase);
    PlanRequest {
        faults: sizes.collect(),
        within_s,
        references: 4,
        reading_std_k: 3.0,
        is_read: false,
        has_voltage: false,
        load_n_m: LOAD_N_M,
        limits: motion_limits(&presets::EMA_48),
        seed: RootSeed(seed),
        jobs,
    }
}

/// Plans a test of EMA-48 at its usual tolerances on days with the winding within a half-width; the
/// test with the plan.
///
/// # Errors
///
/// [`PlanError`] when no motion is within the limits.
pub fn planned_test(
    request: &PlanRequest,
    half_width_k: f64,
) -> Result<(Experiment, PlannedTest), PlanError> {
    let model = over_days(Experiment::chirp(), half_width_k).model();
    let plan = plan_test("ema-48", &model, None, request, &|_| ())?;
    let mut test = Experiment::recorded(plan.command_rad.clone(), plan.rate_hz);
    test.scenario.load_n_m = request.load_n_m;
    Ok((test.of_model("ema-48", &model)?, plan))
}

/// A slow triangle and plateaus of speed both ways, of the same machine.
///
/// # Errors
///
/// [`EvaluationError`] when the machine cannot follow.
pub fn test_by_hand(half_width_k: f64) -> Result<Experiment, EvaluationError> {
    let model = over_days(Experiment::chirp(), half_width_k).model();
    let gear = presets::EMA_48.transmission.gear_ratio;
    let each_s = PLATEAUS_S / PLATEAUS_RAD_PER_S.len() as f64;
    let plateaus = PLATEAUS_RAD_PER_S.map(|speed| (speed / gear * each_s / 4.0, each_s));
    let triangles = std::iter::once(SLOW).chain(plateaus);
    let command_rad = triangles.flat_map(|(amplitude_rad, length_s)| {
        let samples = (length_s * RATE_HZ).round();
        (0..samples as usize).map(move |n| {
            let part = n as f64 / samples;
            // up, down to the other side, and up to zero
            let unit = if part < 0.25 {
                4.0 * part
            } else if part < 0.75 {
                2.0 - 4.0 * part
            } else {
                4.0 * part - 4.0
            };
            amplitude_rad * unit
        })
    });
    let mut test = Experiment::recorded(command_rad.collect(), RATE_HZ);
    test.scenario.load_n_m = LOAD_N_M;
    Ok(test.of_model("ema-48", &model)?)
}
