//! The low-fidelity monitoring model: a first-order direct-current equivalent of the drive.
//!
//! ```text
//! R·I_m = V_m − v·ω,   T_m = v·I_m                      eqs 18 and 19 of the FREEDOM paper
//! v(θ) = 2·k_p·F_sc(θ_e)·F_ecc(θ_m)    R(θ) = 2·R_p·F_sc(θ_e)
//! F_sc  = ½·Σ|s_j|·N_j                  F_ecc = 1 + ζ·cos(θ_m + φ)
//! ```
//!
//! The inverter is taken as perfect: the current is the set-point, unless the supply cannot
//! drive it. A field-oriented drive has `k_p`, `R_p` and a smooth `F_sc` in place of `2·k_p`,
//! `2·R_p` and the staircase (`shape_function`). The two shape functions follow from the torque of the conducting pair; the paper
//! names but does not print its own (`docs/paper-ledger.md`, eqs 18-19).

use crate::{
    controller::{Cascade, Measured},
    drive_train::{Direction, DriveTrain},
    error::SimulationError,
    fault::PhysicalFaults,
    params::Actuator,
    phase::Sector,
    scenario::Scenario,
    series::{RECIPROCALS, Series, reach, root, value},
    shape_function::ShapeFunction,
    trace::LowFidelityTrace,
    winding::{LocalQuadratic, RotorAngle, Shaft, Winding, first, second},
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

    /// Turns the rotor at the start.
    pub fn turn_to(&mut self, start_angle_rad: f64) {
        self.scenario.start_angle_rad = start_angle_rad;
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
            trace.motor_angle_rad.push(run.start_angle_rad + run.train.angle_rad);
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
            let measured = Measured {
                surface_rad: run.train.surface_rad(),
                motor_rad: run.train.angle_rad,
                speed_rad_per_s: run.train.speed_rad_per_s,
            };
            let reference_a = cascade.step(command_rad, &measured);
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
    /// What stands in place of the six sectors in a field-oriented drive.
    shape: Option<ShapeFunction>,
    /// Largest voltage of the equivalent machine.
    limit_v: f64,
    start_angle_rad: f64,
    train: DriveTrain,
    /// The shaft's equation in the present state of the drive train.
    shaft: Shaft,
    rotor: RotorAngle,
    sector: Sector,
    /// Motor angles from the start between which the sector lasts.
    sector_rad: (f64, f64),
    /// Motor angles from the start between which neither sector nor contact changes.
    window_rad: (f64, f64),
    current_a: f64,
    segments: u64,
}

/// What ends a segment.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Event {
    Tick,
    Standstill,
    Sector(i64),
    Bound,
}

impl Run {
    fn new(actuator: &Actuator, scenario: &Scenario, faults: &PhysicalFaults) -> Self {
        let winding = Winding::new(&actuator.motor, faults);
        let train = DriveTrain::new(actuator, faults, scenario);
        let start_angle_rad = scenario.start_angle_rad;
        let sector = Sector::of_electrical_angle(start_angle_rad * winding.pole_pairs());
        let mut run = Self {
            winding,
            sectors: shape_of_sectors(actuator, faults),
            shape: ShapeFunction::new(actuator, faults),
            limit_v: actuator.equivalent_supply_v(),
            start_angle_rad,
            shaft: train.shaft(),
            train,
            rotor: RotorAngle::new(start_angle_rad),
            sector,
            sector_rad: (0.0, 0.0),
            window_rad: (0.0, 0.0),
            current_a: 0.0,
            segments: 0,
        };
        run.enter(sector);
        run
    }

    /// Takes the sines afresh, so that their rotation does not drift.
    fn refresh(&mut self) {
        if self.winding.eccentric {
            self.rotor = RotorAngle::new(self.start_angle_rad + self.train.angle_rad);
        }
    }

