//! The high-fidelity model: control electronics, inverter and machine in one test.

use core::ops::RangeInclusive;
use std::sync::Arc;

use crate::{
    controller::Cascade,
    current_loop::CurrentLoop,
    effect::{
        Effect, EffectError, EffectId, Geometry,
        capabilities::{Legs, ModelCapabilities, WindingModel},
        part::delay::HeldReference,
    },
    ended::Ended,
    energy::{EnergyLedger, EnergyProbe},
    engine::Run,
    extension::rescaling,
    fault::PhysicalFaults,
    field_oriented::FieldOriented,
    load::{Load, LoadRun},
    logger::{LoggedCurrents, Logger},
    params::{Actuator, BackEmfShape, Commutation},
    phase::PerPhase,
    probe::Probe,
    scenario::Scenario,
    shorted_turns::ShortedTurns,
    simulation_error::SimulationError,
    speed_guard::SpeedGuard,
    trace::HighFidelityTrace,
};

/// Ticks after which the rotor's sines are taken afresh; rotating them drifts by 1e-16 a tick.
const REFRESH_TICKS: usize = 64;

/// How the legs are switched.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum CurrentControl {
    /// Centre-aligned carrier with a synchronous current loop: the reference. Two legs are
    /// switched in a six-step drive, all three in a field-oriented one.
    Carrier,
    /// A comparator on each phase: its leg goes up when the current is a half-band below the
    /// set-point `I_ref·s_j`, down when it is one above. All three legs are always connected.
    ///
    /// The switching pattern, and with it the ripple, is chaotic in every parameter: only the
    /// filtered envelope means anything, and its derivatives in the fault levels do not.
    Hysteresis {
        /// Half of the comparators' band.
        half_band_a: f64,
    },
    /// The carrier without its ripple, in a field-oriented drive: each leg at its average over
    /// the period, and no dead time.
    Averaged,
}

/// The high-fidelity model of an actuator in one test.
///
/// Blocks as in Fig. 2 of the FREEDOM paper: control electronics, three-phase inverter with
/// carrier modulation and a synchronous current loop, electromagnetic model, motor and
/// transmission, load.
///
/// # Cost
///
/// About six segments a carrier period, no allocation inside the loop. Events are the switching
/// instants of the carrier, sector changes, the end of freewheeling, standstill and breakaway,
/// the play closing and the end stops; between events winding and shaft follow a Taylor series.
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
    control: CurrentControl,
    effects: Vec<Effect>,
    /// The legs' dead time, with the one that loses the voltage of effects on average.
    dead_s: f64,
    load: Arc<Load>,
}

const NAME: &str = "the high-fidelity model";

/// Carrier periods of a test, of some 0.3 µs each.
const MOST_PERIODS: f64 = 1e9;

/// Time before the end of a test at which a logger samples last, s: beyond rounding.
const LEAST_BEFORE_END_S: f64 = 1e-9;

/// Share of a carrier period that a dead time is at most.
const MOST_DEAD_RATIO: f64 = 0.1;

impl HighFidelity {
    /// Prepares a test.
    ///
    /// # Errors
    ///
    /// [`SimulationError`] for parameters or a test that cannot be simulated.
    pub fn new(actuator: &Actuator, scenario: &Scenario) -> Result<Self, SimulationError> {
        actuator.check()?;
        let longest_s = MOST_PERIODS / actuator.inverter.carrier_hz;
        let least_s = 1.0 / actuator.controller.sample_hz;
        in_range("scenario.duration-s", scenario.duration_s, least_s..=longest_s)?;
        let command_rad = scenario.sampled_command(actuator)?;
        Ok(Self {
            actuator: *actuator,
            scenario: scenario.clone(),
            command_rad,
            control: CurrentControl::Carrier,
            effects: Vec::new(),
            dead_s: actuator.inverter.dead_time_s,
            load: Arc::new(Load::None),
        })
    }

    /// Puts effects into the machine: those on circuit, commutation, sensors and an
    /// elastic shaft in their own places, torques held over each segment (`docs/models/effects.md`).
    ///
    /// # Errors
    ///
    /// [`SimulationError::Effect`] for an effect that this model cannot take.
    pub fn with_effects(mut self, effects: &[Effect]) -> Result<Self, SimulationError> {
        self.effects = effects.to_vec();
        self.check_effects()?;
        let lost_v = rescaling(effects).lost_v;
        self.dead_s = self.actuator.inverter.dead_time_s + lost_v / self.lost_v_per_s();
        Ok(self)
    }

