//! EMA-48 against the bars that the two models have to meet.

use approx::assert_abs_diff_eq;
use ema_sim::{
    Actuator, Envelope, EnvelopeFilter, FaultCoordinates, HealthState, HighFidelity, Load,
    LowFidelity, PhysicalFaults, Scenario,
    presets::{BENCH, EMA_48},
};

/// Rounding of the replayed controller, A.
const REPLAYED_A: f64 = 1e-9;

/// Healthy gap of the filtered envelope, rms over rms.
const HEALTHY_GAP: f64 = 0.01;
/// Cosine of a signature, low against high.
const SIGNATURE_COSINE: f64 = 0.95;
/// Relative difference of its magnitude.
const SIGNATURE_MAGNITUDE: f64 = 0.03;
/// Central differences at 1e-3 against 1e-4, median over base points, low and high fidelity.
const SMOOTH_LOW: f64 = 0.02;
const SMOOTH_HIGH: f64 = 0.15;
/// The low-fidelity current against finer segments, rms over rms.
const CONVERGED: f64 = 1e-5;
const BASE_POINTS: usize = 20;

fn healthy() -> PhysicalFaults {
    (&HealthState::HEALTHY).into()
}

fn worn() -> PhysicalFaults {
    (&HealthState::new([0.04, 0.02, 0.05, 0.0, 0.03, 0.05, 0.7]).expect("on the scale")).into()
}

fn high_signal(model: &HighFidelity, faults: &PhysicalFaults) -> Vec<f64> {
    let trace = model.simulate(faults);
    let raw = trace.envelope_a(Envelope::ConductingPhase, EMA_48.motor.pole_pairs);
    EnvelopeFilter::DEFAULT.apply(&raw, trace.rate_hz)
}

fn low_signal(model: &LowFidelity, faults: &PhysicalFaults) -> Vec<f64> {
    let trace = model.simulate(faults);
    EnvelopeFilter::DEFAULT.apply(&trace.current_a, trace.rate_hz)
}

fn models() -> (HighFidelity, LowFidelity) {
    let scenario = Scenario::chirp();
    let high = HighFidelity::new(&EMA_48, &scenario).expect("valid");
    (high, LowFidelity::new(&EMA_48, &scenario).expect("valid"))
}

fn rms(signal: &[f64]) -> f64 {
    (signal.iter().map(|x| x * x).sum::<f64>() / signal.len() as f64).sqrt()
}

fn combine(a: &[f64], b: &[f64], of: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| of(*a, *b)).collect()
}

/// Distance of two signals over the size of the second.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    rms(&combine(a, b, |a, b| a - b)) / rms(b)
}

#[test]
fn law_low_and_high_fidelity_agree_within_the_bars() {
    let (high, low) = models();
    let (high_zero, low_zero) = (high_signal(&high, &healthy()), low_signal(&low, &healthy()));
    let gap = distance(&low_zero, &high_zero);
    assert!(gap <= HEALTHY_GAP, "healthy gap {gap}");
    for (coordinate, name) in FaultCoordinates::NAMES.iter().enumerate() {
        let mut coordinates = [0.0; 7];
        coordinates[coordinate] = 0.05;
        let faults = (&FaultCoordinates(coordinates)).into();
        let h = combine(&high_signal(&high, &faults), &high_zero, |a, b| a - b);
        let l = combine(&low_signal(&low, &faults), &low_zero, |a, b| a - b);
        let dot = h.iter().zip(&l).map(|(a, b)| a * b).sum::<f64>() / h.len() as f64;
        let (cosine, magnitude) = (dot / (rms(&h) * rms(&l)), rms(&l) / rms(&h));
        assert!(cosine >= SIGNATURE_COSINE, "{name}: cosine {cosine}");
        assert_abs_diff_eq!(magnitude, 1.0, epsilon = SIGNATURE_MAGNITUDE);
    }
}

/// Pseudo-random base points: k1..k6 between 0.004 and 0.046, k7 anywhere.
fn base_points() -> Vec<FaultCoordinates> {
    let mut state = 12345_u64;
    let mut uniform = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1_u64 << 31) as f64
    };
    let mut point = || {
        let mut levels = [0.0; 7];
        levels[..6].fill_with(|| 0.004 + 0.042 * uniform());
        levels[6] = uniform();
        HealthState::new(levels).expect("on the scale").coordinates()
    };
    (0..BASE_POINTS).map(|_| point()).collect()
}

