//! Shorted turns in which a current circulates.

use ema_sim::{
    Actuator, BackEmfShape, CurrentControl, EffectError, EffectId, EnergyLedger, HealthState,
    HighFidelity, HighFidelityTrace, ParameterError, PhysicalFaults, Scenario, ShortedTurns,
    SimulationError,
    presets::{BENCH, EMA_48},
};

use super::effects::examples;

/// Energy that segments of the collocation may lose, over the energy dissipated.
const BALANCE_REL: f64 = 1e-5;

fn shorted(actuator: &Actuator, resistance_ohm: f64) -> Actuator {
    closed(actuator, resistance_ohm, ShortedTurns::DEFAULT_LEAKAGE_RATIO)
}

fn closed(actuator: &Actuator, resistance_ohm: f64, leakage_ratio: f64) -> Actuator {
    let mut actuator = *actuator;
    actuator.motor.shorted_turns =
        ShortedTurns::closed_over(resistance_ohm).with_leakage_ratio(leakage_ratio);
    actuator
}

fn shares(turns: [f64; 3]) -> PhysicalFaults {
    let [a, b, c] = turns;
    (&HealthState::new([0.0, 0.0, a, b, c, 0.0, 0.5]).expect("on the scale")).into()
}

fn short_chirp() -> Scenario {
    Scenario { duration_s: 0.1, ..Scenario::chirp() }
}

fn run(actuator: &Actuator, scenario: &Scenario, faults: &PhysicalFaults) -> HighFidelityTrace {
    HighFidelity::new(actuator, scenario).expect("valid").simulate(faults)
}

/// Root mean square of the difference of the phases over that of the second.
fn gap(one: &HighFidelityTrace, other: &HighFidelityTrace) -> f64 {
    let (mut gap, mut size) = (0.0, 0.0);
    for (a, b) in one.phase_currents_a.iter().zip(&other.phase_currents_a) {
        gap += a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
        size += b.iter().map(|b| b * b).sum::<f64>();
    }
    (gap / size).sqrt()
}

#[test]
fn a_machine_without_shorted_turns_is_the_same_to_the_bit() {
    let healthy = shares([0.0; 3]);
    for preset in [EMA_48, BENCH] {
        let plain = run(&preset, &short_chirp(), &healthy);
        assert_eq!(plain, run(&shorted(&preset, 0.0), &short_chirp(), &healthy));
    }
    // an anti-test: with shorted turns it is another machine
    let damaged = shares([0.05, 0.0, 0.0]);
    let removed = run(&EMA_48, &short_chirp(), &damaged);
    assert!(gap(&run(&shorted(&EMA_48, 0.05), &short_chirp(), &damaged), &removed) > 1e-3);
}

#[test]
fn law_a_fault_of_large_resistance_leaves_the_healthy_machine() {
    /// The circulating current falls as `1/R_f` beyond the turns' own impedance, at the carrier some
    /// 9 Ω: of a hundred ohms, to its square, 1 %.
    const TENTH: f64 = 0.01;
    let scenario = Scenario { duration_s: 0.05, ..Scenario::chirp() };
    let healthy = run(&EMA_48, &scenario, &shares([0.0; 3]));
    let away = |resistance_ohm| {
        let damaged = shares([0.2, 0.0, 0.1]);
        gap(&run(&shorted(&EMA_48, resistance_ohm), &scenario, &damaged), &healthy)
    };
    let (at_100, at_1000, at_1e6) = (away(100.0), away(1000.0), away(1e6));
    assert!((at_1000 / at_100 - 0.1).abs() < TENTH, "{at_100} {at_1000}");
    // the difference of two ways to cut segments is left
    assert!(at_1e6 < 2e-5, "{at_1e6}");
}

/// The circuit coil by coil: in each phase a healthy and a shorted coil in series, all six on one
/// main flux a phase, which the other phases see by half, each with leakage of its own; terminals
/// joined. Written without the coordinates of the model, for fixed steps of Runge and Kutta.
struct Coils {
    share: [f64; 3],
    fault_ohm: f64,
    ohm: f64,
    main_henry: f64,
    leakage_henry: f64,
    peak: f64,
    pole_pairs: f64,
    inertia: f64,
    viscous: f64,
}

/// Currents of the healthy and the shorted coils, speed, angle.
type State = [f64; 8];

