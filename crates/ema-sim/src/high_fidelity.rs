//! The high-fidelity model: from event to event, with nothing rounded to a step.
//!
//! Events are the switching instants of the carrier, sector changes, the end of freewheeling,
//! standstill and breakaway, the play closing and the end stops. Between events the winding and
//! the shaft follow a Taylor series (`winding`).

use crate::{
    controller::Cascade,
    drive_train::{Direction, DriveTrain},
    error::SimulationError,
    fault::PhysicalFaults,
    noise::NoiseSource,
    params::Actuator,
    phase::{ContinuingPhase, PerPhase, Sector},
    scenario::Scenario,
    series::{root, value},
    trace::HighFidelityTrace,
    winding::{Connection, RotorAngle, Segment, Winding},
};

/// The high-fidelity model of an actuator in one test.
///
/// Blocks as in Fig. 2 of the FREEDOM paper: control electronics, three-phase inverter with
/// carrier modulation and a synchronous current loop, electromagnetic model, motor and
/// transmission, load.
///
/// # Cost
///
/// About five segments a carrier period, no allocation inside the loop.
///
/// # Examples
///
/// ```
/// use ema_sim::{HealthState, HighFidelity, Scenario, presets::EMA_48};
///
/// let model = HighFidelity::new(&EMA_48, &Scenario::chirp())?;
/// let trace = model.simulate(&(&HealthState::HEALTHY).into());
/// assert_eq!(trace.motor_angle_rad.len(), 5000);
/// # Ok::<_, ema_sim::SimulationError>(())
/// ```
#[derive(Clone, Debug)]
pub struct HighFidelity {
    actuator: Actuator,
    scenario: Scenario,
    command_rad: Vec<f64>,
}

impl HighFidelity {
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

    /// The same test with another seed of the controller's noise.
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.scenario.seed = seed;
        self
    }

    /// Runs the test on an actuator with the given damage.
    pub fn simulate(&self, faults: &PhysicalFaults) -> HighFidelityTrace {
        let mut run = Run::new(&self.actuator, &self.scenario, faults);
        let mut cascade = Cascade::new(&self.actuator, &self.scenario);
        let mut current_loop = CurrentLoop::new(&self.actuator, &self.scenario);
        let periods =
            libm::round(self.actuator.inverter.carrier_hz / self.actuator.controller.sample_hz);
        let mut trace = empty_trace(&self.actuator, self.command_rad.len());
        for &command_rad in &self.command_rad {
            run.refresh();
            run.record(command_rad, &mut trace);
            let surface_rad = run.train.surface_rad();
            let reference_a = cascade.step(command_rad, surface_rad, run.train.speed_rad_per_s);
            for _ in 0..periods as usize {
                let duty = current_loop.step(reference_a, run.follow.current_a(&run.currents_a));
                run.carrier_period(duty, current_loop.period_s);
            }
        }
        trace.segments = run.segments;
        trace
    }
}

/// A trace with room for its samples.
fn empty_trace(actuator: &Actuator, samples: usize) -> HighFidelityTrace {
    let room = || Vec::with_capacity(samples);
    HighFidelityTrace {
        rate_hz: actuator.controller.sample_hz,
        command_rad: room(),
        phase_currents_a: [room(), room(), room()],
        motor_angle_rad: room(),
        motor_speed_rad_per_s: room(),
        surface_angle_rad: room(),
        segments: 0,
    }
}

/// Digital current loop, sampled once a carrier period; its duty acts in the next period.
///
/// ```text
/// u = sat((K_p·e + x)/V_dc, 1)      x' = K_i·e, held while saturated
/// K_p = 2·L·ω_c,  K_i = 2·R·ω_c
/// ```
struct CurrentLoop {
    period_s: f64,
    gain: f64,
    integral_step: f64,
    per_bus_v: f64,
    integral_v: f64,
    pending_duty: f64,
    noise_half_width_a: f64,
    noise: NoiseSource,
}

/// Keeps the stream of the current's noise apart from the speed's.
const CURRENT_NOISE_STREAM: u64 = 0x9e37_79b9_7f4a_7c15;

impl CurrentLoop {
    fn new(actuator: &Actuator, scenario: &Scenario) -> Self {
        let inverter = &actuator.inverter;
        let bandwidth = core::f64::consts::TAU * inverter.current_bandwidth_hz;
        let period_s = 1.0 / inverter.carrier_hz;
        let noisy = scenario.imperfections.controller_noise;
        Self {
            period_s,
            gain: 2.0 * actuator.motor.inductance_henry * bandwidth,
            integral_step: 2.0 * actuator.motor.resistance_ohm * bandwidth * period_s,
            per_bus_v: 1.0 / inverter.bus_voltage_v,
            integral_v: 0.0,
            pending_duty: 0.0,
            noise_half_width_a: if noisy {
                actuator.sensing.current_noise_half_width_a
            } else {
                0.0
            },
            noise: NoiseSource::new(scenario.seed ^ CURRENT_NOISE_STREAM),
        }
    }

