//! Each effect does what its equation says, and nothing without a size.

use approx::assert_abs_diff_eq;
use core::f64::consts::{PI, TAU};

use ema_sim::{
    Actuator, Command, Coordinate, Curve, CurveKind, Effect, EffectId, Geometry, HealthState,
    HingeMoment, Load, LowFidelity, LowFidelityTrace, PhysicalFaults, Role, Scenario, Tone,
    presets::EMA_48,
};
use libm::{cos, exp, pow, sin};

/// Rounding of a first-order lag over 10 000 ticks, A.
const LAG_A: f64 = 1e-12;
/// Half a step of the position's sensor with rounding, rad.
const HALF_STEP_RAD: f64 = 0.5001e-6;
/// Rounding of a position over its step.
const WHOLE_STEPS: f64 = 1e-6;
/// Current that warming by half a tick's heat leaves open, A.
const WARMING_A: f64 = 0.15;

pub(super) fn healthy() -> PhysicalFaults {
    (&HealthState::HEALTHY).into()
}

/// Moves through many speeds and angles under load.
pub(super) fn scenario() -> Scenario {
    let tone = |amplitude_rad, frequency_hz| Tone { amplitude_rad, frequency_hz, phase_rad: 0.0 };
    Scenario {
        command: Command::MultiSine(vec![tone(0.03, 0.9), tone(0.01, 3.1)]),
        load_n_m: 2.0,
        duration_s: 1.0,
        start_angle_rad: 0.3,
        ..Scenario::chirp()
    }
}

pub(super) fn effect(id: EffectId, numbers: &[(&str, f64)]) -> Effect {
    numbers.iter().fold(Effect::new(id, Geometry::Rotary), |effect, (key, value)| {
        effect.with(key, *value).expect("valid")
    })
}

pub(super) fn run(
    actuator: &Actuator,
    scenario: &Scenario,
    effects: &[Effect],
) -> LowFidelityTrace {
    let model = LowFidelity::new(actuator, scenario).and_then(|model| model.with_effects(effects));
    model.expect("valid").simulate(&healthy())
}

/// One of each, with sizes that a real machine could have.
pub(super) fn examples() -> Vec<Effect> {
    use EffectId::*;
    let curve = Curve::new(
        Coordinate::Speed,
        CurveKind::Torque,
        vec![[-100.0, -2e-3], [0.0, 0.0], [100.0, 4e-3]],
    );
    vec![
        effect(Stribeck, &[("stribeck_n_m", 0.01)]),
        effect(NonlinearViscous, &[("viscous_at_reference_n_m", 0.005)]),
        effect(
            DirectionalFriction,
            &[("coulomb_asymmetry_n_m", 3e-3), ("viscous_asymmetry_n_m_s_per_rad", 2e-5)],
        ),
        effect(LoadFriction, &[("motor_share_ratio", 0.06), ("load_share_ratio", 0.1)]),
        effect(Presliding, &[("presliding_rad", 0.02)]),
        effect(WornRegion, &[("worn_n_m", 0.01), ("centre_rad", 0.01), ("width_rad", 0.01)]),
        effect(FrictionDrift, &[("friction_drop_ratio", 0.3), ("time_constant_s", 0.5)]),
        effect(Compliance, &[("compliance_rad_per_n_m", 1e-5), ("damping_n_m_s_per_rad", 100.0)]),
        effect(TransmissionError, &[("error_sin_rad", 2e-5), ("error_cos_rad", 1e-5)]),
        effect(
            Imbalance,
            &[
                ("imbalance_sin_n_m", 0.02),
                ("imbalance_cos_n_m", 3e-3),
                ("spring_n_m_per_rad", 0.1),
            ],
        ),
        effect(Cogging, &[("cogging_sin_n_m", 8e-3), ("cogging_cos_n_m", -3e-3)]),
        effect(CurrentRipple, &[("ripple_sin_ratio", 0.05), ("ripple_cos_ratio", 0.02)]),
        effect(Saturation, &[("saturation_per_a2", 1e-2)]),
        effect(MagnetLoss, &[("torque_constant_loss_ratio", 0.05)]),
        effect(ResistanceDrift, &[("resistance_rise_per_k", 0.0039)]),
        effect(InductanceEddy, &[("eddy_n_m_s_per_rad", 2e-5), ("inductance_henry", 7.2e-4)]),
        effect(DeadTime, &[("dead_time_v", 1.0)]),
        effect(BusSag, &[("source_resistance_ohm", 0.2)]),
        effect(CurrentSensor, &[("gain_error_ratio", 0.02), ("offset_a", 0.1)]),
        effect(PositionSensor, &[("lag_s", 5e-4), ("eccentricity_sin_rad", 5e-5)]),
        effect(ControllerMismatch, &[("speed_gain_error_ratio", 0.1), ("delay_s", 5e-4)]),
        effect(Vibration, &[("vibration_sin_n_m", 5e-3), ("frequency_hz", 40.0)]),
        effect(BackEmfShape, &[("flat_loss_rad", 0.17), ("fifth_harmonic_ratio", 0.03)]),
        effect(CommutationOverlap, &[("commutation_dip_ratio", 0.3)]),
        effect(HallOffset, &[("hall_offset_rad", 0.08)]),
        Effect::tabulated(curve.expect("valid"), Geometry::Rotary),
    ]
}

