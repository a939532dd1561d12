//! The low-fidelity monitoring model: a first-order direct-current equivalent of the drive.
//!
//! ```text
//! R·I_m = V_m − v·ω,   T_m = v·I_m                      eqs 18 and 19 of the FREEDOM paper
//! v(θ) = 2·k_p·F_sc(θ_e)·F_ecc(θ_m)    R(θ) = 2·R_p·F_sc(θ_e)
//! F_sc  = ½·Σ|s_j|·N_j                  F_ecc = 1 + ζ·cos(θ_m + φ)
//! ```
//!
//! The inverter is taken as perfect: the current is the set-point, unless the supply cannot
//! drive it. The two shape functions follow from the torque of the conducting pair; the paper
//! names but does not print its own (`docs/paper-ledger.md`, eqs 18-19).

use crate::{
    controller::Cascade,
    drive_train::{Direction, DriveTrain},
    error::SimulationError,
    fault::PhysicalFaults,
    params::Actuator,
    phase::Sector,
    scenario::Scenario,
    series::{Series, TERMS, root, value},
    trace::LowFidelityTrace,
    winding::{LocalCubic, RotorAngle, Winding, along_time, product},
};

/// The monitoring model of an actuator in one test.
///
/// # Cost
///
/// About one segment a tick of the controller: five thousand for the chirp.
///
/// # Examples
///
/// ```
/// use ema_sim::{HealthState, LowFidelity, Scenario, presets::EMA_48};
///
/// let model = LowFidelity::new(&EMA_48, &Scenario::chirp())?;
/// let trace = model.simulate(&(&HealthState::HEALTHY).into());
/// assert_eq!(trace.current_a.len(), 5000);
/// # Ok::<_, ema_sim::SimulationError>(())
/// ```
#[derive(Clone, Debug)]
pub struct LowFidelity {
    actuator: Actuator,
    scenario: Scenario,
    command_rad: Vec<f64>,
}

impl LowFidelity {
    /// Prepares a test.
    ///
    /// # Errors
    ///
    /// [`SimulationError`] for parameters or a test that cannot be simulated.
    pub fn new(actuator: &Actuator, scenario: &Scenario) -> Result<Self, SimulationError> {
        actuator.check()?;
        let command_rad = scenario.sampled_command(actuator)?;
        Ok(Self { actuator: *actuator, scenario: scenario.clone(), command_rad })
    }

    /// The same test with the rotor turned at the start.
    #[must_use]
    pub fn turned_to(mut self, start_angle_rad: f64) -> Self {
        self.scenario.start_angle_rad = start_angle_rad;
        self
    }

    /// Runs the test on an actuator with the given damage.
    pub fn simulate(&self, faults: &PhysicalFaults) -> LowFidelityTrace {
        let room = || Vec::with_capacity(self.command_rad.len());
        let mut trace = LowFidelityTrace {
            rate_hz: self.actuator.controller.sample_hz,
            current_a: room(),
            motor_angle_rad: room(),
            motor_speed_rad_per_s: room(),
            surface_angle_rad: room(),
            segments: 0,
        };
        trace.segments = self.run(faults, |run| {
            trace.current_a.push(run.current_a);
            trace.motor_angle_rad.push(run.rotor.motor_rad);
            trace.motor_speed_rad_per_s.push(run.train.speed_rad_per_s);
            trace.surface_angle_rad.push(run.train.surface_rad());
        });
        trace
    }

    /// Runs the test for its current alone, into a buffer of the caller's.
    pub fn simulate_current(&self, faults: &PhysicalFaults, current_a: &mut Vec<f64>) {
        current_a.clear();
        current_a.reserve(self.command_rad.len());
        self.run(faults, |run| current_a.push(run.current_a));
    }