    /// One period: the duty to apply now, −1 to 1, computed from the period before.
    fn step(&mut self, reference_a: f64, current_a: f64) -> f64 {
        let mut measured_a = current_a;
        if self.noise_half_width_a > 0.0 {
            measured_a += self.noise_half_width_a * self.noise.symmetric();
        }
        let error = reference_a - measured_a;
        let wanted = (self.gain * error + self.integral_v) * self.per_bus_v;
        if wanted.abs() < 1.0 {
            self.integral_v += self.integral_step * error;
        }
        core::mem::replace(&mut self.pending_duty, wanted.clamp(-1.0, 1.0))
    }
}

/// What ends a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Event {
    /// The legs switch.
    Switching,
    /// The shaft comes to zero speed.
    Standstill,
    /// The shaft at rest breaks away.
    Breakaway(Direction),
    /// The rotor reaches the end of its sector.
    Sector(i64),
    /// The play closes, or a stop is met.
    Bound,
    /// The idle phase's current ends.
    FreewheelEnd,
}

/// State of a run.
struct Run {
    winding: Winding,
    train: DriveTrain,
    half_bus_v: f64,
    start_angle_rad: f64,
    currents_a: PerPhase,
    rotor: RotorAngle,
    /// Motor angles from the start between which the sector lasts.
    sector_rad: (f64, f64),
    follow: ContinuingPhase,
    segments: u64,
}

