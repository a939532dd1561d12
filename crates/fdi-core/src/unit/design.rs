//! Machines drawn over damage and tolerances: what the error of the low-fidelity model on a unit
//! that differs from its model file is learnt on.

use std::f64::consts::TAU;

use ema_sim::{Actuator, HighFidelity, Imperfections, PhysicalFaults, Scenario, SimulationError};

use crate::{
    offline::bundle::StartAngle,
    seed::{Draws, Purpose, RootSeed},
    simulation::experiment::Experiment,
    statistics::parallel::in_parallel,
    unit::{
        layout::{Acts, Layout, Scatter, thermal_ratios},
        quantities::UnitMachine,
    },
};

/// Machines drawn for a start of the rotor.
pub(crate) const UNITS: usize = 800;
/// Shares of the tolerances that units are drawn with, in turn: from nearly the model file's
/// machine to beyond its tolerances.
const SHARES: [f64; 5] = [0.1, 0.4, 1.0, 1.0, 1.2];
/// Largest level of damage drawn.
const MOST_DAMAGE: f64 = 0.06;
/// Chance that a unit has a fault.
const FAULT_CHANCE: f64 = 0.35;
/// Standard deviations beyond which no number is drawn.
const FARTHEST: f64 = 2.5;

/// A unit: its unknowns, its start and the seed of its controller's noise.
#[derive(Clone, Debug)]
pub(crate) struct Unit {
    pub(crate) point: Vec<f64>,
    pub(crate) start_angle_rad: f64,
    noise_seed: u64,
}

/// Session in which a unit is recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Session {
    First,
    /// Another day of the first units: the numbers as built and the damage are the same.
    Second,
    /// The first day again: the drive's noise alone is another.
    Again,
    /// The second day, the damage not there yet.
    Undamaged,
}

/// Units that are recorded on another day, and of those on the first day again and without damage.
const TWICE: usize = 200;
const AGAIN: usize = 100;

/// Draws units in a session.
pub(crate) fn draw(
    experiment: &Experiment,
    layout: &Layout,
    start: StartAngle,
    session: Session,
    root: RootSeed,
) -> Vec<Unit> {
    let one = |index: usize| {
        let stream = ((start as u64) << 32) | index as u64;
        let mut random = Draws::new(root.derive(Purpose::Units, stream));
        let share = SHARES[index % SHARES.len()];
        let mut point = vec![0.0; layout.len()];
        for (place, &coordinate) in layout.sought.iter().enumerate() {
            let (is_there, level) = (random.uniform() < FAULT_CHANCE, random.uniform());
            let signed = if coordinate < 5 { level } else { 2.0 * level - 1.0 };
            let is_there = is_there && session != Session::Undamaged;
            point[place] = if is_there { MOST_DAMAGE * signed } else { 0.0 };
        }
        let second = RootSeed(root.derive(Purpose::Units, (1 << 40) | stream));
        let day = match session {
            Session::First | Session::Again => 0,
            Session::Second | Session::Undamaged => 1,
        };
        let mut of_session = Draws::new(second.derive(Purpose::Units, day));
        for (value, number) in point[layout.sought.len()..].iter_mut().zip(&layout.numbers) {
            let Scatter { machine, session, recording } = number.scatter;
            let day = session.hypot(recording) * of_session.normal_within(FARTHEST);
            *value = share * (machine * random.normal_within(FARTHEST) + day);
        }
        let start_angle_rad = match start {
            StartAngle::Zero => experiment.scenario.start_angle_rad,
            StartAngle::Any => TAU * random.uniform(),
        };
        let recorded = ((1 + session as u64) << 48) | stream;
        let noise_seed = root.derive(Purpose::ControllerNoise, recorded);
        Unit { point, start_angle_rad, noise_seed }
    };
    let units = match session {
        Session::First => UNITS,
        Session::Second => TWICE,
        Session::Again | Session::Undamaged => AGAIN,
    };
    (0..units).map(one).collect()
}

/// A unit in high fidelity, sensors of the current without error.
#[derive(Clone, Debug)]
pub(crate) struct SimulatedUnit {
    /// Filtered envelope, A.
    pub(crate) signal_a: Vec<f64>,
    /// Filtered voltage of the motor as it is measured, V; `None` where the drive's current loop makes none.
    pub(crate) voltage_v: Option<Vec<f64>>,
}

