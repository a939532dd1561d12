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
//! `2·R_p` and the staircase (`shape_function`), and a term of its current loop, so that the
//! current follows the set-point and answers what unequal phases do (`plant/quadrature_loop.rs`). The two shape functions follow from the torque
//! of the conducting pair; the paper names but does not print its own (`docs/paper-ledger.md`,
//! eqs 18-19).
//!
//! # Source
//!
//! FREEDOM paper, eqs 18 and 19; see `docs/models/low-fidelity.md`.

mod batch;

use std::sync::Arc;

use crate::{
    controller::{Cascade, Measured},
    effect::{
        Effect, Geometry, MachineScales,
        capabilities::{ModelCapabilities, WindingModel},
    },
    ended::Ended,
    extension::rescaling,
    fault::PhysicalFaults,
    load::Load,
    params::Actuator,
    plant::{Additions, Run},
    runaway::Runaway,
    scenario::Scenario,
    simulation_error::SimulationError,
    trace::LowFidelityTrace,
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
    scenario: Arc<Scenario>,
    command_rad: Arc<[f64]>,
    effects: Vec<Effect>,
    load: Arc<Load>,
    finer: f64,
}

impl LowFidelity {
    /// Prepares a test.
    ///
    /// # Errors
    ///
    /// [`SimulationError`] for parameters or a test that cannot be simulated.
    pub fn new(actuator: &Actuator, scenario: &Scenario) -> Result<Self, SimulationError> {
        actuator.check()?;
        let command_rad = scenario.sampled_command(actuator)?.into();
        Ok(Self {
            actuator: *actuator,
            scenario: Arc::new(scenario.clone()),
            command_rad,
            effects: Vec::new(),
            load: Arc::new(Load::None),
            finer: 1.0,
        })
    }

    /// Takes the test, with its effects and its load, to another actuator; the sampled command and
    /// the load are shared.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new), and as [`with_effects`](Self::with_effects) for effects taken on.
    pub fn on_actuator(&self, actuator: &Actuator) -> Result<Self, SimulationError> {
        actuator.check()?;
        let sampled = |of: &Actuator| (of.controller.sample_hz, of.transmission.stop_rad);
        let command_rad = if sampled(actuator) == sampled(&self.actuator) {
            Arc::clone(&self.command_rad)
        } else {
            self.scenario.sampled_command(actuator)?.into()
        };
        Self { actuator: *actuator, command_rad, ..self.clone() }.with_effects(&self.effects)
    }

    /// Takes the test to another constant load on the surface.
    ///
    /// # Errors
    ///
    /// [`SimulationError::Scenario`] for a load out of bounds.
    pub fn under_constant_load(mut self, load_n_m: f64) -> Result<Self, SimulationError> {
        Scenario::check_load(load_n_m)?;
        Arc::make_mut(&mut self.scenario).load_n_m = load_n_m;
        Ok(self)
    }