impl Run {
    fn new(actuator: &Actuator, scenario: &Scenario, faults: &PhysicalFaults) -> Self {
        let winding = Winding::new(&actuator.motor, faults);
        let start_angle_rad = scenario.start_angle_rad;
        let sector = Sector::of_electrical_angle(start_angle_rad * winding.pole_pairs());
        let mut run = Self {
            winding,
            train: DriveTrain::new(
                actuator,
                faults,
                scenario.load_n_m,
                scenario.backlash_side_ratio,
            ),
            half_bus_v: 0.5 * actuator.inverter.bus_voltage_v,
            start_angle_rad,
            currents_a: [0.0; 3],
            rotor: RotorAngle::new(start_angle_rad, sector),
            sector_rad: (0.0, 0.0),
            follow: ContinuingPhase::new(sector),
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

    fn record(&self, command_rad: f64, trace: &mut HighFidelityTrace) {
        trace.command_rad.push(command_rad);
        for (channel, current_a) in trace.phase_currents_a.iter_mut().zip(self.currents_a) {
            channel.push(current_a);
        }
        trace.motor_angle_rad.push(self.rotor.motor_rad);
        trace.motor_speed_rad_per_s.push(self.train.speed_rad_per_s);
        trace.surface_angle_rad.push(self.train.surface_rad());
    }

    fn enter(&mut self, sector: Sector) {
        self.rotor.sector = sector;
        self.follow.update(sector);
        self.sector_rad = sector.span_rad(self.winding.pole_pairs(), self.start_angle_rad);
    }

    /// One carrier period: the legs of the positive and the negative phase with duties
    /// `(1 ± u)/2`, both centred.
    fn carrier_period(&mut self, duty: f64, period_s: f64) {
        let (v, u) = (self.half_bus_v, duty.abs());
        let active = if duty < 0.0 { (-v, v) } else { (v, -v) };
        let (edge_s, active_s, centre_s) =
            (0.25 * (1.0 - u) * period_s, 0.5 * u * period_s, 0.5 * (1.0 - u) * period_s);
        self.hold(edge_s, (-v, -v));
        self.hold(active_s, active);
        self.hold(centre_s, (v, v));
        self.hold(active_s, active);
        self.hold(edge_s, (-v, -v));
    }

    /// Holds the legs of the positive and the negative phase at their potentials for a time.
    fn hold(&mut self, span_s: f64, legs_v: (f64, f64)) {
        let mut left_s = span_s;
        while left_s > 0.0 {
            let coupling = self.winding.coupling(&self.rotor);
            let sector = self.rotor.sector;
            let (p, n, idle) =
                (sector.positive_phase(), sector.negative_phase(), sector.idle_phase());
            let mut potential_v = [0.0; 3];
            (potential_v[p], potential_v[n]) = legs_v;
            let freewheel = self.freewheel(&coupling, &potential_v);
            potential_v[idle] = -freewheel * self.half_bus_v;
            let connection =
                if freewheel == 0.0 { Connection::Pair(p, n) } else { Connection::Three };
            let segment = Segment::solve(
                &self.winding,
                &self.train,
                &coupling,
                (connection, &potential_v),
                &self.currents_a,
            );
            let (event, at_s) = self.first_event(&segment, left_s, freewheel);
            self.commit(&segment, at_s);
            self.handle(event, &segment, at_s);
            left_s = if event == Event::Switching { 0.0 } else { left_s - at_s };
        }
    }

    /// Sign of the idle phase's current through its diodes, 0 when none conducts.
    ///
    /// A current that flows goes on; without one, a diode begins to conduct where the open
    /// terminal would leave the rails.
    fn freewheel(&self, coupling: &[[f64; 4]; 3], potential_v: &PerPhase) -> f64 {
        let sector = self.rotor.sector;
        let idle = sector.idle_phase();
        let current_a = self.currents_a[idle];
        if current_a != 0.0 {
            return current_a.signum();
        }
        let w = self.train.speed_rad_per_s;
        let emf_v = [coupling[0][0] * w, coupling[1][0] * w, coupling[2][0] * w];
        let star_v = self.winding.star_point_v(
            (sector.positive_phase(), sector.negative_phase()),
            potential_v,
            &self.currents_a,
            &emf_v,
        );
        let terminal_v = star_v + emf_v[idle];
        if terminal_v > self.half_bus_v {
            -1.0
        } else if terminal_v < -self.half_bus_v {
            1.0
        } else {
            0.0
        }
    }

    /// The first event within a span, and when.
    fn first_event(&self, segment: &Segment, span_s: f64, freewheel: f64) -> (Event, f64) {
        let mut first = (Event::Switching, span_s);
        let mut offer = |event, at_s: f64| {
            if at_s < first.1 {
                first = (event, at_s);
            }
        };
        if freewheel != 0.0 {
            let idle = &segment.currents[self.rotor.sector.idle_phase()];
            if value(idle, span_s) * freewheel <= 0.0 {
                offer(Event::FreewheelEnd, root(idle, span_s));
            }
        }
        if self.train.direction == Direction::Stuck {
            let (backward, forward) = self.train.breakaway_n_m();
            let torque = value(&segment.torque, span_s);
            if torque > forward {
                offer(
                    Event::Breakaway(Direction::Forward),
                    root(&less(&segment.torque, forward), span_s),
                );
            } else if torque < backward {
                offer(
                    Event::Breakaway(Direction::Backward),
                    root(&less(&segment.torque, backward), span_s),
                );
            }
            return first;
        }
        if value(&segment.speed, span_s) * self.train.direction.sign() <= 0.0 {
            offer(Event::Standstill, root(&segment.speed, span_s));
        }
        let from_rad = self.train.angle_rad;
        let to_rad = from_rad + value(&segment.turn, span_s);
        let (sector, bound) = (self.sector_rad, self.train.bounds_rad());
        let mut reach = |event, angle_rad: f64| {
            offer(event, root(&less(&segment.turn, angle_rad - from_rad), span_s));
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

    /// Moves the state along a segment.
    fn commit(&mut self, segment: &Segment, by_s: f64) {
        let sector = self.rotor.sector;
        let (p, n, idle) = (sector.positive_phase(), sector.negative_phase(), sector.idle_phase());
        self.currents_a[p] = value(&segment.currents[p], by_s);
        self.currents_a[idle] = value(&segment.currents[idle], by_s);
        self.currents_a[n] = -(self.currents_a[p] + self.currents_a[idle]);
        if self.train.direction != Direction::Stuck {
            self.train.speed_rad_per_s = value(&segment.speed, by_s);
            let turn_rad = value(&segment.turn, by_s);
            self.train.angle_rad += turn_rad;
            self.rotor.turn(turn_rad);
        }
        self.segments += 1;
    }

    fn handle(&mut self, event: Event, segment: &Segment, at_s: f64) {
        match event {
            Event::Switching => {}
            Event::Standstill => self.train.stand_still(value(&segment.torque, at_s)),
            Event::Breakaway(direction) => self.train.break_away(direction),
            Event::Sector(step) => {
                self.train.angle_rad = if step > 0 { self.sector_rad.1 } else { self.sector_rad.0 };
                self.enter(self.rotor.sector.shifted(step));
            }
            Event::Bound => {
                let (low, high) = self.train.bounds_rad();
                let forward = self.train.direction == Direction::Forward;
                self.train.angle_rad = if forward { high } else { low };
                self.train.reach_bound(value(&segment.torque, at_s));
            }
            Event::FreewheelEnd => {
                let sector = self.rotor.sector;
                self.currents_a[sector.idle_phase()] = 0.0;
                self.currents_a[sector.negative_phase()] =
                    -self.currents_a[sector.positive_phase()];
            }
        }
    }
}

/// A series less a constant.
fn less(series: &[f64; 5], by: f64) -> [f64; 5] {
    let mut shifted = *series;
    shifted[0] -= by;
    shifted
}
