//! The high-fidelity model against the same physics in small fixed steps, written apart.
//!
//! Nothing is shared with the crate but parameters and equations (`docs/models`): phases by name,
//! back-EMF from its angle, the carrier as a triangle, the midpoint rule at a fraction of a
//! microsecond, every event rounded to a step. What the two agree on does not come from either's
//! method.

use core::f64::consts::{FRAC_PI_3, FRAC_PI_6, PI, TAU};

use ema_sim::{
    Actuator, Command, Effect, EffectId, Geometry, HealthState, HighFidelity, PhysicalFaults,
    Scenario, presets::EMA_48,
};

/// Phases that carry `+I` and `−I` in the six sectors.
const PAIRS: [(usize, usize); 6] = [(0, 1), (0, 2), (1, 2), (1, 0), (2, 0), (2, 1)];

/// Optional physics, off at zero.
#[derive(Clone, Copy, Default)]
struct Extra {
    saturation_per_a2: f64,
    rise_per_k: f64,
    kelvin_per_w: f64,
    thermal_s: f64,
    source_ohm: f64,
    flat_loss_rad: f64,
    fifth: f64,
    seventh: f64,
    hall_rad: f64,
    /// Gain error, offset and lag of the current that the loop sees.
    sensor: [f64; 3],
    /// Stiffness and damping of the shaft before the surface.
    shaft: Option<[f64; 2]>,
}

struct Machine {
    a: Actuator,
    extra: Extra,
    warm_k: f64,
    surface_speed: f64,
    /// What the sensor of the loop's current shows.
    seen_a: f64,
    f: PhysicalFaults,
    start_rad: f64,
    load_n_m: f64,
    i: [f64; 3],
    w: f64,
    theta: f64,
    surface: f64,
}

impl Machine {
    /// `k_j` of the phases at a motor angle from the start.
    fn coupling(&self, theta: f64) -> [f64; 3] {
        let motor = theta + self.start_rad;
        let gap =
            1.0 + self.f.eccentricity_cos * motor.cos() - self.f.eccentricity_sin * motor.sin();
        let electrical = motor * f64::from(self.a.motor.pole_pairs);
        [0, 1, 2].map(|j| {
            let angle = electrical - TAU / 3.0 * j as f64;
            let (x, flank) = (angle.rem_euclid(TAU), FRAC_PI_6 + self.extra.flat_loss_rad);
            let shape = match x {
                x if x < flank => x / flank,
                x if x < PI - flank => 1.0,
                x if x < PI + flank => (PI - x) / flank,
                x if x < TAU - flank => -1.0,
                x => (x - TAU) / flank,
            };
            let shape = shape
                + self.extra.fifth * (5.0 * angle).sin()
                + self.extra.seventh * (7.0 * angle).sin();
            self.a.motor.back_emf_v_s_per_rad * self.f.healthy_turns_frac[j] * shape * gap
        })
    }

    /// Electrical angle as the commutation takes it.
    fn commutated_rad(&self) -> f64 {
        (self.theta + self.start_rad) * f64::from(self.a.motor.pole_pairs) + self.extra.hall_rad
    }

    /// What currents leave of the torque constant.
    fn unsaturated(&self, i: &[f64; 3]) -> f64 {
        let square: f64 = 0.5 * i.iter().map(|i| i * i).sum::<f64>();
        (1.0 - self.extra.saturation_per_a2 * square).max(0.1)
    }

    fn sector(&self) -> usize {
        let electrical = self.commutated_rad();
        ((electrical - FRAC_PI_6) / FRAC_PI_3).floor().rem_euclid(6.0) as usize
    }

