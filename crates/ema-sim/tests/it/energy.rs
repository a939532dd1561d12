//! Energy: everything that comes in goes somewhere.

use super::effects::examples;
use approx::assert_abs_diff_eq;
use ema_sim::{
    Command, CurrentControl, EffectId, Envelope, EnvelopeFilter, HealthState, HighFidelity,
    PhysicalFaults, Scenario,
    presets::{BENCH, EMA_48},
};

/// Rounding of the position held at a stop, rad.
const STOP_RAD: f64 = 1e-12;

/// What the fourth-order series may lose, over the energy dissipated.
const BALANCE_REL: f64 = 1e-6;

fn worn() -> PhysicalFaults {
    let levels = [0.04, 0.02, 0.05, 0.0, 0.03, 0.05, 0.7];
    (&HealthState::new(levels).expect("on the scale")).into()
}

#[test]
fn law_energy_is_balanced_over_the_chirp() {
    let scenario = Scenario::chirp().with_real_electronics(3);
    let model = HighFidelity::new(&EMA_48, &scenario).unwrap();
    for faults in [PhysicalFaults::from(&HealthState::HEALTHY), worn()] {
        let (_, energy) = model.simulate_with_ledger(&faults);
        let off = energy.residual_j() / energy.dissipated_j();
        assert!(off.abs() < BALANCE_REL, "{off:e} {energy:?}");
        let parts = [
            energy.copper_j[0],
            energy.copper_j[1],
            energy.copper_j[2],
            energy.friction_j,
            energy.viscous_j,
            energy.gear_j,
        ];
        assert!(parts.iter().all(|part| *part > 1e-6), "{energy:?}");
    }
}

#[test]
fn law_energy_is_balanced_through_the_stops() {
    // the surface overshoots a command at the stop and hits it
    let mut actuator = EMA_48;
    actuator.transmission.stop_rad = 2e-3;
    actuator.controller.position_gain_per_s = 400.0;
    let mut scenario = Scenario { duration_s: 0.2, load_n_m: -3.0, ..Scenario::chirp() };
    scenario.command = Command::Sine { amplitude_rad: 2e-3, frequency_hz: 15.0 };
    let model = HighFidelity::new(&actuator, &scenario).unwrap();
    let (trace, energy) = model.simulate_with_ledger(&worn());
    let most = trace.surface_angle_rad.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    assert_abs_diff_eq!(most, 2e-3, epsilon = STOP_RAD);
    assert!(energy.impact_j > 1e-3, "{energy:?}");
    let off = energy.residual_j() / energy.dissipated_j();
    assert!(off.abs() < BALANCE_REL, "{off:e} {energy:?}");
}

#[test]
fn order_finer_segments_change_nothing_that_matters() {
    /// A hundred-thousandth of the root mean square, half of the filtered noise's thousandth.
    const CONVERGED_REL: f64 = 1e-5;
    let model = HighFidelity::new(&EMA_48, &Scenario::chirp()).unwrap();
    for faults in [PhysicalFaults::from(&HealthState::HEALTHY), worn()] {
        let coarse = model.simulate(&faults);
        let (fine, _) = model.simulate_finer(&faults, 1.0 / 40.0);
        assert!(fine.segments > 8 * coarse.segments, "{} {}", fine.segments, coarse.segments);
        for (a, b) in coarse.phase_currents_a.iter().zip(&fine.phase_currents_a) {
            let gap: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
            let size: f64 = b.iter().map(|b| b * b).sum();
            assert!((gap / size).sqrt() < CONVERGED_REL, "{:e}", (gap / size).sqrt());
        }
    }
}

#[test]
fn watching_changes_no_bit() {
    let model = HighFidelity::new(&EMA_48, &Scenario::chirp()).unwrap();
    assert_eq!(model.simulate(&worn()), model.simulate_with_ledger(&worn()).0);
}

#[test]
fn law_energy_is_balanced_under_hysteresis_control() {
    let carrier = HighFidelity::new(&EMA_48, &Scenario::chirp()).unwrap();
    let control = CurrentControl::Hysteresis { half_band_a: 0.15 };
    let hysteresis = carrier.clone().with_current_control(control).unwrap();
    let (trace, energy) = hysteresis.simulate_with_ledger(&worn());
    let off = energy.residual_j() / energy.dissipated_j();
    assert!(off.abs() < BALANCE_REL, "{off:e} {energy:?}");
    // the filtered envelope is the same machine's as under the carrier
    let signal = |trace: &ema_sim::HighFidelityTrace| {
        let raw = trace.envelope_a(Envelope::SignedProjection, EMA_48.motor.pole_pairs);
        EnvelopeFilter::DEFAULT.apply(&raw, trace.rate_hz)
    };
    let (a, b) = (signal(&trace), signal(&carrier.simulate(&worn())));
    let gap: f64 = a.iter().zip(&b).map(|(a, b)| (a - b) * (a - b)).sum();
    let size: f64 = b.iter().map(|b| b * b).sum();
    assert!((gap / size).sqrt() < 0.03, "{}", (gap / size).sqrt());
    assert!(carrier.with_current_control(CurrentControl::Hysteresis { half_band_a: 0.0 }).is_err());
}

/// With effects too: torques that they add count as friction, an elastic shaft keeps its own
/// account, and torque and back-EMF go on sharing one constant.
#[test]
fn law_energy_is_balanced_with_effects() {
    let scenario = Scenario { duration_s: 0.3, ..Scenario::chirp() };
    // a field-oriented drive whose surface may have a shaft of its own
    let mut three_legs = BENCH;
    three_legs.transmission.surface_friction_n_m = 0.0;
    for (actuator, taken) in [(EMA_48, 24), (three_legs, 21)] {
        let mut balanced = 0;
        for effect in examples() {
            let id = effect.id();
            let model = HighFidelity::new(&actuator, &scenario).unwrap();
            let Ok(model) = model.with_effects(&[effect]) else { continue };
            let (_, energy) = model.simulate_with_ledger(&worn());
            let off = energy.residual_j() / energy.dissipated_j();
            assert!(off.abs() < BALANCE_REL, "{id:?}: {off:e} {energy:?}");
            assert_eq!(energy.damping_j > 1e-6, id == EffectId::Compliance, "{energy:?}");
            balanced += 1;
        }
        assert_eq!(balanced, taken);
    }
}
