//! A small seeded part of `docs/validation/experiments.md`.

use experiments::{Contender, EvaluationRequest, EvaluationSetting, Protocol, evaluate};
use fdi_core::{ema_sim::Imperfections, report::Evaluation};

fn run(protocol: Protocol, contenders: &[Contender], jobs: usize, seed: u64) -> Evaluation {
    evaluate(&EvaluationRequest {
        protocol,
        setting: EvaluationSetting {
            imperfections: Imperfections::NONE,
            sensor_noise_a: if protocol.is_noisy() { 0.020 } else { 0.0 },
            phase_rate_hz: 10_000.0,
            snapshots: 60,
            sparse_snapshots: 0,
        },
        conditions: 8,
        contenders,
        healthy: 2,
        largest_level: 1.0,
        max_evaluations: None,
        seed,
        jobs,
        clock: None,
    })
    .unwrap()
}

/// The aim of the page is 0.2 % from 100 snapshots over 100 conditions; 60 snapshots and the
/// median of 8 conditions are given half as much again.
#[test]
fn published_low_fidelity_errors_are_beaten() {
    let result = run(Protocol::Low, &[Contender::Gls], 2, 1);
    assert!(result.methods[0].average_percent < 0.3, "{:?}", result.methods[0]);
}

/// The aim of the page is 0.2 %; what 60 snapshots and 8 conditions may miss is in it.
#[test]
fn published_bench_errors_are_within_the_aim() {
    let result = run(Protocol::Bench, &[Contender::Gls], 2, 1);
    assert!(result.methods[0].average_percent < 0.2, "{:?}", result.methods[0]);
}

#[test]
fn errors_do_not_depend_on_threads_but_on_the_seed() {
    let contenders = [Contender::Emulator, Contender::Gls];
    let one = run(Protocol::Bench, &contenders, 1, 1);
    assert_eq!(one, run(Protocol::Bench, &contenders, 3, 1));
    assert_ne!(one.methods, run(Protocol::Bench, &contenders, 1, 2).methods);
}

/// No unbiased estimate beats the bound, and a filtered envelope tells less than raw phases: for
/// the bounds themselves that holds exactly, up to the trend's own derivative (a few percent).
#[test]
fn law_bounds_are_ordered() {
    let result = run(Protocol::Noisy, &[Contender::Gls], 2, 1);
    for fault in &result.methods[0].faults {
        let (whole, sensor) = (fault.bound_std.unwrap(), fault.sensor_bound_std.unwrap());
        assert!(whole >= sensor, "{fault:?}");
        assert!(sensor > 0.9 * fault.phase_bound_std.unwrap(), "{fault:?}");
    }
}