    /// Rates of the currents for the connected legs' potentials.
    fn current_rates(&self, i: &[f64; 3], w: f64, k: &[f64; 3], v: &[Option<f64>; 3]) -> [f64; 3] {
        let n = self.f.healthy_turns_frac;
        let ohm = self.ohm();
        let drive = |j: usize, leg: f64| leg - ohm * n[j] * i[j] - k[j] * w;
        let henry = |j: usize| self.a.motor.inductance_henry * n[j] * n[j];
        let (mut top, mut bottom) = (0.0, 0.0);
        for j in 0..3 {
            if let Some(leg) = v[j] {
                top += drive(j, leg) / henry(j);
                bottom += 1.0 / henry(j);
            }
        }
        [0, 1, 2].map(|j| v[j].map_or(0.0, |leg| (drive(j, leg) - top / bottom) / henry(j)))
    }

    /// The current that is held: of the phase whose flat top is centred nearest to the rotor.
    fn regulated_a(&self) -> f64 {
        let electrical = self.commutated_rad();
        let near = |j: usize| (electrical - TAU / 3.0 * j as f64).sin();
        let phase = (0..3).max_by(|&x, &y| near(x).abs().total_cmp(&near(y).abs()));
        let phase = phase.expect("three phases");
        near(phase).signum() * self.i[phase]
    }

    fn read_sensor(&mut self, period: f64) {
        let [gain, offset, lag] = self.extra.sensor;
        let there = (1.0 + gain) * self.regulated_a() + offset;
        let decay = if lag > 0.0 { (-period / lag).exp() } else { 0.0 };
        self.seen_a = there + (self.seen_a - there) * decay;
    }

    /// The phases, with the sensor's error in the conducting pair.
    fn shown(&self) -> [f64; 3] {
        let (p, n) = PAIRS[self.sector()];
        let error = self.seen_a - self.regulated_a();
        let mut shown = self.i;
        shown[p] += error;
        shown[n] -= error;
        shown
    }

    /// A phase's resistance, as warm as it is.
    fn ohm(&self) -> f64 {
        self.a.motor.resistance_ohm * (1.0 + self.extra.rise_per_k * self.warm_k)
    }

    /// Share of the supply that its own resistance leaves, with the legs' shares of it.
    fn sagged(&self, p: usize, n: usize, pair_v: (f64, f64)) -> f64 {
        let (x, half) = (3 - p - n, 0.5 * self.a.inverter.bus_voltage_v);
        let up = |leg: f64| 0.5 * (1.0 + leg / half);
        let idle = if self.i[x] < 0.0 { 1.0 } else { 0.0 };
        let drawn = up(pair_v.0) * self.i[p] + up(pair_v.1) * self.i[n] + idle * self.i[x];
        1.0 - self.extra.source_ohm * drawn / (2.0 * half)
    }

    /// One step with the pair's legs at their potentials.
    fn step(&mut self, pair_v: (f64, f64), h: f64) {
        let (p, n) = PAIRS[self.sector()];
        let x = 3 - p - n;
        let sagged = self.sagged(p, n, pair_v);
        let half = 0.5 * self.a.inverter.bus_voltage_v * sagged;
        let pair_v = (sagged * pair_v.0, sagged * pair_v.1);
        let k = self.coupling(self.theta).map(|k| k * self.unsaturated(&self.i));
        let (turns, cold) = (self.f.healthy_turns_frac, self.a.motor.resistance_ohm);
        let heat: f64 = (0..3).map(|j| cold * turns[j] * self.i[j] * self.i[j]).sum();
        if self.extra.thermal_s > 0.0 {
            let target = self.extra.kelvin_per_w * heat;
            self.warm_k += h * (target - self.warm_k) / self.extra.thermal_s;
        }
        let mut v = [None; 3];
        (v[p], v[n]) = (Some(pair_v.0), Some(pair_v.1));
        let mut sign = self.i[x].signum() * f64::from(self.i[x] != 0.0);
        if sign == 0.0 {
            let rates = self.current_rates(&self.i, self.w, &k, &v);
            let turns = self.f.healthy_turns_frac[p];
            let star = pair_v.0
                - self.ohm() * turns * self.i[p]
                - k[p] * self.w
                - self.a.motor.inductance_henry * turns * turns * rates[p];
            let open = star + k[x] * self.w;
            sign = if open > half {
                -1.0
            } else if open < -half {
                1.0
            } else {
                0.0
            };
        }
        if sign != 0.0 {
            v[x] = Some(-sign * half);
        }
        let first = self.current_rates(&self.i, self.w, &k, &v);
        let middle: [f64; 3] = [0, 1, 2].map(|j| self.i[j] + 0.5 * h * first[j]);
        let middle_w = self.middle_speed(&k, h);
        let middle_k =
            self.coupling(self.theta + 0.5 * h * self.w).map(|k| k * self.unsaturated(&middle));
        let rates = self.current_rates(&middle, middle_w, &middle_k, &v);
        let torque: f64 = (0..3).map(|j| middle_k[j] * middle[j]).sum();
        for j in 0..3 {
            self.i[j] += h * rates[j];
        }
        if sign != 0.0 && self.i[x] * sign <= 0.0 {
            self.i[p] += 0.5 * self.i[x];
            self.i[n] += 0.5 * self.i[x];
            self.i[x] = 0.0;
        }
        self.shaft(torque, h);
    }