#[test]
fn law_an_effect_without_size_changes_nothing() {
    let base = LowFidelity::new(&EMA_48, &Scenario::chirp()).unwrap().simulate(&healthy());
    for id in EffectId::ALL {
        let effects = [Effect::new(id, Geometry::Rotary)];
        assert_eq!(run(&EMA_48, &Scenario::chirp(), &effects), base, "{id:?}");
    }
}

/// Share of rms by which two signals differ.
pub(super) fn difference(a: &[f64], b: &[f64]) -> f64 {
    let square = |x: f64| x * x;
    let apart: f64 = a.iter().zip(b).map(|(a, b)| square(a - b)).sum();
    (apart / b.iter().copied().map(square).sum::<f64>()).sqrt()
}

/// What shows in low fidelity where the voltage is used up alone.
pub(super) const LIMITS_ONLY: [EffectId; 3] =
    [EffectId::ResistanceDrift, EffectId::DeadTime, EffectId::BusSag];

#[test]
fn every_example_changes_something_and_stays_finite() {
    let base = run(&EMA_48, &scenario(), &[]);
    for effect in examples() {
        let id = effect.id();
        let trace = run(&EMA_48, &scenario(), &[effect]);
        assert!(trace.current_a.iter().all(|i| i.is_finite()), "{id:?}");
        let apart = difference(&trace.current_a, &base.current_a);
        assert_eq!(apart < 1e-12, LIMITS_ONLY.contains(&id), "{id:?}: {apart:e}");
        assert!(apart < 0.5, "{id:?}: {apart}");
    }
}

/// What a vanishing size leaves: the path with effects agrees with the one without.
#[test]
fn order_a_vanishing_size_leads_back_to_the_base_model() {
    let base = run(&EMA_48, &scenario(), &[]);
    for mut effect in examples() {
        let id = effect.id();
        if id == EffectId::Presliding || id == EffectId::Compliance {
            continue;
        }
        for parameter in id.info().parameters {
            let key = parameter.key(Geometry::Rotary);
            if parameter.role() == Role::Amplitude {
                effect.set(key, 1e-5 * effect.get(key).unwrap()).unwrap();
            }
        }
        let apart = difference(&run(&EMA_48, &scenario(), &[effect]).current_a, &base.current_a);
        assert!(apart < 3e-5, "{id:?}: {apart:e}");
    }
}

/// The smallest presliding and compliance are bounded by the swing that the steps must follow:
/// three sizes lead towards the base model. Its stiction lets go at once where bristles need a
/// speed; in a backlash its shaft carries the surface's inertia along, and this inertia passes
/// the gear without losses: both are left out here.
#[test]
fn order_stiff_bristles_and_shafts_come_near_the_base_model() {
    let mut actuator = EMA_48;
    actuator.transmission.backlash_rad = 0.0;
    actuator.transmission.efficiency_ratio = 1.0;
    let base = run(&actuator, &scenario(), &[]);
    let apart =
        |effect| difference(&run(&actuator, &scenario(), &[effect]).current_a, &base.current_a);
    let bristles = [0.02, 2e-3, 2e-4].map(|rad| {
        let numbers = [("presliding_rad", rad), ("stribeck_speed_rad_per_s", 50.0 * rad)];
        apart(effect(EffectId::Presliding, &numbers))
    });
    let shafts = [1e-5, 1e-6, 1e-7].map(|compliance| {
        let numbers = [("compliance_rad_per_n_m", compliance), ("damping_n_m_s_per_rad", 300.0)];
        apart(effect(EffectId::Compliance, &numbers))
    });
    for sizes in [bristles, shafts] {
        assert!(sizes[1] < 0.7 * sizes[0] && sizes[2] < 0.7 * sizes[1], "{sizes:?}");
    }
}

