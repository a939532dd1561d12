//! Effects and changing loads on the bench: no sectors, an encoder on the motor, a surface that
//! rubs.

use approx::assert_abs_diff_eq;
use ema_sim::{
    Actuator, CurrentControl, Effect, EffectError, EffectId, Envelope, EnvelopeFilter, Geometry,
    HealthState, HighFidelity, Load, LowFidelity, PhysicalFaults, Role, Scenario, SimulationError,
    presets::{BENCH, EMA_48},
};

use super::effects::{LIMITS_ONLY, difference, examples};

fn healthy() -> PhysicalFaults {
    (&HealthState::HEALTHY).into()
}

fn high(actuator: &Actuator, effects: &[Effect]) -> Result<Vec<f64>, SimulationError> {
    let model = HighFidelity::new(actuator, &Scenario::chirp())?.with_effects(effects)?;
    let trace = model.simulate(&healthy());
    let raw = trace.envelope_a(Envelope::QAxis, actuator.motor.pole_pairs);
    Ok(EnvelopeFilter::DEFAULT.apply(&raw, trace.rate_hz))
}

fn low(effects: &[Effect]) -> Result<Vec<f64>, SimulationError> {
    let model = LowFidelity::new(&BENCH, &Scenario::chirp())?.with_effects(effects)?;
    let trace = model.simulate(&healthy());
    Ok(EnvelopeFilter::DEFAULT.apply(&trace.current_a, trace.rate_hz))
}

/// The effects that a model refuses, by symbol.
fn refused(with: impl Fn(&[Effect]) -> Result<Vec<f64>, SimulationError>) -> Vec<&'static str> {
    let refuses = |id: &EffectId| match with(&[Effect::new(*id, Geometry::Rotary)]) {
        Ok(_) => false,
        Err(SimulationError::Effect(EffectError::NotInModel { effect, .. })) => effect == *id,
        Err(other) => panic!("{id:?}: {other}"),
    };
    EffectId::ALL.into_iter().filter(refuses).map(|id| id.info().symbol).collect()
}

#[test]
fn what_the_bench_has_no_place_for_is_refused() {
    assert_eq!(refused(low), ["E08", "E20", "E23", "E24", "E25"]);
    assert_eq!(refused(|effects| high(&BENCH, effects)), ["E08", "E20", "E23", "E24", "E25"]);
    let error = low(&[Effect::new(EffectId::PositionSensor, Geometry::Rotary)]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "effect E20 (position sensor) does not act in the low-fidelity model: the loop is closed \
         on the motor's shaft, not on the surface"
    );
}

/// An effect with all its sizes at a share of themselves.
fn scaled(mut effect: Effect, share: f64) -> Effect {
    for parameter in effect.id().info().parameters {
        let key = parameter.key(Geometry::Rotary);
        if parameter.role() == Role::Amplitude {
            let size = effect.get(key).expect("its own key");
            effect.set(key, share * size).expect("within bounds");
        }
    }
    effect
}

/// What the segments of the path with effects, cut at the seams of the carrier, differ by from
/// those without, and what is left of sizes a hundred-thousandth of the examples'.
const VANISHING_REL: f64 = 1e-6;

/// Every way of switching three legs, and both dead times, come back to the base model.
#[test]
fn order_a_vanishing_size_leads_back_to_the_base_model() {
    let scenario = Scenario { duration_s: 0.1, ..Scenario::chirp() };
    let mut dead = BENCH;
    dead.inverter.dead_time_s = 1e-6;
    let mut pair = EMA_48;
    pair.inverter.dead_time_s = 1e-6;
    let model = |actuator| HighFidelity::new(actuator, &scenario).unwrap();
    let averaged = model(&BENCH).with_current_control(CurrentControl::Averaged).unwrap();
    for base in [model(&BENCH), averaged, model(&dead), model(&pair)] {
        let speed = base.simulate(&healthy()).motor_speed_rad_per_s;
        for effect in examples() {
            let id = effect.id();
            if [EffectId::Presliding, EffectId::Compliance, EffectId::InductanceEddy].contains(&id)
            {
                continue;
            }
            let Ok(extended) = base.clone().with_effects(&[scaled(effect, 1e-5)]) else { continue };
            let found = extended.simulate(&healthy()).motor_speed_rad_per_s;
            let apart = difference(&found, &speed);
            assert!(apart < VANISHING_REL, "{id:?}: {apart:e}");
        }
    }
}