    fn middle_speed(&self, k: &[f64; 3], h: f64) -> f64 {
        let mut half = Machine { ..*self };
        half.shaft((0..3).map(|j| k[j] * self.i[j]).sum(), 0.5 * h);
        half.w
    }

    /// The motor's shaft and the surface behind a spring, a damper and the play.
    fn two_inertias(&mut self, torque: f64, [stiffness, damping]: [f64; 2], h: f64) {
        let t = &self.a.transmission;
        let play = 0.5 * t.backlash_rad * self.f.backlash_ratio;
        let twist = self.theta / t.gear_ratio - self.surface;
        let spring = stiffness * (twist - twist.clamp(-play, play));
        let damped = spring + damping * (self.w / t.gear_ratio - self.surface_speed);
        let passed = if spring * damped > 0.0 { damped } else { 0.0 };
        let felt = |sign: f64| {
            let along = passed * sign < 0.0;
            passed * if along { t.efficiency_ratio } else { 1.0 / t.efficiency_ratio }
                / t.gear_ratio
        };
        let kinetic = t.kinetic_friction_n_m * self.f.friction_ratio;
        let fixed = t.static_friction_n_m * self.f.friction_ratio;
        let sign = match self.w {
            0.0 if torque > fixed + felt(1.0) => 1.0,
            0.0 if torque < -fixed + felt(-1.0) => -1.0,
            0.0 => 0.0,
            w => w.signum(),
        };
        if sign != 0.0 {
            let viscous = self.a.motor.viscous_n_m_s_per_rad * self.w;
            let rate =
                (torque - sign * kinetic - felt(sign) - viscous) / self.a.motor.inertia_kg_m2;
            let before = self.w;
            self.w += h * rate;
            if before * self.w < 0.0 {
                self.w = 0.0;
            }
            self.theta += 0.5 * h * (before + self.w);
        }
        let before = self.surface_speed;
        self.surface_speed += h * (passed - self.load_n_m) / t.surface_inertia_kg_m2;
        self.surface += 0.5 * h * (before + self.surface_speed);
    }

    /// The four-state dry friction at a fixed step.
    fn shaft(&mut self, torque: f64, h: f64) {
        if let Some(shaft) = self.extra.shaft {
            return self.two_inertias(torque, shaft, h);
        }
        let t = &self.a.transmission;
        let play = 0.5 * t.backlash_rad * self.f.backlash_ratio * t.gear_ratio;
        let on_motor = self.surface * t.gear_ratio;
        let touches_up = self.theta - on_motor >= play * (1.0 - 1e-12);
        let touches_down = self.theta - on_motor <= -play * (1.0 - 1e-12);
        let up = self.load_n_m / t.gear_ratio / t.efficiency_ratio;
        let down = self.load_n_m / t.gear_ratio * t.efficiency_ratio;
        let (kinetic, fixed) = (
            t.kinetic_friction_n_m * self.f.friction_ratio,
            t.static_friction_n_m * self.f.friction_ratio,
        );
        let forward =
            self.w > 0.0 || (self.w == 0.0 && torque > fixed + if touches_up { up } else { 0.0 });
        let backward = self.w < 0.0
            || (self.w == 0.0 && torque < -fixed + if touches_down { down } else { 0.0 });
        if !forward && !backward {
            return;
        }
        let resist = if forward {
            kinetic + if touches_up { up } else { 0.0 }
        } else {
            -kinetic + if touches_down { down } else { 0.0 }
        };
        let rate = (torque - resist - self.a.motor.viscous_n_m_s_per_rad * self.w)
            / self.a.total_inertia_kg_m2();
        let before = self.w;
        self.w += h * rate;
        if before * self.w < 0.0 {
            self.w = 0.0;
        }
        self.theta += 0.5 * h * (before + self.w);
        let on_motor = on_motor.clamp(self.theta - play, self.theta + play);
        self.surface = on_motor / t.gear_ratio;
    }
}