impl Coils {
    fn rates(&self, state: &State) -> State {
        let (speed, angle) = (state[6], state[7]);
        let k: [f64; 3] = core::array::from_fn(|j| {
            let shift = core::f64::consts::TAU / 3.0 * j as f64;
            self.peak * (self.pole_pairs * angle - shift).sin()
        });
        // unknown: rates of the six currents, and the star point's potential
        let mut rows = [[0.0; 8]; 7];
        for j in 0..3 {
            let s = self.share[j];
            let (healthy, shorted) = (state[j], state[3 + j]);
            for other in 0..3 {
                let linked = if other == j { 1.0 } else { -0.5 } * self.main_henry;
                let part = [1.0 - self.share[other], self.share[other]];
                for (coil, part) in part.into_iter().enumerate() {
                    rows[j][3 * coil + other] += (1.0 - s) * linked * part;
                    rows[3 + j][3 * coil + other] += s * linked * part;
                }
            }
            rows[j][j] += (1.0 - s) * self.leakage_henry;
            rows[3 + j][3 + j] += s * self.leakage_henry;
            let over_fault = self.fault_ohm * (healthy - shorted);
            rows[j][6] = 1.0;
            rows[j][7] = -((1.0 - s) * (self.ohm * healthy + k[j] * speed) + over_fault);
            rows[3 + j][7] = over_fault - s * (self.ohm * shorted + k[j] * speed);
            rows[6][j] = 1.0;
        }
        for column in 0..7 {
            let below = |&row: &usize| (rows[row][column].abs() * 1e6) as u64;
            let pivot = (column..7).max_by_key(below).expect("not empty");
            rows.swap(column, pivot);
            for row in 0..7 {
                if row != column {
                    let factor = rows[row][column] / rows[column][column];
                    for entry in column..8 {
                        rows[row][entry] -= factor * rows[column][entry];
                    }
                }
            }
        }
        let mut rates = [0.0; 8];
        for (place, row) in rows.iter().enumerate().take(6) {
            rates[place] = row[7] / row[place];
        }
        let torque: f64 = (0..3)
            .map(|j| k[j] * ((1.0 - self.share[j]) * state[j] + self.share[j] * state[3 + j]))
            .sum();
        rates[6] = (torque - self.viscous * speed) / self.inertia;
        rates[7] = speed;
        rates
    }

    fn step(&self, state: &State, span_s: f64) -> State {
        let moved = |rates: &State, by: f64| core::array::from_fn(|n| state[n] + by * rates[n]);
        let one = self.rates(state);
        let two = self.rates(&moved(&one, 0.5 * span_s));
        let three = self.rates(&moved(&two, 0.5 * span_s));
        let four = self.rates(&moved(&three, span_s));
        core::array::from_fn(|n| {
            state[n] + span_s / 6.0 * (one[n] + 2.0 * (two[n] + three[n]) + four[n])
        })
    }
}

#[test]
fn law_a_braked_rotor_is_that_of_all_coils_one_by_one() {
    /// Largest difference, of currents of ten amperes and a speed of a hundred: rounding of pivots, and the
    /// collocation in segments of 12 µs.
    const APART: f64 = 2e-6;
    let mut actuator = closed(&BENCH, 0.05, 0.3);
    let t = &mut actuator.transmission;
    (t.kinetic_friction_n_m, t.static_friction_n_m, t.surface_friction_n_m) = (0.0, 0.0, 0.0);
    t.surface_inertia_kg_m2 = 0.0;
    t.stop_rad = 10.0;
    let mut scenario = Scenario { load_n_m: 0.0, ..Scenario::sine() };
    scenario.initial.motor_speed_rad_per_s = 100.0;
    let share = [0.1, 0.05, 0.2];
    let model = HighFidelity::new(&actuator, &scenario).unwrap();
    let trace = model.simulate_duties(&shares(share), &[[0.5; 3]; 200]).unwrap();
    let motor = &actuator.motor;
    let coils = Coils {
        share,
        fault_ohm: 0.05,
        ohm: motor.resistance_ohm,
        main_henry: 0.7 * motor.inductance_henry / 1.5,
        leakage_henry: 0.3 * motor.inductance_henry,
        peak: motor.back_emf_v_s_per_rad,
        pole_pairs: f64::from(motor.pole_pairs),
        inertia: motor.inertia_kg_m2,
        viscous: motor.viscous_n_m_s_per_rad,
    };
    let mut state = [0.0; 8];
    (state[6], state[7]) = (100.0, scenario.start_angle_rad);
    for tick in 1..trace.motor_speed_rad_per_s.len() {
        for _ in 0..100 {
            state = coils.step(&state, 1e-6);
        }
        let off = trace.motor_speed_rad_per_s[tick] - state[6];
        assert!(off.abs() < APART * 100.0, "{tick}: {off:e}");
        for (phase, currents_a) in trace.phase_currents_a.iter().enumerate() {
            let off_a = currents_a[tick] - state[phase];
            assert!(off_a.abs() < APART * 10.0, "{tick} {phase}: {off_a:e}");
        }
    }
    assert!(state[6] < 70.0, "braked: {}", state[6]);
}