/// A tick of a run: state in its middle, current held in it.
struct Tick {
    n: usize,
    time_s: f64,
    motor_rad: f64,
    surface_rad: f64,
    speed: f64,
    current_a: f64,
    /// Torque of the motor with the plain torque constant.
    motor_n_m: f64,
    /// Load at the motor shaft.
    load_n_m: f64,
}

const K: f64 = 0.0752;

/// A run with one effect, tick by tick, with the torque against positive motion that it shows
/// besides what the base model knows. Ticks next to a standstill are left out.
fn missing_torque(scenario: &Scenario, effect: &Effect) -> (LowFidelityTrace, Vec<(Tick, f64)>) {
    let mut actuator = EMA_48;
    actuator.transmission.backlash_rad = 0.0;
    let trace = run(&actuator, scenario, core::slice::from_ref(effect));
    let (j, t) = (actuator.total_inertia_kg_m2(), &actuator.transmission);
    let tick_s = 1e-4;
    let mut ticks = Vec::new();
    for n in 2..trace.current_a.len() - 1 {
        let w = [n - 2, n - 1, n, n + 1].map(|n| trace.motor_speed_rad_per_s[n]);
        if w.iter().any(|x| x.abs() < 0.5 || x * w[0] < 0.0) {
            continue;
        }
        let mean = |c: &[f64]| 0.5 * (c[n - 1] + c[n]);
        let speed = mean(&trace.motor_speed_rad_per_s);
        let load = scenario.load_n_m / t.gear_ratio;
        let tick = Tick {
            n,
            time_s: (n as f64 - 0.5) * tick_s,
            motor_rad: mean(&trace.motor_angle_rad),
            surface_rad: (mean(&trace.motor_angle_rad) - scenario.start_angle_rad) / t.gear_ratio,
            speed,
            current_a: trace.current_a[n],
            motor_n_m: K * trace.current_a[n],
            load_n_m: load,
        };
        let felt = load * if speed > 0.0 { 1.0 / t.efficiency_ratio } else { t.efficiency_ratio };
        let known = tick.motor_n_m
            - t.kinetic_friction_n_m.copysign(speed)
            - actuator.motor.viscous_n_m_s_per_rad * speed
            - felt;
        ticks.push((tick, known - j * (w[2] - w[1]) / tick_s));
    }
    assert!(ticks.len() > 5000, "{}", ticks.len());
    (trace, ticks)
}

/// What an average over a tick leaves of a torque's curvature, and what the midpoint rule adds.
const FINGERPRINT_REL: f64 = 2e-3;

fn fingerprint(effect: &Effect, equation: impl Fn(&Tick) -> f64) {
    let (_, ticks) = missing_torque(&scenario(), effect);
    agree(effect, &ticks, |tick| Some(equation(tick)));
}

fn agree(effect: &Effect, ticks: &[(Tick, f64)], equation: impl Fn(&Tick) -> Option<f64>) {
    let (shown, wanted): (Vec<f64>, Vec<f64>) =
        ticks.iter().filter_map(|(tick, shown)| Some((*shown, equation(tick)?))).unzip();
    assert!(shown.len() > 4000, "{}", shown.len());
    let apart = difference(&shown, &wanted);
    assert!(apart < FINGERPRINT_REL, "{:?}: {apart:e}", effect.id());
}

/// Slow enough for a tick to resolve the 24th order of the motor angle: 0.08 rad of it.
fn slow() -> Scenario {
    let command = Command::Sine { amplitude_rad: 0.02, frequency_hz: 0.5 };
    Scenario { command, load_n_m: 0.0, ..scenario() }
}

pub(super) fn example(id: EffectId) -> Effect {
    examples().into_iter().find(|effect| effect.id() == id).expect("one of each")
}