/// Phase currents, speed and surface angle at each tick.
type Rows = Vec<[f64; 5]>;

fn brute(scenario: &Scenario, faults: &PhysicalFaults, steps: usize, extra: &Extra) -> Rows {
    let a = EMA_48;
    let mut m = Machine {
        a,
        extra: *extra,
        warm_k: 0.0,
        surface_speed: 0.0,
        seen_a: 0.0,
        f: *faults,
        start_rad: scenario.start_angle_rad,
        load_n_m: scenario.load_n_m,
        i: [0.0; 3],
        w: 0.0,
        theta: 0.0,
        surface: 0.0,
    };
    let (c, v) = (&a.controller, &a.inverter);
    let (period, half) = (1.0 / v.carrier_hz, 0.5 * v.bus_voltage_v);
    let bandwidth = TAU * v.current_bandwidth_hz;
    m.read_sensor(f64::INFINITY);
    let (mut speed_integral, mut volts_integral, mut pending) = (0.0, 0.0, 0.0_f64);
    let mut rows = Vec::new();
    for tick in 0..(scenario.duration_s * c.sample_hz).round() as usize {
        let currents = m.shown();
        rows.push([currents[0], currents[1], currents[2], m.w, m.surface]);
        let command = scenario.command.at(tick as f64 / c.sample_hz);
        let wanted = c.position_gain_per_s * a.transmission.gear_ratio * (command - m.surface);
        let error = wanted.clamp(-c.speed_limit_rad_per_s, c.speed_limit_rad_per_s) - m.w;
        let reference = c.speed_gain_a_s_per_rad * error + speed_integral;
        if reference.abs() < c.current_limit_a {
            speed_integral += c.speed_integral_a_per_rad * error / c.sample_hz;
        }
        let reference = reference.clamp(-c.current_limit_a, c.current_limit_a);
        for _ in 0..(v.carrier_hz / c.sample_hz).round() as usize {
            let duty = pending;
            let error = reference - m.seen_a;
            let volts = 2.0 * a.motor.inductance_henry * bandwidth * error + volts_integral;
            if volts.abs() < v.bus_voltage_v {
                volts_integral += 2.0 * a.motor.resistance_ohm * bandwidth * period * error;
            }
            pending = (volts / v.bus_voltage_v).clamp(-1.0, 1.0);
            let h = period / steps as f64;
            for step in 0..steps {
                // mean over the step of each leg: high while the triangle is below its duty
                let (from, to) = (step as f64 / steps as f64, (step + 1) as f64 / steps as f64);
                let leg = |u: f64| {
                    let (on, off) = (0.25 * (1.0 - u), 0.75 + 0.25 * u);
                    let high = (to.min(off) - from.max(on)).max(0.0) / (to - from);
                    half * (2.0 * high - 1.0)
                };
                m.step((leg(duty), leg(-duty)), h);
            }
            m.read_sensor(period);
        }
    }
    rows
}