    fn enter(&mut self, sector: Sector) {
        self.sector = sector;
        self.sector_rad = if self.shape.is_some() {
            (f64::NEG_INFINITY, f64::INFINITY)
        } else {
            sector.span_rad(self.winding.pole_pairs(), self.start_angle_rad)
        };
        self.renew();
    }

    /// Takes over what the drive train's state decides.
    fn renew(&mut self) {
        self.shaft = self.train.shaft();
        let bound = self.train.bounds_rad();
        self.window_rad = (self.sector_rad.0.max(bound.0), self.sector_rad.1.min(bound.1));
    }

    /// Torque over current near the rotor's angle, and the resistance there.
    #[inline]
    fn equivalent(&self) -> (LocalQuadratic, f64) {
        let gap = self.winding.gap(&self.rotor);
        if let Some(shape) = &self.shape {
            return shape.near(self.start_angle_rad + self.train.angle_rad, &gap);
        }
        let (torque_constant, resistance_ohm) = self.sectors[self.sector.place()];
        (gap.map(|g| torque_constant * g), resistance_ohm)
    }

    /// Holds the set-point for a time.
    #[inline]
    fn advance(&mut self, reference_a: f64, span_s: f64) {
        let mut left_s = span_s;
        while left_s > 0.0 {
            let (coupling, resistance_ohm) = self.equivalent();
            let emf_v = coupling[0] * self.train.speed_rad_per_s;
            let needed_v = resistance_ohm * reference_a + emf_v;
            let saturated = needed_v.abs() > self.limit_v;
            let applied_v = self.limit_v.copysign(needed_v);
            self.current_a =
                if saturated { (applied_v - emf_v) / resistance_ohm } else { reference_a };
            if self.train.direction == Direction::Stuck {
                self.train.stand_still(coupling[0] * self.current_a);
                if self.train.direction == Direction::Stuck {
                    return;
                }
                self.renew();
            }
            let speed = self.train.speed_rad_per_s;
            let motion = if saturated {
                Motion::at_voltage(&self.shaft, &coupling, resistance_ohm, applied_v, speed)
            } else {
                Motion::at_current(&self.shaft, &coupling, reference_a, speed)
            };
            let longest_s =
                self.shape.as_ref().map_or(f64::INFINITY, |shape| shape.longest_s(speed));
            left_s -= self.follow(&motion, left_s.min(longest_s), &coupling);
        }
    }

    /// Follows a motion to its first event or the end of a span; returns the time taken.
    #[inline]
    fn follow(&mut self, motion: &Motion, span_s: f64, coupling: &LocalQuadratic) -> f64 {
        let (mut speed, mut turn_rad) = (value(&motion.speed, span_s), value(&motion.turn, span_s));
        let (mut event, mut at_s) = (Event::Tick, span_s);
        let to_rad = self.train.angle_rad + turn_rad;
        if speed * self.train.direction.sign() <= 0.0
            || to_rad > self.window_rad.1
            || to_rad < self.window_rad.0
        {
            (event, at_s) = self.first_event(motion, span_s, speed, to_rad);
            (speed, turn_rad) = (value(&motion.speed, at_s), value(&motion.turn, at_s));
        }
        self.train.speed_rad_per_s = speed;
        self.train.angle_rad += turn_rad;
        if self.winding.eccentric {
            self.rotor.turn(turn_rad);
        }
        self.segments += 1;
        if event != Event::Tick {
            self.handle(event, coupling[0] * self.current_a);
        }
        at_s
    }

    fn first_event(&self, motion: &Motion, span_s: f64, speed: f64, to_rad: f64) -> (Event, f64) {
        let mut first = (Event::Tick, span_s);
        let mut offer = |event, at_s: f64| {
            if at_s < first.1 {
                first = (event, at_s);
            }
        };
        if speed * self.train.direction.sign() <= 0.0 {
            offer(Event::Standstill, root(&motion.speed, span_s));
        }
        let from_rad = self.train.angle_rad;
        let (sector, bound) = (self.sector_rad, self.train.bounds_rad());
        let mut meet = |event, angle_rad: f64| {
            offer(event, reach(&motion.turn, angle_rad - from_rad, span_s));
        };
        if to_rad > sector.1 {
            meet(Event::Sector(1), sector.1);
        } else if to_rad < sector.0 {
            meet(Event::Sector(-1), sector.0);
        }
        if to_rad > bound.1 {
            meet(Event::Bound, bound.1);
        } else if to_rad < bound.0 {
            meet(Event::Bound, bound.0);
        }
        first
    }