#[test]
fn law_friction_effects_follow_their_equations() {
    use EffectId::*;
    fingerprint(&example(Stribeck), |t| 0.01 * t.speed.signum() * exp(-t.speed.abs() / 5.0));
    fingerprint(&example(NonlinearViscous), |t| {
        0.005 * t.speed.signum() * pow(t.speed / 100.0, 2.0)
    });
    fingerprint(&example(DirectionalFriction), |t| 3e-3 + 2e-5 * t.speed.abs());
    fingerprint(&example(LoadFriction), |t| {
        t.speed.signum() * (0.06 * t.motor_n_m - 0.1 * t.load_n_m).abs()
    });
    fingerprint(&example(WornRegion), |t| {
        0.01 * t.speed.signum() * exp(-0.5 * pow((t.surface_rad - 0.01) / 0.01, 2.0))
    });
    fingerprint(&example(FrictionDrift), |t| {
        -0.030 * t.speed.signum() * 0.3 * (1.0 - exp(-t.time_s / 0.5))
    });
}

#[test]
fn law_torques_of_position_angle_and_time_follow_their_equations() {
    use EffectId::*;
    fingerprint(&example(TransmissionError), |t| {
        // the work of 2 N·m on the error of the surface's angle
        2.0 * (2e-5 * cos(t.motor_rad) - 1e-5 * sin(t.motor_rad))
    });
    fingerprint(&example(Imbalance), |t| {
        0.02 * sin(t.surface_rad) + 3e-3 * cos(t.surface_rad) + 0.1 * t.surface_rad
    });
    // slow enough for a tick to resolve the order 24 at most speeds: 0.36 rad at 150 rad/s
    fingerprint(&effect(Cogging, &[("cogging_sin_n_m", 8e-3), ("order", 4.0)]), |t| {
        8e-3 * sin(4.0 * t.motor_rad)
    });
    fingerprint(&example(Vibration), |t| 5e-3 * sin(TAU * 40.0 * t.time_s));
}

#[test]
fn law_motor_effects_follow_their_equations() {
    use EffectId::*;
    fingerprint(&effect(CurrentRipple, &[("ripple_cos_ratio", 0.05), ("order", 4.0)]), |t| {
        -0.05 * cos(4.0 * t.motor_rad) * t.motor_n_m
    });
    fingerprint(&example(Saturation), |t| 1e-2 * t.current_a * t.current_a * t.motor_n_m);
    fingerprint(&example(MagnetLoss), |t| 0.05 * t.motor_n_m);
    fingerprint(&effect(InductanceEddy, &[("eddy_n_m_s_per_rad", 2e-5)]), |t| 2e-5 * t.speed);
}

/// A trapezoid with unit peak, flat but for 30° + `flank` about its zeros.
fn trapezoid(x: f64, flank_rad: f64) -> f64 {
    let y = (x + 0.5 * PI).rem_euclid(TAU) - 0.5 * PI;
    let z = if y > 0.5 * PI { PI - y } else { y };
    (z / (PI / 6.0 + flank_rad)).clamp(-1.0, 1.0)
}

/// Electrical angle within its sector from the begin of a flat top, 0 to 60°, and the phases
/// that conduct, for a commutation that is early by an angle.
fn sector(motor_rad: f64, early_rad: f64) -> (f64, f64, f64) {
    let electrical = 4.0 * motor_rad;
    let number = ((electrical + early_rad - PI / 6.0) / (PI / 3.0)).floor();
    let place = (electrical + early_rad - PI / 6.0) - number * PI / 3.0;
    // sector 0 is A+ B−, and every second step moves on the phase of the one sign
    let positive = (number.rem_euclid(6.0) / 2.0).floor();
    let negative = (0.5 * number.rem_euclid(6.0) + 1.5).floor().rem_euclid(3.0);
    (place, electrical - TAU / 3.0 * positive, electrical - TAU / 3.0 * negative)
}