fn engine(
    scenario: &Scenario,
    faults: &PhysicalFaults,
    effects: &[Effect],
    longest_segment_ratio: f64,
) -> Rows {
    let model = HighFidelity::new(&EMA_48, scenario).and_then(|m| m.with_effects(effects));
    let (trace, _) = model.expect("valid").simulate_finer(faults, longest_segment_ratio);
    (0..trace.motor_angle_rad.len())
        .map(|n| {
            let [a, b, c] = trace.phases_a(n);
            [a, b, c, trace.motor_speed_rad_per_s[n], trace.surface_angle_rad[n]]
        })
        .collect()
}

/// Largest root mean square difference of a channel over that channel's root mean square.
fn gap(a: &Rows, b: &Rows) -> [f64; 5] {
    core::array::from_fn(|channel| {
        let sum = |f: &dyn Fn(usize) -> f64| (0..a.len()).map(f).sum::<f64>();
        let difference = sum(&|n| (a[n][channel] - b[n][channel]).powi(2));
        (difference / sum(&|n| b[n][channel].powi(2))).sqrt()
    })
}

#[test]
fn law_small_fixed_steps_converge_to_the_engine() {
    let mut scenario = Scenario { duration_s: 0.3, ..Scenario::chirp() };
    scenario.command =
        Command::Chirp { amplitude_rad: 5e-3, start_hz: 4.0, end_hz: 15.0, sweep_s: 0.3 };
    scenario.start_angle_rad = 0.4;
    let health = HealthState::new([0.1, 0.02, 0.05, 0.0, 0.03, 0.05, 0.7]).unwrap();
    let faults = PhysicalFaults::from(&health);
    let exact = engine(&scenario, &faults, &[], 1.0);
    let coarse = gap(&brute(&scenario, &faults, 250, &Extra::default()), &exact);
    let fine = gap(&brute(&scenario, &faults, 2000, &Extra::default()), &exact);
    for channel in 0..5 {
        // steps of 25 ns: the largest remainder is an event's rounding, 25 ns of 24 V over L
        assert!(fine[channel] < 1e-4, "{fine:?}");
        assert!(fine[channel] < 0.5 * coarse[channel], "{coarse:?} {fine:?}");
    }
}

fn effect(id: EffectId, numbers: &[(&str, f64)]) -> Effect {
    numbers.iter().fold(Effect::new(id, Geometry::Rotary), |effect, (key, value)| {
        effect.with(key, *value).expect("valid")
    })
}

/// Each effect on the circuit, the commutation and the current's sensor, and all at once.
fn cases() -> Vec<(Vec<Effect>, Extra)> {
    use EffectId::*;
    let none = Extra::default();
    let mut cases = vec![
        (
            vec![effect(Saturation, &[("saturation_per_a2", 1e-3)])],
            Extra { saturation_per_a2: 1e-3, ..none },
        ),
        (
            vec![effect(
                ResistanceDrift,
                &[
                    ("resistance_rise_per_k", 0.0039),
                    ("thermal_resistance_k_per_w", 10.0),
                    ("thermal_time_constant_s", 0.05),
                ],
            )],
            Extra { rise_per_k: 0.0039, kelvin_per_w: 10.0, thermal_s: 0.05, ..none },
        ),
        (
            vec![effect(BusSag, &[("source_resistance_ohm", 1.0)])],
            Extra { source_ohm: 1.0, ..none },
        ),
        (
            vec![effect(
                BackEmfShape,
                &[
                    ("flat_loss_rad", 0.17),
                    ("fifth_harmonic_ratio", 0.03),
                    ("seventh_harmonic_ratio", -0.02),
                ],
            )],
            Extra { flat_loss_rad: 0.17, fifth: 0.03, seventh: -0.02, ..none },
        ),
        (vec![effect(HallOffset, &[("hall_offset_rad", 0.08)])], Extra { hall_rad: 0.08, ..none }),
        (
            vec![effect(
                CurrentSensor,
                &[("gain_error_ratio", 0.05), ("offset_a", 0.1), ("lag_s", 2e-4), ("in_loop", 1.0)],
            )],
            Extra { sensor: [0.05, 0.1, 2e-4], ..none },
        ),
    ];
    let every = cases.iter().flat_map(|(effects, _)| effects.clone()).collect();
    let together = Extra {
        sensor: [0.05, 0.1, 2e-4],
        hall_rad: 0.08,
        source_ohm: 1.0,
        saturation_per_a2: 1e-3,
        rise_per_k: 0.0039,
        kelvin_per_w: 10.0,
        thermal_s: 0.05,
        ..cases[3].1
    };
    cases.push((every, together));
    cases
}