    fn handle(&mut self, event: Event, torque_n_m: f64) {
        match event {
            Event::Tick => {}
            Event::Standstill => self.train.stand_still(torque_n_m),
            Event::Sector(step) => {
                self.train.angle_rad = if step > 0 { self.sector_rad.1 } else { self.sector_rad.0 };
                self.enter(self.sector.shifted(step));
            }
            Event::Bound => {
                let (low, high) = self.train.bounds_rad();
                let forward = self.train.direction == Direction::Forward;
                self.train.angle_rad = if forward { high } else { low };
                self.train.reach_bound(torque_n_m);
            }
        }
        self.renew();
    }
}

/// `2·k_p·F_sc` and `2·R_p·F_sc` for the six sectors.
fn shape_of_sectors(actuator: &Actuator, faults: &PhysicalFaults) -> [(f64, f64); 6] {
    let (motor, turns) = (&actuator.motor, faults.healthy_turns_frac);
    core::array::from_fn(|place| {
        let sector = Sector::from_place(place);
        let share = 0.5 * (turns[sector.positive_phase()] + turns[sector.negative_phase()]);
        (motor.torque_constant_n_m_per_a() * share, 2.0 * motor.resistance_ohm * share)
    })
}

/// The shaft from now to the next event.
struct Motion {
    speed: Series,
    turn: Series,
}

impl Motion {
    /// With the set-point reached.
    #[inline]
    fn at_current(shaft: &Shaft, v: &LocalQuadratic, current_a: f64, w0: f64) -> Self {
        let (j, c) = (&shaft.per_inertia, shaft.viscous_n_m_s_per_rad);
        let w1 = (v[0] * current_a + shaft.external_n_m - c * w0) * j[0];
        let d2 = 0.5 * w1;
        let w2 = (first(v, w0) * current_a - c * w1) * j[1];
        let w3 = (second(v, w0, d2) * current_a - c * w2) * j[2];
        Self {
            speed: [w0, w1, w2, w3, -c * w3 * j[3]],
            turn: [0.0, w0, d2, w2 * (1.0 / 3.0), 0.25 * w3],
        }
    }

    /// With the supply all used: `I = (V − v·ω)/R`.
    fn at_voltage(
        shaft: &Shaft,
        v: &LocalQuadratic,
        resistance_ohm: f64,
        applied_v: f64,
        w0: f64,
    ) -> Self {
        let mut speed = [w0, 0.0, 0.0, 0.0, 0.0];
        let mut turn = [0.0, w0, 0.0, 0.0, 0.0];
        let (mut k, mut current) = ([0.0; 4], [0.0; 4]);
        let (mut source, mut external) = (applied_v, shaft.external_n_m);
        for m in 0..4 {
            k[m] = match m {
                0 => v[0],
                1 => first(v, turn[1]),
                2 => second(v, turn[1], turn[2]),
                _ => 0.0,
            };
            let emf: f64 = (0..=m).map(|n| k[n] * speed[m - n]).sum();
            current[m] = (source - emf) / resistance_ohm;
            let torque: f64 = (0..=m).map(|n| k[n] * current[m - n]).sum();
            speed[m + 1] =
                (torque + external - shaft.viscous_n_m_s_per_rad * speed[m]) * shaft.per_inertia[m];
            if m < 3 {
                turn[m + 2] = speed[m + 1] * RECIPROCALS[m + 1];
            }
            (source, external) = (0.0, 0.0);
        }
        Self { speed, turn }
    }
}