    /// Refuses effects that have no place in this model.
    fn check_effects(&self) -> Result<(), EffectError> {
        let inverter = &self.actuator.inverter;
        let legs = match self.control {
            CurrentControl::Carrier => Legs::Switched {
                dead_s: inverter.dead_time_s,
                lost_v_per_s: self.lost_v_per_s(),
                most_dead_s: MOST_DEAD_RATIO / inverter.carrier_hz,
            },
            CurrentControl::Averaged => Legs::Averaged,
            CurrentControl::Hysteresis { .. } => Legs::Compared,
        };
        let trapezoidal = self.actuator.motor.back_emf_shape == BackEmfShape::Trapezoid;
        let winding = WindingModel::Phases { legs, trapezoidal };
        ModelCapabilities::of_actuator(NAME, &self.actuator, &self.scenario, winding)
            .check(&self.effects)?;
        let compliance = EffectId::Compliance;
        let springs = self.effects.iter().any(|effect| effect.id() == compliance);
        if springs && self.actuator.motor.shorted_turns != ShortedTurns::Removed {
            let reason = "with a `short-circuit` the surface goes with the motor";
            return Err(EffectError::NotInModel { effect: compliance, model: NAME, reason });
        }
        Ok(())
    }

    /// Mean voltage that the equivalent machine loses over the legs' dead time.
    ///
    /// Each of the two legs of a six-step drive loses `V_dc·t_d·f_c`; with three sinusoidal
    /// phases the equivalent machine loses `6/π` of what a leg does.
    fn lost_v_per_s(&self) -> f64 {
        let inverter = &self.actuator.inverter;
        let legs = match inverter.commutation {
            Commutation::SixStep => 2.0,
            Commutation::FieldOriented => 6.0 / core::f64::consts::PI,
        };
        legs * inverter.bus_voltage_v * inverter.carrier_hz
    }

    /// Puts a load besides the constant one on the surface.
    ///
    /// # Errors
    ///
    /// [`SimulationError::Scenario`] for a load out of bounds.
    pub fn with_load(mut self, load: Load) -> Result<Self, SimulationError> {
        load.check()?;
        self.load = Arc::new(load);
        Ok(self)
    }

    /// Switches the legs another way.
    ///
    /// # Errors
    ///
    /// [`SimulationError`] for a half-band that is not from 1 mA to 1000 A, for hysteresis control
    /// of a field-oriented drive and for averaged legs in a six-step one.
    pub fn with_current_control(
        mut self,
        control: CurrentControl,
    ) -> Result<Self, SimulationError> {
        if let CurrentControl::Hysteresis { half_band_a: value } = control {
            in_range("current-control.half-band-a", value, 1e-3..=1e3)?;
        }
        let other = |control, commutation| {
            Err(SimulationError::ControlOfOtherDrive { control, commutation })
        };
        match (control, self.actuator.inverter.commutation) {
            (CurrentControl::Hysteresis { .. }, Commutation::FieldOriented) => {
                return other("hysteresis", "field-oriented");
            }
            (CurrentControl::Averaged, Commutation::SixStep) => {
                return other("averaged", "six-step");
            }
            _ => {}
        }
        self.control = control;
        self.check_effects()?;
        Ok(self)
    }