/// Segments hundred times finer against steps of 50 ns, whose error goes with the step.
const FINE_REL: f64 = 2e-4;
/// What holding saturation, warmth and the sag of the supply over a segment costs.
const HELD_REL: f64 = 3e-4;

/// A short chirp of a machine with every fault.
fn effects_test() -> (Scenario, PhysicalFaults) {
    let mut scenario = Scenario { duration_s: 0.1, ..Scenario::chirp() };
    scenario.command =
        Command::Chirp { amplitude_rad: 5e-3, start_hz: 6.0, end_hz: 20.0, sweep_s: 0.1 };
    scenario.start_angle_rad = 0.4;
    let levels = [0.1, 0.02, 0.05, 0.0, 0.03, 0.05, 0.7];
    let health = HealthState::new(levels).expect("on the scale");
    (scenario, PhysicalFaults::from(&health))
}

#[test]
fn law_effects_on_the_circuit_follow_their_equations() {
    let (scenario, faults) = effects_test();
    let base = engine(&scenario, &faults, &[], 1.0);
    for (effects, extra) in cases() {
        let id = effects[0].id();
        let exact = engine(&scenario, &faults, &effects, 0.01);
        let quick = gap(&engine(&scenario, &faults, &effects, 1.0), &exact);
        let (without, coarse, fine) = (
            gap(&base, &exact),
            gap(&brute(&scenario, &faults, 250, &extra), &exact),
            gap(&brute(&scenario, &faults, 1000, &extra), &exact),
        );
        for channel in 0..5 {
            let (coarse, fine) = (coarse[channel], fine[channel]);
            assert!(fine < FINE_REL && fine < 0.6 * coarse, "{id:?}: {coarse:e} {fine:e}");
            assert!(quick[channel] < HELD_REL, "{id:?}: {:e}", quick[channel]);
            assert!(without[channel] > 2.0 * fine, "{id:?}: {:e} {fine:e}", without[channel]);
        }
    }
}

/// A flank that bounces without damping amplifies what rounding an event to a step costs.
const BOUNCING_REL: f64 = 1e-3;

#[test]
fn law_two_inertias_behind_a_play() {
    let (scenario, faults) = effects_test();
    let scenario = Scenario { load_n_m: 2.0, ..scenario };
    let base = engine(&scenario, &faults, &[], 1.0);
    for (compliance, damping) in [(1e-5, 100.0), (1e-4, 5.0), (1e-5, 0.0)] {
        let numbers = [("compliance_rad_per_n_m", compliance), ("damping_n_m_s_per_rad", damping)];
        let effects = [effect(EffectId::Compliance, &numbers)];
        let extra = Extra { shaft: Some([1.0 / compliance, damping]), ..Extra::default() };
        let exact = engine(&scenario, &faults, &effects, 1.0);
        let (without, coarse, fine, finer) = (
            gap(&base, &exact),
            gap(&brute(&scenario, &faults, 250, &extra), &exact),
            gap(&brute(&scenario, &faults, 1000, &extra), &exact),
            gap(&engine(&scenario, &faults, &effects, 0.1), &exact),
        );
        let most = if damping > 0.0 { FINE_REL } else { BOUNCING_REL };
        for channel in 0..5 {
            let (coarse, fine) = (coarse[channel], fine[channel]);
            assert!(fine < most && fine < 0.4 * coarse, "{compliance}: {coarse:e} {fine:e}");
            assert!(finer[channel] < 1e-5, "{compliance}: {:e}", finer[channel]);
            assert!(without[channel] > 100.0 * fine, "{:e} {fine:e}", without[channel]);
        }
    }
}