#[test]
fn law_back_emf_and_commutation_effects_follow_their_equations() {
    // ticks in which the pair changes are left out
    let whole = |place: f64| (0.02..PI / 3.0 - 0.02).contains(&place);
    let shape = example(EffectId::BackEmfShape);
    let (_, ticks) = missing_torque(&slow(), &shape);
    agree(&shape, &ticks, |t| {
        let (place, plus, minus) = sector(t.motor_rad, 0.0);
        let wave = |x: f64| trapezoid(x, 0.17) + 0.03 * sin(5.0 * x);
        let near_kink = (place - 0.17).abs() < 0.02 || (place - PI / 3.0 + 0.17).abs() < 0.02;
        (whole(place) && !near_kink).then(|| t.motor_n_m * (1.0 - 0.5 * (wave(plus) - wave(minus))))
    });
    let offset = example(EffectId::HallOffset);
    let (_, ticks) = missing_torque(&slow(), &offset);
    agree(&offset, &ticks, |t| {
        let (place, plus, minus) = sector(t.motor_rad, 0.08);
        let near_kink = (place - 0.08).abs() < 0.02;
        let ratio = 0.5 * (trapezoid(plus, 0.0) - trapezoid(minus, 0.0));
        (whole(place) && !near_kink).then_some(t.motor_n_m * (1.0 - ratio))
    });
    let overlap = example(EffectId::CommutationOverlap);
    let (trace, ticks) = missing_torque(&slow(), &overlap);
    let since_s = since_commutation(&trace);
    agree(&overlap, &ticks, |t| {
        let (place, ..) = sector(t.motor_rad, 0.0);
        let since_s = since_s[t.n]?;
        // the mean of the decay over the tick
        let whole_tick = 3.4e-4 / 1e-4 * (exp(1e-4 / 3.4e-4) - 1.0);
        whole(place).then(|| t.motor_n_m * 0.3 * exp(-since_s / 3.4e-4) * whole_tick)
    });
}

/// Time since the last commutation at each sample, by straight lines between samples.
fn since_commutation(trace: &LowFidelityTrace) -> Vec<Option<f64>> {
    let (mut last, mut times) = (None, vec![None]);
    for n in 1..trace.motor_angle_rad.len() {
        let [a, b] = [n - 1, n].map(|n| (4.0 * trace.motor_angle_rad[n] - PI / 6.0) / (PI / 3.0));
        if a.floor() != b.floor() {
            let edge = a.max(b).floor();
            last = Some((n as f64 - 1.0 + (edge - a) / (b - a)) * 1e-4);
        }
        times.push(last.map(|at| n as f64 * 1e-4 - at));
    }
    times
}

#[test]
fn law_bristles_follow_lugre() {
    let effect = example(EffectId::Presliding);
    let (trace, ticks) = missing_torque(&slow(), &effect);
    // σ0 = F_d/z_0; small steps of z' = ω − |ω|·σ0·z/g(ω)
    let stiffness = 0.030 / 0.02;
    let mut deflection = 0.0;
    let mut middles = vec![0.0];
    for pair in trace.motor_speed_rad_per_s.windows(2) {
        let mut middle = 0.0;
        for step in 0..40 {
            let w = pair[0] + (pair[1] - pair[0]) * (f64::from(step) + 0.5) / 40.0;
            let g = 0.030 + 0.015 * exp(-w * w);
            deflection += (w - w.abs() * stiffness * deflection / g) * 1e-4 / 40.0;
            middle += stiffness * deflection / 40.0;
        }
        middles.push(middle);
    }
    // near standstill g changes with the speed within a tick
    agree(&effect, &ticks, |t| Some(middles[t.n] - 0.030f64.copysign(t.speed)));
}

#[test]
fn law_an_elastic_shaft_drives_the_surface() {
    let effect = effect(
        EffectId::Compliance,
        &[("compliance_rad_per_n_m", 1e-5), ("damping_n_m_s_per_rad", 300.0)],
    );
    let mut actuator = EMA_48;
    actuator.transmission.backlash_rad = 0.0;
    let trace = run(&actuator, &scenario(), &[effect]);
    let (surface, motor) = (&trace.surface_angle_rad, &trace.motor_angle_rad);
    let (mut shown, mut wanted) = (Vec::new(), Vec::new());
    for n in 100..surface.len() - 1 {
        let slope = |x: &[f64]| (x[n + 1] - x[n - 1]) / 2e-4;
        let bend = (surface[n + 1] - 2.0 * surface[n] + surface[n - 1]) / 1e-8;
        shown.push(0.2 * bend + 2.0);
        let twist = (motor[n] - 0.3) / 500.0 - surface[n];
        wanted.push(1e5 * twist + 300.0 * (slope(motor) / 500.0 - slope(surface)));
    }
    let apart = difference(&shown, &wanted);
    // differences over ticks of 0.07 rad of the shaft's swing: 0.07²/12
    assert!(apart < 2e-3, "{apart:e}");
}

