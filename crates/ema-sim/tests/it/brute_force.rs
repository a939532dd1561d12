//! The high-fidelity model against the same physics in small fixed steps, written apart.
//!
//! Nothing is shared with the crate but parameters and equations (`docs/models`): phases by name,
//! back-EMF from its angle, the carrier as a triangle, the midpoint rule at a fraction of a
//! microsecond, every event rounded to a step. What the two agree on does not come from either's
//! method.

use core::f64::consts::{FRAC_PI_3, FRAC_PI_6, TAU};

use ema_sim::{
    Actuator, Command, HealthState, HighFidelity, PhysicalFaults, Scenario, presets::EMA_48,
};

/// Phases that carry `+I` and `−I` in the six sectors.
const PAIRS: [(usize, usize); 6] = [(0, 1), (0, 2), (1, 2), (1, 0), (2, 0), (2, 1)];

struct Machine {
    a: Actuator,
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
            let x = (electrical - TAU / 3.0 * j as f64).rem_euclid(TAU).to_degrees();
            let shape = match x {
                x if x < 30.0 => x / 30.0,
                x if x < 150.0 => 1.0,
                x if x < 210.0 => (180.0 - x) / 30.0,
                x if x < 330.0 => -1.0,
                x => (x - 360.0) / 30.0,
            };
            self.a.motor.back_emf_v_s_per_rad * self.f.healthy_turns_frac[j] * shape * gap
        })
    }

    fn sector(&self) -> usize {
        let electrical = (self.theta + self.start_rad) * f64::from(self.a.motor.pole_pairs);
        ((electrical - FRAC_PI_6) / FRAC_PI_3).floor().rem_euclid(6.0) as usize
    }

    /// Rates of the currents for the connected legs' potentials.
    fn current_rates(&self, i: &[f64; 3], w: f64, k: &[f64; 3], v: &[Option<f64>; 3]) -> [f64; 3] {
        let n = self.f.healthy_turns_frac;
        let drive = |j: usize, leg: f64| leg - self.a.motor.resistance_ohm * n[j] * i[j] - k[j] * w;
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

    /// One step with the pair's legs at their potentials.
    fn step(&mut self, pair_v: (f64, f64), h: f64) {
        let (p, n) = PAIRS[self.sector()];
        let x = 3 - p - n;
        let half = 0.5 * self.a.inverter.bus_voltage_v;
        let k = self.coupling(self.theta);
        let mut v = [None; 3];
        (v[p], v[n]) = (Some(pair_v.0), Some(pair_v.1));
        let mut sign = self.i[x].signum() * f64::from(self.i[x] != 0.0);
        if sign == 0.0 {
            let rates = self.current_rates(&self.i, self.w, &k, &v);
            let turns = self.f.healthy_turns_frac[p];
            let star = pair_v.0
                - self.a.motor.resistance_ohm * turns * self.i[p]
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
        let (middle_w, middle_k) =
            (self.middle_speed(&k, h), self.coupling(self.theta + 0.5 * h * self.w));
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
        let mut half = Machine { a: self.a, f: self.f, ..*self };
        half.shaft((0..3).map(|j| k[j] * self.i[j]).sum(), 0.5 * h);
        half.w
    }

    /// The four-state dry friction at a fixed step.
    fn shaft(&mut self, torque: f64, h: f64) {
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

fn brute(scenario: &Scenario, faults: &PhysicalFaults, steps: usize) -> Rows {
    let a = EMA_48;
    let mut m = Machine {
        a,
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
    let (mut speed_integral, mut volts_integral, mut pending) = (0.0, 0.0, 0.0_f64);
    let mut rows = Vec::new();
    for tick in 0..(scenario.duration_s * c.sample_hz).round() as usize {
        rows.push([m.i[0], m.i[1], m.i[2], m.w, m.surface]);
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
            // the phase whose flat top is centred nearest to the rotor
            let electrical = (m.theta + m.start_rad) * f64::from(a.motor.pole_pairs);
            let phase = (0..3)
                .max_by(|&x, &y| {
                    let near = |j: usize| (electrical - TAU / 3.0 * j as f64).sin().abs();
                    near(x).total_cmp(&near(y))
                })
                .expect("three phases");
            let sign = (electrical - TAU / 3.0 * phase as f64).sin().signum();
            let error = reference - sign * m.i[phase];
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
        }
    }
    rows
}

fn engine(scenario: &Scenario, faults: &PhysicalFaults) -> Rows {
    let trace = HighFidelity::new(&EMA_48, scenario).expect("valid").simulate(faults);
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
    let exact = engine(&scenario, &faults);
    let coarse = gap(&brute(&scenario, &faults, 250), &exact);
    let fine = gap(&brute(&scenario, &faults, 2000), &exact);
    for channel in 0..5 {
        // steps of 25 ns: the largest remainder is an event's rounding, 25 ns of 24 V over L
        assert!(fine[channel] < 1e-4, "{fine:?}");
        assert!(fine[channel] < 0.5 * coarse[channel], "{coarse:?} {fine:?}");
    }
}