    /// Puts effects into the machine.
    ///
    /// # Errors
    ///
    /// [`SimulationError::Effect`] for an effect that this model cannot take.
    pub fn with_effects(mut self, effects: &[Effect]) -> Result<Self, SimulationError> {
        let (name, winding) = ("the low-fidelity model", WindingModel::Quasistatic);
        ModelCapabilities::of_actuator(name, &self.actuator, &self.scenario, winding)
            .check(effects)?;
        self.effects = effects.to_vec();
        Ok(self)
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

    /// Rate of the controller, and of all signals.
    #[cfg(feature = "model-file")]
    pub(crate) fn rate_hz(&self) -> f64 {
        self.actuator.controller.sample_hz
    }

    /// Scales of the machine in a run of the test.
    pub fn scales(&self, trace: &LowFidelityTrace) -> MachineScales {
        let rms = |values: &[f64]| {
            (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
        };
        let steps = trace.motor_angle_rad.windows(2);
        let speeds: Vec<f64> = steps.map(|pair| (pair[1] - pair[0]) * trace.rate_hz).collect();
        let angles = trace.motor_angle_rad.iter();
        let [least, most] =
            angles.fold([0.0, 0.0], |[least, most]: [f64; 2], &x| [least.min(x), most.max(x)]);
        let (motor_travel, drive) = (0.5 * (most - least), rms(&trace.current_a));
        MachineScales {
            torque: drive * self.actuator.motor.back_emf_v_s_per_rad,
            drive,
            speed: rms(&speeds),
            travel: motor_travel / self.actuator.transmission.gear_ratio,
            motor_travel,
            sample_s: 1.0 / trace.rate_hz,
        }
    }

    /// Cuts segments to a share of their length, rounded up to whole parts: of
    /// the controller's tick, or of what effects are held over (`docs/models/effects.md`). A check
    /// of [`simulate`](Self::simulate), with which it agrees up to the series' error.
    #[must_use]
    pub fn with_finer_segments(mut self, longest_segment_ratio: f64) -> Self {
        self.finer = longest_segment_ratio.clamp(1e-4, 1.0);
        self
    }

    /// Turns the rotor at the start.
    pub fn turn_to(&mut self, start_angle_rad: f64) {
        Arc::make_mut(&mut self.scenario).start_angle_rad = start_angle_rad;
    }

    /// Runs the test on an actuator with the given damage, to its end.
    ///
    /// # Errors
    ///
    /// [`SimulationError::Runaway`] for a shaft that is driven away.
    pub fn try_simulate(
        &self,
        faults: &PhysicalFaults,
    ) -> Result<LowFidelityTrace, SimulationError> {
        self.simulate(faults).whole()
    }

    /// Runs the test on an actuator with the given damage. Where the shaft is driven away the run
    /// ends at once: [`runaway`](field@LowFidelityTrace::runaway) says why, and the channels are
    /// NaN from there on; [`try_simulate`](Self::try_simulate) makes an error of it.
    pub fn simulate(&self, faults: &PhysicalFaults) -> LowFidelityTrace {
        let room = || Vec::with_capacity(self.command_rad.len());
        let mut trace = LowFidelityTrace {
            rate_hz: self.actuator.controller.sample_hz,
            current_a: room(),
            motor_angle_rad: room(),
            motor_speed_rad_per_s: room(),
            surface_angle_rad: room(),
            segments: 0,
            runaway: None,
        };
        (trace.segments, trace.runaway) = self.run(faults, |run, surface_rad| {
            trace.current_a.push(run.shown_current_a());
            trace.motor_angle_rad.push(run.start_angle_rad + run.train.angle_rad);
            trace.motor_speed_rad_per_s.push(run.train.speed_rad_per_s);
            trace.surface_angle_rad.push(surface_rad);
        });
        trace.filled(self.command_rad.len())
    }

    /// Runs the test for its current alone, into a buffer of the caller's; NaN from where the
    /// shaft is driven away.
    pub fn simulate_current(&self, faults: &PhysicalFaults, current_a: &mut Vec<f64>) {
        current_a.clear();
        current_a.reserve(self.command_rad.len());
        self.run(faults, |run, _| current_a.push(run.shown_current_a()));
        current_a.resize(self.command_rad.len(), f64::NAN);
    }

    /// Set-points of the controller, A, at each tick of the test when its sensors show the
    /// motor and the surface of a trace, simulated or recorded: the loop cut open. Of a trace of
    /// this very test it is, in six steps, the current that the next tick begins with, unless the
    /// supply cannot drive it; of a field-oriented drive what its current loop drives to. A trace that ends before the test is replayed to its end.
    pub fn replayed_current_a(&self, trace: &LowFidelityTrace) -> Vec<f64> {
        let actuator = self.actuator.rescaled(&rescaling(&self.effects));
        let mut cascade = Cascade::new(&actuator, &self.scenario);
        let motor = trace.motor_angle_rad.iter().zip(&trace.motor_speed_rad_per_s);
        let seen = motor.zip(&trace.surface_angle_rad);
        let tick = |(&command_rad, ((angle_rad, &speed_rad_per_s), &surface_rad))| {
            let motor_rad = angle_rad - self.scenario.start_angle_rad;
            cascade.step(command_rad, &Measured { surface_rad, motor_rad, speed_rad_per_s })
        };
        self.command_rad.iter().zip(seen).map(tick).collect()
    }

    /// Runs the test, showing state and measured surface at each tick; returns the segments
    /// taken, and why it ended early.
    fn run(
        &self,
        faults: &PhysicalFaults,
        mut show: impl FnMut(&mut Run, f64),
    ) -> (u64, Option<Runaway>) {
        let actuator = self.actuator.rescaled(&rescaling(&self.effects));
        let additions = Additions { effects: &self.effects, load: &self.load, finer: self.finer };
        let mut run = Run::new(&actuator, &self.scenario, faults, &additions);
        let mut cascade = Cascade::new(&actuator, &self.scenario);
        let tick_s = 1.0 / actuator.controller.sample_hz;
        for (tick, &command_rad) in self.command_rad.iter().enumerate() {
            run.begin_tick(tick, tick_s);
            let surface_rad = run.shown_surface_rad();
            show(&mut run, surface_rad);
            let measured = Measured {
                surface_rad,
                motor_rad: run.train.angle_rad,
                speed_rad_per_s: run.train.speed_rad_per_s,
            };
            let reference_a = cascade.step(command_rad, &measured);
            run.advance(reference_a, tick_s);
            if run.guard.has_passed() {
                break;
            }
        }
        (run.segments, run.guard.told(&self.effects, Geometry::Rotary))
    }
}