/// A locked rotor under the whole supply, phase A conducting with B.
fn locked(actuator: &Actuator) -> (Actuator, Scenario) {
    let mut actuator = *actuator;
    actuator.controller.current_limit_a = 1000.0;
    actuator.controller.speed_limit_rad_per_s = 1e5;
    actuator.controller.speed_gain_a_s_per_rad = 100.0;
    actuator.transmission.stop_rad = 10.0;
    actuator.transmission.static_friction_n_m = 1e3;
    let scenario = Scenario {
        command: ema_sim::Command::Recorded { values_rad: vec![1.0], rate_hz: 1.0 },
        load_n_m: 0.0,
        duration_s: 0.01,
        ..Scenario::chirp()
    };
    (actuator, scenario.turned_to(0.6 / 4.0))
}

/// Current of the pair at a time after a voltage is put on it: two coupled loops,
/// `M·z' = u − R·z`, by the roots of their characteristic polynomial.
fn two_loops_a(volts: f64, m: [f64; 3], r: [f64; 3], time_s: f64) -> f64 {
    // symmetric matrices as [pair, mutual, loop]
    let determinant_m = m[0] * m[2] - m[1] * m[1];
    let determinant_r = r[0] * r[2] - r[1] * r[1];
    let middle = m[0] * r[2] + m[2] * r[0] - 2.0 * m[1] * r[1];
    let root = (middle * middle - 4.0 * determinant_m * determinant_r).sqrt();
    let rates = [1.0, -1.0].map(|sign| (middle + sign * root) / (2.0 * determinant_m));
    let steady = volts * r[2] / determinant_r;
    let slope = volts * m[2] / determinant_m;
    // z = steady + c0·exp(−λ0·t) + c1·exp(−λ1·t), z(0) = 0, z'(0) = slope
    let c0 = (steady * rates[1] - slope) / (rates[0] - rates[1]);
    let c1 = -steady - c0;
    steady + c0 * (-rates[0] * time_s).exp() + c1 * (-rates[1] * time_s).exp()
}

#[test]
fn law_locked_rotor_current_rises_as_in_two_coupled_loops() {
    /// Error of the collocation over the 24 A of the steady current.
    const RISE_A: f64 = 2e-4;
    for (share, fault_ohm, leakage) in
        [(0.1, 0.0, 0.5), (0.1, 0.05, 0.3), (0.5, 0.2, 0.5), (0.01, 0.01, 0.5), (0.2, 20.0, 0.5)]
    {
        let (actuator, scenario) = locked(&closed(&EMA_48, fault_ohm, leakage));
        let trace = run(&actuator, &scenario, &shares([share, 0.0, 0.0]));
        let (ohm, henry) = (EMA_48.motor.resistance_ohm, EMA_48.motor.inductance_henry);
        let main = 2.0 / 3.0 * (1.0 - leakage) * share * share;
        let m = [2.0, -share, main + leakage * share].map(|x| x * henry);
        let r = [2.0 * ohm, -share * ohm, share * ohm + fault_ohm];
        for (tick, &current_a) in trace.phase_currents_a[0].iter().enumerate() {
            // the duty acts one carrier period after the sample
            let time_s = (tick as f64 * 1e-4 - 50e-6).max(0.0);
            let wanted_a = two_loops_a(48.0, m, r, time_s);
            let off_a = current_a - wanted_a;
            assert!(off_a.abs() < RISE_A, "{share} {fault_ohm} {tick}: {off_a:e}");
            assert_eq!(trace.phase_currents_a[1][tick], -current_a);
        }
        assert!(trace.motor_speed_rad_per_s.iter().all(|speed| *speed == 0.0));
    }
}

#[test]
fn law_a_bolted_short_at_standstill_ends_where_removed_turns_do() {
    /// Remainder of the start after 29 time constants, and of the collocation, A.
    const SETTLED_A: f64 = 1e-6;
    let damaged = shares([0.2, 0.0, 0.0]);
    let settled_a = |actuator: &Actuator| {
        let (actuator, scenario) = locked(actuator);
        *run(&actuator, &scenario, &damaged).phase_currents_a[0].last().expect("it has samples")
    };
    let (removed_a, bolted_a) = (settled_a(&EMA_48), settled_a(&shorted(&EMA_48, 0.0)));
    assert!((removed_a - bolted_a).abs() < SETTLED_A, "{removed_a} {bolted_a}");
    assert!((removed_a - 48.0 / (1.8 * EMA_48.motor.resistance_ohm)).abs() < SETTLED_A);
    // with a resistance another current is left
    assert!((removed_a - settled_a(&shorted(&EMA_48, 0.1))).abs() > 0.1);
}