/// The current loop's band moves the quick parts: 0.9969 for the ripple of the current, 0.9976 for
/// cogging, 0.9987 for the delay, above 0.9997 for the rest.
const ALIKE_COSINE: f64 = 0.995;
/// 4.8 % for the ripple, 4.7 % for the delay, at most 3 % for the rest.
const ALIKE_SIZE_REL: f64 = 0.06;

/// What an effect does to the current in quadrature in both fidelities, where both have it.
#[test]
fn both_fidelities_show_an_effect_alike() {
    let less =
        |a: Vec<f64>, b: &[f64]| -> Vec<f64> { a.into_iter().zip(b).map(|(a, b)| a - b).collect() };
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let (low_base, high_base) = (low(&[]).unwrap(), high(&BENCH, &[]).unwrap());
    let mut compared = 0;
    for mut effect in examples() {
        let id = effect.id();
        if LIMITS_ONLY.contains(&id) {
            continue;
        }
        if id == EffectId::InductanceEddy {
            effect.set("inductance_henry", 0.0).unwrap();
        }
        let effects = [effect];
        let Ok(found) = high(&BENCH, &effects) else { continue };
        let (a, b) = (less(found, &high_base), less(low(&effects).unwrap(), &low_base));
        let cosine = dot(&a, &b) / (dot(&a, &a) * dot(&b, &b)).sqrt();
        let ratio = (dot(&a, &a) / dot(&b, &b)).sqrt();
        assert!(cosine > ALIKE_COSINE, "{id:?}: {cosine}");
        assert_abs_diff_eq!(ratio, 1.0, epsilon = ALIKE_SIZE_REL);
        compared += 1;
    }
    assert_eq!(compared, 18);
}

#[test]
fn a_load_that_changes_is_felt() {
    let scenario = Scenario { load_n_m: 0.0, duration_s: 0.1, ..Scenario::chirp() };
    let loaded = Scenario { load_n_m: 20.0, ..scenario.clone() };
    let held = Load::Recorded { values_n_m: vec![20.0], rate_hz: 10.0 };
    let high = |scenario| HighFidelity::new(&BENCH, scenario).unwrap();
    assert_eq!(
        high(&scenario).with_load(held.clone()).unwrap().simulate(&healthy()),
        high(&loaded).simulate(&healthy())
    );
    let low = |scenario| LowFidelity::new(&BENCH, scenario).unwrap();
    assert_eq!(
        low(&scenario).with_load(held).unwrap().simulate(&healthy()),
        low(&loaded).simulate(&healthy())
    );
    let step = Load::Recorded { values_n_m: vec![0.0, 20.0], rate_hz: 20.0 };
    let apart = difference(
        &high(&scenario).with_load(step).unwrap().simulate(&healthy()).surface_angle_rad,
        &high(&scenario).simulate(&healthy()).surface_angle_rad,
    );
    assert!(apart > 1e-4, "{apart:e}");
}

/// Legs without control electronics feel effects and loads too.
#[test]
fn effects_act_on_given_duties() {
    let mut scenario = Scenario { load_n_m: 0.0, ..Scenario::sine() };
    scenario.initial.motor_speed_rad_per_s = 100.0;
    let model = HighFidelity::new(&BENCH, &scenario).unwrap();
    let braked = |model: &HighFidelity| {
        model.simulate_duties(&healthy(), &[[0.5; 3]; 200]).unwrap().motor_speed_rad_per_s[99]
    };
    let plain = braked(&model);
    let drag = Effect::new(EffectId::InductanceEddy, Geometry::Rotary)
        .with("eddy_n_m_s_per_rad", 1e-4)
        .unwrap();
    assert!(braked(&model.clone().with_effects(&[drag]).unwrap()) < plain - 0.1);
    let load = Load::Recorded { values_n_m: vec![20.0], rate_hz: 10.0 };
    assert!(braked(&model.with_load(load).unwrap()) < plain - 0.1);
}