    /// Runs the test, showing the state at each tick; returns the segments taken.
    fn run(&self, faults: &PhysicalFaults, mut show: impl FnMut(&Run)) -> u64 {
        let mut run = Run::new(&self.actuator, &self.scenario, faults);
        let mut cascade = Cascade::new(&self.actuator, &self.scenario);
        let tick_s = 1.0 / self.actuator.controller.sample_hz;
        for (tick, &command_rad) in self.command_rad.iter().enumerate() {
            if tick % REFRESH_TICKS == 0 {
                run.refresh();
            }
            show(&run);
            let reference_a =
                cascade.step(command_rad, run.train.surface_rad(), run.train.speed_rad_per_s);
            run.advance(reference_a, tick_s);
        }
        run.segments
    }
}

/// Ticks after which the rotor's sines are taken afresh; rotating them drifts by 1e-16 a tick.
const REFRESH_TICKS: usize = 64;

/// State of a run.
struct Run {
    winding: Winding,
    /// `2·k_p·F_sc` and `2·R_p·F_sc` for the six sectors.
    sectors: [(f64, f64); 6],
    bus_voltage_v: f64,
    start_angle_rad: f64,
    train: DriveTrain,
    rotor: RotorAngle,
    sector_rad: (f64, f64),
    current_a: f64,
    segments: u64,
}

/// How the current follows the set-point.
#[derive(Clone, Copy)]
enum Source {
    /// The set-point is reached.
    Current(f64),
    /// The supply is all used: `V_m = ±V_dc`.
    Voltage(f64),
}

/// What ends a segment.
enum Event {
    Tick,
    Standstill,
    Sector(i64),
    Bound,
}

impl Run {
    fn new(actuator: &Actuator, scenario: &Scenario, faults: &PhysicalFaults) -> Self {
        let winding = Winding::new(&actuator.motor, faults);
        let start_angle_rad = scenario.start_angle_rad;
        let sector = Sector::of_electrical_angle(start_angle_rad * winding.pole_pairs());
        let turns = faults.healthy_turns_frac;
        let sectors = core::array::from_fn(|place| {
            let sector = Sector::from_place(place);
            let share = 0.5 * (turns[sector.positive_phase()] + turns[sector.negative_phase()]);
            let motor = &actuator.motor;
            (motor.torque_constant_n_m_per_a() * share, 2.0 * motor.resistance_ohm * share)
        });
        let mut run = Self {
            winding,
            sectors,
            bus_voltage_v: actuator.inverter.bus_voltage_v,
            start_angle_rad,
            train: DriveTrain::new(
                actuator,
                faults,
                scenario.load_n_m,
                scenario.backlash_side_ratio,
            ),
            rotor: RotorAngle::new(start_angle_rad, sector),
            sector_rad: (0.0, 0.0),
            current_a: 0.0,
            segments: 0,
        };
        run.enter(sector);
        run
    }

    /// Takes the sines afresh, so that their rotation does not drift.
    fn refresh(&mut self) {
        self.rotor =
            RotorAngle::new(self.start_angle_rad + self.train.angle_rad, self.rotor.sector);
    }

    fn enter(&mut self, sector: Sector) {
        self.rotor.sector = sector;
        self.sector_rad = sector.span_rad(self.winding.pole_pairs(), self.start_angle_rad);
    }

    /// Holds the set-point for a time.
    fn advance(&mut self, reference_a: f64, span_s: f64) {
        let mut left_s = span_s;
        while left_s > 0.0 {
            let gap = self.winding.gap(&self.rotor);
            let (torque_constant, resistance_ohm) = self.sectors[self.rotor.sector.place()];
            let coupling = gap.map(|g| torque_constant * g);
            let emf_v = coupling[0] * self.train.speed_rad_per_s;
            let needed_v = resistance_ohm * reference_a + emf_v;
            let source = if needed_v.abs() <= self.bus_voltage_v {
                self.current_a = reference_a;
                Source::Current(reference_a)
            } else {
                let v = self.bus_voltage_v.copysign(needed_v);
                self.current_a = (v - emf_v) / resistance_ohm;
                Source::Voltage(v)
            };
            if self.train.direction == Direction::Stuck {
                self.train.stand_still(coupling[0] * self.current_a);
                if self.train.direction == Direction::Stuck {
                    return;
                }
            }
            let motion = Motion::solve(&self.train, &coupling, resistance_ohm, source);
            let (event, at_s) = self.first_event(&motion, left_s);
            self.commit(&motion, at_s);
            left_s = if matches!(event, Event::Tick) { 0.0 } else { left_s - at_s };
            self.handle(&event, coupling[0] * self.current_a);
        }
    }