/// Median over the base points of what central differences at 1e-3 and 1e-4 differ by.
fn roughness(signal: &dyn Fn(&PhysicalFaults) -> Vec<f64>, coordinate: usize) -> f64 {
    let slope = |base: &FaultCoordinates, step: f64| {
        let at = |by: f64| {
            let mut moved = *base;
            moved.0[coordinate] += by;
            signal(&(&moved).into())
        };
        combine(&at(step), &at(-step), |a, b| (a - b) / (2.0 * step))
    };
    let mut all: Vec<f64> =
        base_points().iter().map(|base| distance(&slope(base, 1e-4), &slope(base, 1e-3))).collect();
    all.sort_by(f64::total_cmp);
    all[BASE_POINTS / 2]
}

#[test]
fn law_low_fidelity_is_smooth_in_the_fault_levels() {
    let (_, low) = models();
    for (coordinate, name) in FaultCoordinates::NAMES.iter().enumerate() {
        let found = roughness(&|faults| low_signal(&low, faults), coordinate);
        assert!(found <= SMOOTH_LOW, "{name}: {found}");
    }
}

/// But for the play, whose edges the sampled loops see a tick late.
#[test]
fn law_high_fidelity_is_smooth_in_the_fault_levels() {
    let (high, _) = models();
    for (coordinate, name) in FaultCoordinates::NAMES.iter().enumerate() {
        if *name != "k2" {
            let found = roughness(&|faults| high_signal(&high, faults), coordinate);
            assert!(found <= SMOOTH_HIGH, "{name}: {found}");
        }
    }
}

#[test]
fn order_low_fidelity_is_converged() {
    for (actuator, scenario) in
        [(EMA_48, Scenario::chirp()), (EMA_48, Scenario::sine()), (BENCH, Scenario::chirp())]
    {
        for faults in [healthy(), worn()] {
            let model = LowFidelity::new(&actuator, &scenario).expect("valid");
            let shipped = model.simulate(&faults);
            let finer = model.with_finer_segments(1.0 / 16.0).simulate(&faults);
            assert!(
                finer.segments > 8 * shipped.segments,
                "{} {}",
                finer.segments,
                shipped.segments
            );
            let gap = distance(&shipped.current_a, &finer.current_a);
            assert!(gap <= CONVERGED, "{gap:e}");
            // the check itself is not of the same run
            assert!(gap > 0.0);
        }
    }
}

#[test]
fn a_controller_shown_its_own_trace_asks_for_the_current_of_the_next_tick() {
    let (_, model) = models();
    let trace = model.simulate(&healthy());
    let asked_a = model.replayed_current_a(&trace);
    assert_eq!(asked_a.len(), trace.current_a.len());
    for (&asked, &there) in asked_a.iter().zip(&trace.current_a[1..]) {
        assert_abs_diff_eq!(asked, there, epsilon = REPLAYED_A);
    }
}

/// What a test takes over on another actuator is what a new one makes.
#[test]
fn a_test_on_another_actuator_is_a_new_one() {
    let scenario = Scenario { duration_s: 0.05, ..Scenario::chirp() };
    let load = || Load::Recorded { values_n_m: vec![0.0, 2.0, 2.0, -1.0], rate_hz: 100.0 };
    let new = |actuator: &Actuator| {
        LowFidelity::new(actuator, &scenario)
            .and_then(|test| test.with_load(load()))
            .expect("a test of ours")
    };
    let base = new(&EMA_48);
    let (mut heavier, mut slower) = (EMA_48, EMA_48);
    heavier.motor.inertia_kg_m2 *= 1.1;
    slower.controller.sample_hz *= 0.5;
    let faults = (&HealthState::HEALTHY).into();
    for actuator in [heavier, slower] {
        let taken = base.on_actuator(&actuator).expect("an actuator of ours");
        assert_eq!(taken.simulate(&faults), new(&actuator).simulate(&faults));
    }
    heavier.motor.inertia_kg_m2 = f64::NAN;
    assert!(base.on_actuator(&heavier).is_err());
}