#[test]
fn law_energy_is_balanced() {
    for (preset, tenth) in [(EMA_48, 0.0), (BENCH, 0.0), (EMA_48, 0.1)] {
        for fault_ohm in [0.0, 0.05, 1.0] {
            let scenario = short_chirp().with_real_electronics(3);
            let model = HighFidelity::new(&shorted(&preset, fault_ohm), &scenario).unwrap();
            let (_, energy) = model.simulate_with_ledger(&shares([0.1, tenth, 0.0]));
            let off = energy.residual_j() / energy.dissipated_j();
            assert!(off.abs() < BALANCE_REL, "{fault_ohm}: {off:e} {energy:?}");
            assert_eq!(energy.short_circuit_j > 0.0, fault_ohm > 0.0);
        }
    }
    let model = HighFidelity::new(&EMA_48, &short_chirp()).unwrap();
    let EnergyLedger { short_circuit_j, .. } = model.simulate_with_ledger(&shares([0.1; 3])).1;
    assert_eq!(short_circuit_j, 0.0);
}

#[test]
fn order_finer_segments_change_nothing_that_matters() {
    /// Difference over the root mean square of the phases; a thousandth of what the fault changes at 0.5 Ω.
    const CONVERGED_REL: f64 = 3e-5;
    let scenario = Scenario { duration_s: 0.02, ..Scenario::chirp() };
    for fault_ohm in [0.0, 0.02, 0.5, 5.0, 50.0] {
        let model = HighFidelity::new(&shorted(&EMA_48, fault_ohm), &scenario).unwrap();
        let damaged = shares([0.05, 0.0, 0.0]);
        let (fine, _) = model.simulate_finer(&damaged, 1.0 / 4.0);
        let off = gap(&model.simulate(&damaged), &fine);
        assert!(off < CONVERGED_REL, "{fault_ohm}: {off:e}");
    }
}

#[test]
fn every_drive_runs_with_shorted_turns_and_effects() {
    let scenario = Scenario { duration_s: 0.05, ..Scenario::chirp() };
    let damaged = shares([0.05, 0.02, 0.0]);
    let mut dead = BENCH;
    dead.inverter.dead_time_s = 1e-6;
    let mut six_step_dead = EMA_48;
    six_step_dead.inverter.dead_time_s = 1e-6;
    let mut sinusoidal = EMA_48;
    sinusoidal.motor.back_emf_shape = BackEmfShape::Sinusoid;
    for actuator in [EMA_48, BENCH, dead, six_step_dead, sinusoidal] {
        let model = HighFidelity::new(&shorted(&actuator, 0.05), &scenario).unwrap();
        let (trace, energy) = model.simulate_with_ledger(&damaged);
        assert!(trace.phase_currents_a.iter().flatten().all(|current_a| current_a.is_finite()));
        let off = energy.residual_j() / energy.dissipated_j();
        assert!(off.abs() < BALANCE_REL, "{off:e} {energy:?}");
    }
    let control = CurrentControl::Hysteresis { half_band_a: 0.15 };
    let model = HighFidelity::new(&shorted(&EMA_48, 0.05), &scenario).unwrap();
    let (_, energy) = model.with_current_control(control).unwrap().simulate_with_ledger(&damaged);
    assert!((energy.residual_j() / energy.dissipated_j()).abs() < BALANCE_REL, "{energy:?}");
    for effect in examples() {
        let id = effect.id();
        let model = HighFidelity::new(&shorted(&EMA_48, 0.05), &scenario).unwrap();
        match model.with_effects(&[effect]) {
            Ok(model) => {
                let (_, energy) = model.simulate_with_ledger(&damaged);
                let off = energy.residual_j() / energy.dissipated_j();
                assert!(off.abs() < BALANCE_REL, "{id:?}: {off:e} {energy:?}");
            }
            Err(SimulationError::Effect(EffectError::NotInModel { effect, reason, .. })) => {
                let own = id == EffectId::Compliance;
                assert_eq!((effect, own), (id, reason.contains("short-circuit")));
            }
            Err(other) => panic!("{id:?}: {other}"),
        }
    }
}

#[test]
fn numbers_that_no_fault_has_are_refused() {
    for (actuator, key) in [
        (closed(&EMA_48, -0.1, 0.5), "short-circuit.resistance-ohm"),
        (closed(&EMA_48, f64::NAN, 0.5), "short-circuit.resistance-ohm"),
        (closed(&EMA_48, 0.1, 0.0), "short-circuit.leakage-ratio"),
        (closed(&EMA_48, 0.1, 1.1), "short-circuit.leakage-ratio"),
    ] {
        let error = HighFidelity::new(&actuator, &short_chirp()).unwrap_err();
        let SimulationError::Parameter(ParameterError::OutOfBounds { field, .. }) = error else {
            panic!("{error}");
        };
        assert_eq!(field, key);
    }
}