    fn first_event(&self, motion: &Motion, span_s: f64) -> (Event, f64) {
        let mut first = (Event::Tick, span_s);
        let mut offer = |event, at_s: f64| {
            if at_s < first.1 {
                first = (event, at_s);
            }
        };
        if value(&motion.speed, span_s) * self.train.direction.sign() <= 0.0 {
            offer(Event::Standstill, root(&motion.speed, span_s));
        }
        let from_rad = self.train.angle_rad;
        let to_rad = from_rad + value(&motion.turn, span_s);
        let (sector, bound) = (self.sector_rad, self.train.bounds_rad());
        let mut reach = |event, angle_rad: f64| {
            let mut beyond = motion.turn;
            beyond[0] -= angle_rad - from_rad;
            offer(event, root(&beyond, span_s));
        };
        if to_rad > sector.1 {
            reach(Event::Sector(1), sector.1);
        } else if to_rad < sector.0 {
            reach(Event::Sector(-1), sector.0);
        }
        if to_rad > bound.1 {
            reach(Event::Bound, bound.1);
        } else if to_rad < bound.0 {
            reach(Event::Bound, bound.0);
        }
        first
    }

    fn commit(&mut self, motion: &Motion, by_s: f64) {
        self.train.speed_rad_per_s = value(&motion.speed, by_s);
        let turn_rad = value(&motion.turn, by_s);
        self.train.angle_rad += turn_rad;
        self.rotor.turn(turn_rad);
        self.segments += 1;
    }

    fn handle(&mut self, event: &Event, torque_n_m: f64) {
        match event {
            Event::Tick => {}
            Event::Standstill => self.train.stand_still(torque_n_m),
            Event::Sector(step) => {
                self.train.angle_rad =
                    if *step > 0 { self.sector_rad.1 } else { self.sector_rad.0 };
                self.enter(self.rotor.sector.shifted(*step));
            }
            Event::Bound => {
                let (low, high) = self.train.bounds_rad();
                let forward = self.train.direction == Direction::Forward;
                self.train.angle_rad = if forward { high } else { low };
                self.train.reach_bound(torque_n_m);
            }
        }
    }
}

/// The shaft from now to the next event.
struct Motion {
    speed: Series,
    turn: Series,
}

impl Motion {
    #[inline]
    fn solve(
        train: &DriveTrain,
        coupling: &LocalCubic,
        resistance_ohm: f64,
        source: Source,
    ) -> Self {
        let per_inertia = 1.0 / train.inertia_kg_m2;
        let mut external = train.external_n_m();
        let mut speed = [0.0; TERMS];
        let mut turn = [0.0; TERMS];
        speed[0] = train.speed_rad_per_s;
        turn[1] = speed[0];
        let mut current = [0.0; TERMS];
        for m in 0..TERMS - 1 {
            let v = along_time(coupling, &turn);
            current[m] = match source {
                Source::Current(i) if m == 0 => i,
                Source::Current(_) => 0.0,
                Source::Voltage(volts) => {
                    let applied = if m == 0 { volts } else { 0.0 };
                    (applied - product(&v, &speed, m)) / resistance_ohm
                }
            };
            let torque = product(&v, &current, m);
            let next = (m + 1) as f64;
            speed[m + 1] =
                (torque + external - train.viscous_n_m_s_per_rad * speed[m]) * per_inertia / next;
            if m + 2 < TERMS {
                turn[m + 2] = speed[m + 1] / (next + 1.0);
            }
            external = 0.0;
        }
        Self { speed, turn }
    }
}