/// A step so large that the supply is all used: the current is what the circuit leaves.
#[test]
fn law_electrical_effects_limit_the_current() {
    let mut actuator = EMA_48;
    actuator.controller.current_limit_a = 60.0;
    actuator.controller.speed_limit_rad_per_s = 1e4;
    let command = Command::Recorded { values_rad: vec![0.3], rate_hz: 1.0 };
    let scenario = Scenario { command, duration_s: 0.1, load_n_m: 0.0, ..Scenario::chirp() };
    let (v, r) = (48.0, 2.13);
    // current against the speed at the start of the tick, where the voltage limits it
    let check = |effect: Effect, wanted: &dyn Fn(f64, f64, usize) -> f64, most: f64| {
        let trace = run(&actuator, &scenario, &[effect]);
        for n in 3..60 {
            let (i, before) = (trace.current_a[n], trace.current_a[n - 1]);
            let speed = 0.5 * (trace.motor_speed_rad_per_s[n - 1] + trace.motor_speed_rad_per_s[n]);
            let want = wanted(K * speed, before, n);
            assert_abs_diff_eq!(i, want, epsilon = most);
        }
    };
    let base = effect(EffectId::BusSag, &[("source_resistance_ohm", 1e-9)]);
    // the emf rises by about 0.4 V a tick: half of it over R in between
    check(base, &|emf, _, _| (v - emf) / r, 0.15);
    let dead = effect(EffectId::DeadTime, &[("dead_time_v", 3.0)]);
    check(dead, &|emf, _, _| (v - 3.0 - emf) / r, 0.15);
    let sag = effect(EffectId::BusSag, &[("source_resistance_ohm", 0.5)]);
    check(sag, &|emf, _, _| (v - emf) / (r + 0.5), 0.15);
    let coil = effect(EffectId::InductanceEddy, &[("inductance_henry", 3e-3)]);
    // L·I' = V − e − R·I, exactly over a tick
    check(
        coil,
        &|emf, i, _| {
            let end = (v - emf) / r;
            end + (i - end) * exp(-1e-4 * r / 3e-3)
        },
        0.15,
    );
    let warm = effect(
        EffectId::ResistanceDrift,
        &[
            ("resistance_rise_per_k", 0.0039),
            ("thermal_resistance_k_per_w", 10.0),
            ("thermal_time_constant_s", 1.0),
        ],
    );
    // 1 kW for 6 ms on 10 K/W and 1 s: 60 K, a quarter of the resistance
    let trace = run(&actuator, &scenario, core::slice::from_ref(&warm));
    let mut kelvin = 0.0;
    for n in 1..60 {
        let i = trace.current_a[n];
        let speed = 0.5 * (trace.motor_speed_rad_per_s[n - 1] + trace.motor_speed_rad_per_s[n]);
        let hot = r * (1.0 + 0.0039 * kelvin);
        if n > 2 {
            assert_abs_diff_eq!(i, (v - K * speed) / hot, epsilon = WARMING_A);
        }
        kelvin += (10.0 * r * i * i - kelvin) * 1e-4;
    }
    assert!(kelvin > 20.0, "{kelvin}");
}

#[test]
fn law_sensor_effects_show_what_they_say() {
    let base = run(&EMA_48, &scenario(), &[]);
    let current = effect(
        EffectId::CurrentSensor,
        &[("gain_error_ratio", 0.02), ("offset_a", 0.1), ("lag_s", 1e-3)],
    );
    let trace = run(&EMA_48, &scenario(), &[current]);
    // shown only: the machine moves as before
    assert_eq!(trace.motor_angle_rad, base.motor_angle_rad);
    let mut lagged = 0.1;
    for (shown, true_a) in trace.current_a.iter().zip(&base.current_a).skip(1) {
        lagged += (1.02 * true_a + 0.1 - lagged) * (1.0 - exp(-0.1));
        assert_abs_diff_eq!(*shown, lagged, epsilon = LAG_A);
    }
    let in_loop = effect(EffectId::CurrentSensor, &[("gain_error_ratio", 0.02), ("in_loop", 1.0)]);
    let scaled = run(&EMA_48, &scenario(), &[in_loop]);
    assert_ne!(scaled.motor_angle_rad, base.motor_angle_rad);
    let position = effect(
        EffectId::PositionSensor,
        &[("eccentricity_sin_rad", 5e-5), ("eccentricity_cos_rad", 2e-5), ("step_rad", 1e-6)],
    );
    let mut actuator = EMA_48;
    actuator.transmission.backlash_rad = 0.0;
    let trace = run(&actuator, &scenario(), &[position]);
    for (shown, motor_rad) in trace.surface_angle_rad.iter().zip(&trace.motor_angle_rad) {
        let true_rad = (motor_rad - 0.3) / 500.0;
        let seen = true_rad + 5e-5 * sin(*motor_rad) + 2e-5 * cos(*motor_rad);
        assert_abs_diff_eq!(*shown, seen, epsilon = HALF_STEP_RAD);
        assert_abs_diff_eq!(shown / 1e-6, (shown / 1e-6).round(), epsilon = WHOLE_STEPS);
    }
}

