//! Bayesian optimisation of the residual against generalised least squares.

use fdi_core::{
    Bundle, DiagnoseOptions, Diagnoser, EMBEDDED_BUNDLES, Experiment, RecordedContent,
    SimulatedRecording,
    ema_sim::{HealthState, Imperfections, PhaseSensors},
    report::Method,
};

/// Distance of a level from that of `gls`, in stated standard deviations: the search ends where
/// fifteen evaluations lower the norm by less than one standard deviation of an estimate.
const DISTANCE: f64 = 1.0;
/// Evaluations of the default budget, with those that the covariance takes.
const MOST_EVALUATIONS: u64 = 80 + 1 + 14;

#[test]
fn composite_comes_to_the_levels_of_gls() {
    let diagnoser = Diagnoser::new(Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes).unwrap()).unwrap();
    let levels = [0.01, 0.02, 0.0, 0.03, 0.0, 0.02, 0.3];
    let recording = SimulatedRecording {
        faults: HealthState::new(levels).unwrap().coordinates(),
        start_angle_rad: 0.0,
        imperfections: Imperfections::REAL,
        controller_seed: 7,
        sensors: PhaseSensors { noise_a: 0.02, converter: None },
        phase_rate_hz: None,
        sensor_seed: 8,
        content: RecordedContent::Phases,
        has_voltage: false,
    }
    .record(&Experiment::chirp(), "r")
    .unwrap();
    let answer = |method: Method| {
        let options = DiagnoseOptions { method, ..DiagnoseOptions::default() };
        diagnoser.diagnose(&recording, &options).unwrap()
    };
    let (gls, composite) = (answer(Method::Gls), answer(Method::Composite));
    assert_eq!(composite.method, Method::Composite);
    assert_eq!(composite.verdict, gls.verdict);
    assert!(composite.evaluations <= MOST_EVALUATIONS, "{}", composite.evaluations);
    for (found, wanted) in composite.faults.iter().zip(&gls.faults) {
        assert_eq!(found.detected, wanted.detected, "{found:?}");
        let (a, b) = (found.value.unwrap(), wanted.value.unwrap());
        assert!((a - b).abs() < DISTANCE * wanted.std.unwrap(), "{found:?} {wanted:?}");
    }
}