    /// Takes another seed of the controller's noise.
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.scenario.seed = seed;
        self
    }

    /// Runs the test on an actuator with the given damage, to its end.
    ///
    /// # Errors
    ///
    /// [`SimulationError::Runaway`] for a shaft that is driven away.
    pub fn try_simulate(
        &self,
        faults: &PhysicalFaults,
    ) -> Result<HighFidelityTrace, SimulationError> {
        self.simulate(faults).whole()
    }

    /// Runs the test on an actuator with the given damage. Where the shaft is driven away the run
    /// ends at once: [`runaway`](field@HighFidelityTrace::runaway) says why, and the channels are
    /// NaN from there on; [`try_simulate`](Self::try_simulate) makes an error of it.
    pub fn simulate(&self, faults: &PhysicalFaults) -> HighFidelityTrace {
        self.observed(faults, ()).0
    }

    /// Runs the test and samples the phases at the instants of a logger besides: seconds from the
    /// start of the test, in ascending order, the last 1 ns before its end or more.
    ///
    /// # Errors
    ///
    /// [`SimulationError::Scenario`] for instants that are not in order or outside the test, and
    /// [`SimulationError::Runaway`] for a shaft that is driven away.
    ///
    /// # Examples
    ///
    /// ```
    /// use ema_sim::{HealthState, HighFidelity, Scenario, presets::EMA_48};
    ///
    /// let model = HighFidelity::new(&EMA_48, &Scenario::chirp())?;
    /// let instants_s: Vec<f64> = (0..12_000).map(|n| 33e-6 + f64::from(n) / 25e3).collect();
    /// let (_, logged) = model.simulate_logged(&(&HealthState::HEALTHY).into(), &instants_s)?;
    /// assert_eq!(logged.phase_currents_a[0].len(), 12_000);
    /// # Ok::<_, ema_sim::SimulationError>(())
    /// ```
    pub fn simulate_logged(
        &self,
        faults: &PhysicalFaults,
        instants_s: &[f64],
    ) -> Result<(HighFidelityTrace, LoggedCurrents), SimulationError> {
        let field = "logger.instants-s";
        let most_s = self.samples() as f64 / self.tick_hz() - LEAST_BEFORE_END_S;
        let mut least_s = 0.0;
        for &instant_s in instants_s {
            in_range(field, instant_s, least_s..=most_s)?;
            least_s = instant_s;
        }
        let logger = Logger::new(instants_s, self.scenario.start_angle_rad, self.tick_hz());
        let (trace, logger) = self.observed(faults, logger);
        let logged = logger.logged(trace.runaway.clone());
        Ok((trace.whole()?, logged))
    }

    /// Ticks of the controller in the test: samples of a trace.
    pub fn samples(&self) -> usize {
        self.command_rad.len()
    }

    /// Rate of the controller's ticks and of a trace, Hz.
    pub fn tick_hz(&self) -> f64 {
        self.actuator.controller.sample_hz
    }

    /// Runs the test and accounts for its energy, at about three times the cost.
    ///
    /// # Examples
    ///
    /// ```
    /// use ema_sim::{HealthState, HighFidelity, Scenario, presets::EMA_48};
    ///
    /// let model = HighFidelity::new(&EMA_48, &Scenario::chirp())?;
    /// let (_, energy) = model.simulate_with_ledger(&(&HealthState::HEALTHY).into());
    /// assert!(energy.residual_j().abs() < 1e-6 * energy.dissipated_j());
    /// # Ok::<_, ema_sim::SimulationError>(())
    /// ```
    pub fn simulate_with_ledger(
        &self,
        faults: &PhysicalFaults,
    ) -> (HighFidelityTrace, EnergyLedger) {
        let probe = EnergyProbe::new(&self.actuator, faults, 1.0);
        let (trace, probe) = self.observed(faults, probe);
        (trace, probe.ledger)
    }

    /// Runs the test with segments no longer than a share of what the series would allow: a
    /// check of [`simulate`](Self::simulate), with which it agrees up to the series' error.
    ///
    /// For the default actuator a share of 1/40 cuts segments about eight times finer.
    pub fn simulate_finer(
        &self,
        faults: &PhysicalFaults,
        longest_segment_ratio: f64,
    ) -> (HighFidelityTrace, EnergyLedger) {
        let probe = EnergyProbe::new(&self.actuator, faults, longest_segment_ratio);
        let (trace, probe) = self.observed(faults, probe);
        (trace, probe.ledger)
    }

    /// Runs machine and inverter without the control electronics: in each carrier period every
    /// leg, always connected, is at the upper rail for a share of it, about its middle.
    ///
    /// The run lasts as many periods as there are duties; scenario and trace are as ever, but for
    /// the command, which is zero.
    ///
    /// # Errors
    ///
    /// [`SimulationError`] for a duty outside 0 to 1, and for a shaft that is driven away.
    ///
    /// # Examples
    ///
    /// ```
    /// use ema_sim::{HealthState, HighFidelity, Scenario, presets::BENCH};
    ///
    /// // the three terminals joined: the rotor is braked
    /// let mut scenario = Scenario::sine();
    /// scenario.initial.motor_speed_rad_per_s = 100.0;
    /// let model = HighFidelity::new(&BENCH, &scenario)?;
    /// let trace = model.simulate_duties(&(&HealthState::HEALTHY).into(), &[[0.5; 3]; 200])?;
    /// assert!(trace.motor_speed_rad_per_s[99] < 90.0);
    /// # Ok::<_, ema_sim::SimulationError>(())
    /// ```
    pub fn simulate_duties(
        &self,
        faults: &PhysicalFaults,
        duties_frac: &[PerPhase],
    ) -> Result<HighFidelityTrace, SimulationError> {
        for duty in duties_frac.as_flattened() {
            in_range("duties.duty-frac", *duty, 0.0..=1.0)?;
        }
        let mut run = self.start(faults, (), true);
        let mut load = LoadRun::new(&self.load, self.scenario.load_n_m);
        let mut trace = empty_trace(&self.actuator, duties_frac.len() / self.periods());
        let period_s = 1.0 / self.actuator.inverter.carrier_hz;
        let (periods, mut now) = (self.periods(), [0.0; 3]);
        for (n, duties) in duties_frac.iter().enumerate() {
            let next = duties.map(|d| 2.0 * d - 1.0);
            if n == 0 {
                self.begin(&mut run, &next, period_s);
            } else {
                self.apply(&mut run, &now, &next, period_s);
            }
            if n % periods == 0 {
                run.centre_gap((n / periods) % REFRESH_TICKS == 0);
                self.load_and_show(&mut run, &mut load);
                run.record(0.0, &mut trace);
            }
            now = next;
            if run.guard.has_passed() {
                break;
            }
        }
        trace.segments = run.segments;
        trace.runaway = run.guard.told(&self.effects, Geometry::Rotary);
        trace.whole()
    }

    /// Runs the test with a probe on every segment.
    fn observed<P: Probe>(&self, faults: &PhysicalFaults, probe: P) -> (HighFidelityTrace, P) {
        let connected = self.actuator.inverter.commutation == Commutation::FieldOriented;
        let mut run = self.start(faults, probe, connected);
        let mut trace = empty_trace(&self.actuator, self.command_rad.len());
        match (self.actuator.inverter.commutation, self.control) {
            (Commutation::FieldOriented, _) => self.field_oriented(&mut run, &mut trace),
            (Commutation::SixStep, CurrentControl::Hysteresis { half_band_a }) => {
                let tick_s = 1.0 / self.actuator.controller.sample_hz;
                self.ticks(&mut run, &mut trace, |run, references| {
                    for held in references {
                        run.comparators(held.value, half_band_a, held.share * tick_s);
                    }
                    run.take_sample();
                    run.read_sensor(tick_s);
                });
            }
            (Commutation::SixStep, _) => self.six_step(&mut run, &mut trace),
        }
        trace.segments = run.segments;
        trace.runaway = run.guard.told(&self.effects, Geometry::Rotary);
        (trace.filled(self.command_rad.len()), run.probe)
    }

    /// The six-step drive under the carrier.
    fn six_step<P: Probe>(&self, run: &mut Run<P>, trace: &mut HighFidelityTrace) {
        let mut current_loop = CurrentLoop::new(&self.actuator, &self.scenario);
        let (periods, period_s) = (self.periods(), current_loop.period_s);
        let dead_s = self.dead_s;
        if dead_s == 0.0 {
            run.first_edge(period_s);
        }
        let bus_v = self.actuator.inverter.bus_voltage_v;
        let mut voltages_v = Vec::with_capacity(self.command_rad.len());
        self.ticks(run, trace, |run, references| {
            for period in 0..periods {
                let reference_a = reference_in(period, periods, &references);
                let duty = current_loop.step(reference_a, run.seen().feedback_a);
                if period == 0 {
                    voltages_v.push(duty * bus_v);
                }
                if dead_s == 0.0 {
                    run.carrier_period(duty, current_loop.pending_duty, period_s);
                } else {
                    run.pair_dead_period(duty, dead_s, period_s);
                }
                run.read_sensor(period_s);
            }
        });
        trace.motor_voltage_v = voltages_v;
    }

    /// The field-oriented drive under the carrier.
    fn field_oriented<P: Probe>(&self, run: &mut Run<P>, trace: &mut HighFidelityTrace) {
        let mut current_loop = FieldOriented::new(&self.actuator, &self.scenario);
        let (periods, period_s) = (self.periods(), current_loop.period_s);
        self.begin(run, &current_loop.pending, period_s);
        let mut voltages_v = Vec::with_capacity(self.command_rad.len());
        self.ticks(run, trace, |run, references| {
            for period in 0..periods {
                let reference_a = reference_in(period, periods, &references);
                if period == 0 {
                    voltages_v.push(current_loop.pending_q_v);
                }
                let motor_rad = self.scenario.start_angle_rad + run.sample.angle_rad;
                let duties = current_loop.step(reference_a, &run.seen().currents_a, motor_rad);
                self.apply(run, &duties, &current_loop.pending, period_s);
            }
        });
        trace.motor_voltage_v = voltages_v;
    }

    /// Holds the legs before the first period with all of them connected.
    fn begin<P: Probe>(&self, run: &mut Run<P>, duties: &PerPhase, period_s: f64) {
        let switched = self.control != CurrentControl::Averaged;
        if switched && self.dead_s == 0.0 {
            run.first_three_leg_edge(duties, period_s);
        }
    }

    /// One period with all legs connected, their averages −1 to 1 in it and in the next.
    fn apply<P: Probe>(
        &self,
        run: &mut Run<P>,
        duties: &PerPhase,
        next_duties: &PerPhase,
        period_s: f64,
    ) {
        let dead_s = self.dead_s;
        if self.control == CurrentControl::Averaged {
            run.averaged_period(duties, period_s);
        } else if dead_s == 0.0 {
            run.three_leg_period(duties, next_duties, period_s);
        } else {
            run.three_leg_dead_period(duties, dead_s, period_s);
        }
        run.read_sensor(period_s);
    }

    /// The machine, with its effects, at the start of the test.
    fn start<P: Probe>(&self, faults: &PhysicalFaults, probe: P, connected: bool) -> Run<P> {
        let actuator = self.actuator.rescaled(&rescaling(&self.effects));
        let mut run = Run::new(&actuator, &self.scenario, faults, probe, connected);
        run.add_effects(&actuator, faults, &self.effects);
        run.guard = SpeedGuard::of_actuator(&actuator, &self.scenario, faults, &self.load);
        run
    }

    /// The load of the next tick, and what the position sensor shows in it.
    fn load_and_show<P: Probe>(&self, run: &mut Run<P>, load: &mut LoadRun) {
        if load.varies() {
            run.take_load(load, 1.0 / self.actuator.controller.sample_hz);
        }
        run.show_surface();
    }

    /// Carrier periods in a tick of the controller.
    fn periods(&self) -> usize {
        libm::round(self.actuator.inverter.carrier_hz / self.actuator.controller.sample_hz) as usize
    }

    /// Each tick of the controller: its sample is recorded, the cascade asks for a current, and
    /// `hold` applies it, or with a delay two of them by their shares of the tick, until the
    /// next one.
    fn ticks<P: Probe>(
        &self,
        run: &mut Run<P>,
        trace: &mut HighFidelityTrace,
        mut hold: impl FnMut(&mut Run<P>, [HeldReference; 2]),
    ) {
        let actuator = self.actuator.rescaled(&rescaling(&self.effects));
        let mut cascade = Cascade::new(&actuator, &self.scenario);
        let mut load = LoadRun::new(&self.load, self.scenario.load_n_m);
        for (tick, &command_rad) in self.command_rad.iter().enumerate() {
            let afresh = tick % REFRESH_TICKS == 0;
            run.centre_gap(afresh);
            if afresh {
                run.look_at_speed(tick as f64 / actuator.controller.sample_hz);
            }
            self.load_and_show(run, &mut load);
            run.record(command_rad, trace);
            let reference_a = cascade.step(command_rad, &run.sample.measured());
            let references = run.delayed(reference_a);
            hold(run, references);
            if run.guard.has_passed() {
                break;
            }
        }
    }
}

/// Requires `least ≤ value ≤ most`.
fn in_range(
    field: &'static str,
    value: f64,
    bounds: RangeInclusive<f64>,
) -> Result<(), SimulationError> {
    if bounds.contains(&value) {
        Ok(())
    } else {
        let (least, most) = bounds.into_inner();
        Err(SimulationError::Scenario { field, value, least, most })
    }
}

/// The set-point in a carrier period of a tick: the older of two as long as its share lasts.
fn reference_in(period: usize, periods: usize, references: &[HeldReference; 2]) -> f64 {
    let older = (period as f64 + 0.5) < references[0].share * periods as f64;
    references[usize::from(!older)].value
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
        motor_voltage_v: Vec::new(),
        segments: 0,
        runaway: None,
    }
}