#[test]
fn law_a_delay_shifts_the_set_point() {
    // with a very slow position loop the set-point hardly depends on when it acts
    let mut actuator = EMA_48;
    actuator.controller.position_gain_per_s = 1e-3;
    actuator.transmission.static_friction_n_m = 100.0;
    let command = Command::Sine { amplitude_rad: 0.3, frequency_hz: 5.0 };
    let scenario = Scenario { command, duration_s: 0.2, ..Scenario::chirp() };
    let base = run(&actuator, &scenario, &[]);
    let delay = effect(EffectId::ControllerMismatch, &[("delay_s", 3e-4)]);
    let delayed = run(&actuator, &scenario, &[delay]);
    assert_eq!(delayed.current_a[4..], base.current_a[1..base.current_a.len() - 3]);
    let gains = effect(EffectId::ControllerMismatch, &[("speed_gain_error_ratio", 0.5)]);
    actuator.controller.speed_gain_a_s_per_rad *= 1.5;
    let (with, without) = (run(&actuator, &scenario, &[]), run(&EMA_48, &scenario, &[]));
    assert_ne!(with, without);
    actuator.controller.speed_gain_a_s_per_rad /= 1.5;
    let same = run(&actuator, &scenario, &[gains]);
    assert!(difference(&same.current_a, &with.current_a) < 1e-12);
}

/// Torques held over segments at their predicted middle: halving the segments.
#[test]
fn order_effects_converge() {
    let at = |effect: &Effect, ratio: f64| {
        let model = LowFidelity::new(&EMA_48, &scenario())
            .and_then(|model| model.with_effects(core::slice::from_ref(effect)))
            .unwrap()
            .with_finer_segments(ratio);
        model.simulate(&healthy()).current_a
    };
    for effect in examples() {
        let fine = at(&effect, 1.0 / 16.0);
        let error = difference(&at(&effect, 1.0), &fine);
        let smooth = [EffectId::Cogging, EffectId::Vibration, EffectId::CurrentRipple];
        if smooth.contains(&effect.id()) {
            let quarter = difference(&at(&effect, 0.25), &fine);
            assert!(quarter < error / 8.0, "{:?}: {error:e} {quarter:e}", effect.id());
        }
        assert!(error < 1e-3, "{:?}: {error:e}", effect.id());
    }
}

#[test]
fn a_load_that_changes_is_felt() {
    let scenario = Scenario { load_n_m: 0.0, ..scenario() };
    let model = LowFidelity::new(&EMA_48, &scenario).unwrap();
    let recorded = |values_n_m| Load::Recorded { values_n_m, rate_hz: 10.0 };
    let constant = LowFidelity::new(&EMA_48, &Scenario { load_n_m: 20.0, ..scenario.clone() });
    let held = model.clone().with_load(recorded(vec![20.0])).unwrap().simulate(&healthy());
    assert_eq!(held.current_a, constant.unwrap().simulate(&healthy()).current_a);
    let none = model.clone().with_load(Load::None).unwrap().simulate(&healthy());
    assert_eq!(none, model.simulate(&healthy()));
    let air = model.clone().with_load(Load::Aerodynamic(HingeMoment::F16)).unwrap();
    assert!(difference(&air.simulate(&healthy()).current_a, &none.current_a) > 1e-4);
    let error = model.with_load(recorded(vec![f64::NAN])).unwrap_err().to_string();
    assert!(error.starts_with("`load.values-n-m` is NaN"), "{error}");
}

#[test]
fn effects_of_another_machine_are_refused() {
    let model = LowFidelity::new(&EMA_48, &scenario()).unwrap();
    let linear = Effect::new(EffectId::Cogging, Geometry::Linear);
    let error = model.clone().with_effects(&[linear]).unwrap_err().to_string();
    assert_eq!(error, "effect E11 is in the units of a Linear machine");
    let twice = [example(EffectId::Presliding), example(EffectId::Presliding)];
    let error = model.with_effects(&twice).unwrap_err().to_string();
    assert_eq!(error, "effect E05 acts in a model once only");
}