/// Units in high fidelity.
pub(crate) fn simulated(
    experiment: &Experiment,
    layout: &Layout,
    units: &[Unit],
    jobs: usize,
) -> Result<Vec<SimulatedUnit>, SimulationError> {
    let one = |_: usize, unit: &Unit| -> Result<SimulatedUnit, SimulationError> {
        let machine = built(experiment, layout, &unit.point);
        let scenario = Scenario {
            imperfections: Imperfections::REAL,
            seed: unit.noise_seed,
            ..machine.scenario
        };
        let scenario = scenario.turned_to(unit.start_angle_rad);
        let model = HighFidelity::new(&machine.actuator, &scenario)?;
        let model = model.with_effects(&experiment.effects)?;
        let trace = model.simulate(&machine.faults);
        let envelope_a = trace.envelope_a(experiment.envelope, machine.actuator.motor.pole_pairs);
        let filtered = |channel: &[f64]| experiment.filter.apply(channel, trace.rate_hz);
        let has_voltage = !trace.motor_voltage_v.is_empty();
        let gains = layout.at(&unit.point).filter(|(one, _)| matches!(one.acts, Acts::VoltageGain));
        let gain: f64 = gains.map(|(_, value)| 1.0 + value).product();
        let measured = || trace.motor_voltage_v.iter().map(|v| gain * v).collect::<Vec<_>>();
        let voltage_v = has_voltage.then(|| filtered(&measured()));
        Ok(SimulatedUnit { signal_a: filtered(&envelope_a), voltage_v })
    };
    in_parallel(units, jobs, one)
}

/// The machine at a point of the unknowns, each number where it belongs.
pub(crate) fn built(experiment: &Experiment, layout: &Layout, point: &[f64]) -> UnitMachine {
    let mut actuator: Actuator = experiment.actuator;
    let mut scenario = experiment.scenario.clone();
    let mut faults = PhysicalFaults::from(&layout.damage(point));
    let (mut cos, mut sin) = (0.0, 0.0);
    for (number, value) in layout.at(point) {
        let ratio = 1.0 + value;
        if let Acts::Other(parameter) = number.acts {
            let value = parameter.get(&actuator) * ratio;
            parameter.set(&mut actuator, value);
        }
        let (motor, transmission) = (&mut actuator.motor, &mut actuator.transmission);
        match number.acts {
            Acts::TorqueConstant => motor.back_emf_v_s_per_rad *= ratio,
            Acts::MotorInertia => motor.inertia_kg_m2 *= ratio,
            Acts::Viscous => motor.viscous_n_m_s_per_rad *= ratio,
            Acts::SurfaceInertia => transmission.surface_inertia_kg_m2 *= ratio,
            Acts::DryFriction => {
                transmission.kinetic_friction_n_m *= ratio;
                transmission.static_friction_n_m *= ratio;
            }
            Acts::StaticOverKinetic => transmission.static_friction_n_m *= ratio,
            Acts::SurfaceFriction => transmission.surface_friction_n_m *= ratio,
            Acts::Play => transmission.backlash_rad *= ratio,
            Acts::Efficiency => {
                transmission.efficiency_ratio = (transmission.efficiency_ratio * ratio).min(1.0);
            }
            Acts::Load => scenario.load_n_m += value,
            Acts::Turns(phase) => faults.healthy_turns_frac[phase] *= ratio,
            Acts::EccentricityCos => cos += value,
            Acts::EccentricitySin => sin += value,
            Acts::PhaseGain(_)
            | Acts::PhaseOffset(_)
            | Acts::VoltageGain
            | Acts::Temperature
            | Acts::Coefficient(_)
            | Acts::Other(_) => {}
        }
    }
    let warm = thermal_ratios(experiment.temperature.as_ref(), layout.at(point));
    let [back_emf, resistance, dry_friction, viscous] = warm;
    actuator.motor.back_emf_v_s_per_rad *= back_emf;
    actuator.motor.resistance_ohm *= resistance;
    actuator.motor.viscous_n_m_s_per_rad *= viscous;
    actuator.transmission.kinetic_friction_n_m *= dry_friction;
    actuator.transmission.static_friction_n_m *= dry_friction;
    faults.eccentricity_cos += cos;
    faults.eccentricity_sin += sin;
    let transmission = &mut actuator.transmission;
    transmission.static_friction_n_m =
        transmission.static_friction_n_m.max(transmission.kinetic_friction_n_m);
    UnitMachine { actuator, faults, scenario }
}
