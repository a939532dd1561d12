//! Quantities that the current of a machine shows.
//!
//! Torques over the torque constant are all that a current shows of either: a machine whose torque
//! constant, inertias, frictions and load are all scaled alike draws the same current, three equal
//! shorts are a weaker torque constant, and a wear of friction is a tolerance of friction. With
//!
//! ```text
//! n_j = ln(1 − k_j) + ln(1 + t_j)  turns of phase j, t_j their mismatch as built
//! n̄   = (n_A + n_B + n_C)/3
//! κ   = ln(k_e/k_e0) + n̄         logarithm of the torque constant over its nominal value
//! ```
//!
//! the quantities are
//!
//! ```text
//! ln F/F₀ + ln(1 + 2·k1) − κ      ln F_s/F_k      ln c/c₀ − κ      ln J_m/J_m0 − κ
//! ln J_u/J_u0 − κ      M·e^(−κ)      ln F_u/F_u0 − κ      (b/b₀)·(1 + 99·k2)
//! n_A − n̄      n_B − n̄      ζ·cos φ      ζ·sin φ      ln η/η₀
//! ```
//!
//! with the temperature of the winding in `k_e`, `F` and `c`, and any other parameter with a tolerance. What is a function of these alone, the signal and its
//! learnt error, cannot tell apart what the current does not tell apart.
//!
//! # Source
//!
//! Equation of motion of the drive, `docs/models/low-fidelity.md`; derived in
//! `docs/models/units.md`.

use ema_sim::{
    Actuator, FAULT_COUNT, FaultCoordinates, LowFidelity, Parameter, PhysicalFaults, Scenario,
    TemperatureLaw, ThermalNumber,
};
use inference::central_differences;

use crate::{
    simulation::experiment::Experiment,
    unit::layout::{Acts, Layout, thermal_ratios},
};

/// Logarithms that the motor's voltage shows: torque constant, resistance, imbalances of A and B.
pub(crate) type VoltageNumbers = [f64; 4];

/// Places of the quantities.
const FRICTION: usize = 0;
const STATIC_OVER_KINETIC: usize = 1;
const VISCOUS: usize = 2;
const MOTOR_INERTIA: usize = 3;
const SURFACE_INERTIA: usize = 4;
const LOAD: usize = 5;
const SURFACE_FRICTION: usize = 6;
const PLAY: usize = 7;
const IMBALANCE_A: usize = 8;
const IMBALANCE_B: usize = 9;
const ECCENTRICITY_COS: usize = 10;
const ECCENTRICITY_SIN: usize = 11;
const EFFICIENCY: usize = 12;
/// Quantities before those of other parameters.
const FIXED: usize = 13;

/// Least share of turns, friction and play: below, a machine has no equation.
const LEAST_RATIO: f64 = 0.01;
/// Relative change of a parameter that a test is asked about.
const SHOWN_STEP: f64 = 0.05;
/// Change of the current, over its limit, from which a test shows a parameter.
const SHOWN_SHARE: f64 = 1e-5;
/// Difference for the closed form's derivatives.
const STEP: f64 = 1e-6;

/// Quantities in which the error of the low-fidelity model bends.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Bent {
    /// Quantities that damage moves.
    pub(crate) damage: Vec<usize>,
    /// Imbalances of phases A and B.
    pub(crate) imbalance: Option<[usize; 2]>,
    /// Play over that as built.
    pub(crate) play: Option<usize>,
}

/// From unknowns to quantities, and from quantities to a machine.
#[derive(Clone, Debug)]
pub(crate) struct Quantities {
    layout: Layout,
    load_n_m: f64,
    temperature: Option<TemperatureLaw>,
    others: Vec<&'static Parameter>,
    /// Quantities that a test of this machine can show.
    shown: Vec<usize>,
}

impl Quantities {
    pub(crate) fn new(experiment: &Experiment) -> Self {
        let layout = Layout::of(experiment);
        let mut others: Vec<&'static Parameter> = Vec::new();
        for number in &layout.numbers {
            let moved = match number.acts {
                Acts::Other(parameter) => Some(parameter),
                // what follows the temperature beside the quantities
                Acts::Temperature => Some(&Parameter::RESISTANCE),
                _ => None,
            };
            others.extend(moved.filter(|parameter| !others.contains(parameter)));
        }
        let others = shown_of(experiment, others);
        let mut quantities = Self {
            load_n_m: experiment.scenario.load_n_m,
            temperature: experiment.temperature,
            shown: Vec::new(),
            others,
            layout,
        };
        let origin = vec![0.0; quantities.layout.len()];
        let moved = quantities.all_slopes(&origin);
        quantities.shown = (0..FIXED + quantities.others.len())
            .filter(|&place| moved.iter().any(|slopes| slopes[place] != 0.0))
            .filter(|&place| !is_absent(experiment, place))
            .collect();
        quantities
    }

    pub(crate) fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Names of all that a signal shows, in the order of [`shown_at`](Self::shown_at).
    pub(crate) fn names(&self) -> Vec<&str> {
        let fixed = [
            "friction",
            "static-over-kinetic",
            "viscous",
            "motor-inertia",
            "surface-inertia",
            "load",
            "surface-friction",
            "play",
            "imbalance-a",
            "imbalance-b",
            "eccentricity-cos",
            "eccentricity-sin",
            "efficiency",
        ];
        let others = self.others.iter().map(|parameter| parameter.key());
        let all: Vec<&str> = fixed.into_iter().chain(others).collect();
        let of_sensors = self.layout.numbers.iter().filter(|number| number.acts.is_of_sensor());
        let shown = self.shown.iter().map(|&place| all[place]);
        shown.chain(of_sensors.map(|number| number.key.as_str())).collect()
    }

    /// Quantities that some unknown moves.
    pub(crate) fn len(&self) -> usize {
        self.shown.len()
    }

    /// The quantities at a point of the unknowns.
    pub(crate) fn at(&self, point: &[f64]) -> Vec<f64> {
        let all = self.all_at(point);
        self.shown.iter().map(|&place| all[place]).collect()
    }

    /// The quantities of the machine of the model file.
    pub(crate) fn nominal(&self) -> Vec<f64> {
        self.at(&vec![0.0; self.layout.len()])
    }

    /// Places of the quantities that damage moves, among those that some unknown moves.
    pub(crate) fn bent(&self) -> Bent {
        let place = |of: usize| self.shown.iter().position(|&shown| shown == of);
        let damage = [FRICTION, PLAY, IMBALANCE_A, IMBALANCE_B, ECCENTRICITY_COS, ECCENTRICITY_SIN];
        let imbalance = place(IMBALANCE_A).zip(place(IMBALANCE_B)).map(|(a, b)| [a, b]);
        Bent {
            damage: damage.into_iter().filter_map(place).collect(),
            imbalance,
            play: place(PLAY),
        }
    }

    /// Derivatives of the quantities, one row an unknown.
    pub(crate) fn slopes(&self, point: &[f64]) -> Vec<Vec<f64>> {
        let pick = |row: Vec<f64>| self.shown.iter().map(|&place| row[place]).collect();
        self.all_slopes(point).into_iter().map(pick).collect()
    }

    /// All that a signal shows at a point: the quantities, then the errors of the sensors.
    pub(crate) fn shown_at(&self, point: &[f64]) -> Vec<f64> {
        let mut shown = self.at(point);
        let of_sensors = self.layout.at(point).filter(|(number, _)| number.acts.is_of_sensor());
        shown.extend(of_sensors.map(|(_, value)| value));
        shown
    }

    /// Derivatives of all that a signal shows, one row an unknown.
    pub(crate) fn shown_slopes(&self, point: &[f64]) -> Vec<Vec<f64>> {
        let damage = self.layout.sought.len();
        let numbers = &self.layout.numbers;
        let sensors: Vec<usize> =
            (0..numbers.len()).filter(|&n| numbers[n].acts.is_of_sensor()).collect();
        let mut slopes = self.slopes(point);
        for (unknown, row) in slopes.iter_mut().enumerate() {
            row.extend(sensors.iter().map(|n| if damage + n == unknown { 1.0 } else { 0.0 }));
        }
        slopes
    }

    /// Numbers that the motor's voltage shows at a point: the logarithms of torque constant and
    /// resistance over their nominal values, each with the phases' mean turns and the gain of the
    /// voltage's measurement, and the imbalances of phases A and B. A resistance is voltage over
    /// measured current, so that the mean gain of the current's sensors is in it too.
    pub(crate) fn volts_at(&self, point: &[f64]) -> VoltageNumbers {
        let damage = self.layout.damage(point).0;
        let mut turns = [2, 3, 4].map(|place| (1.0 - damage[place]).max(LEAST_RATIO).ln());
        let warm = thermal_ratios(self.temperature.as_ref(), self.layout.at(point)).map(f64::ln);
        let mut torque_constant = warm[ThermalNumber::BackEmf as usize];
        let mut resistance = warm[ThermalNumber::Resistance as usize];
        for (number, value) in self.layout.at(point) {
            let log = (LEAST_RATIO - 1.0).max(value).ln_1p();
            match number.acts {
                Acts::TorqueConstant => torque_constant += log,
                Acts::Other(parameter) if *parameter == Parameter::RESISTANCE => resistance += log,
                Acts::Turns(phase) => turns[phase] += log,
                Acts::VoltageGain => {
                    torque_constant += log;
                    resistance += log;
                }
                Acts::PhaseGain(_) => resistance -= value / 3.0,
                _ => {}
            }
        }
        let mean = turns.iter().sum::<f64>() / 3.0;
        [torque_constant + mean, resistance + mean, turns[0] - mean, turns[1] - mean]
    }

    /// Mean gain of the current's sensors at a point, less one.
    pub(crate) fn mean_phase_gain(&self, point: &[f64]) -> f64 {
        let numbers = self.layout.at(point);
        numbers
            .filter(|(one, _)| matches!(one.acts, Acts::PhaseGain(_)))
            .map(|(_, g)| g / 3.0)
            .sum()
    }

    /// Derivatives of the numbers that the motor's voltage shows, one row an unknown.
    pub(crate) fn volts_slopes(&self, point: &[f64]) -> Vec<Vec<f64>> {
        central_differences(point, STEP, |moved| self.volts_at(moved).to_vec())
    }

    fn all_slopes(&self, point: &[f64]) -> Vec<Vec<f64>> {
        central_differences(point, STEP, |moved| self.all_at(moved))
    }

    fn all_at(&self, point: &[f64]) -> Vec<f64> {
        let damage = self.layout.damage(point).0;
        let mut turns = [2, 3, 4].map(|place| (1.0 - damage[place]).max(LEAST_RATIO).ln());
        let mut all = vec![0.0; FIXED + self.others.len()];
        let (mut torque_constant, mut load_n_m) = (0.0, self.load_n_m);
        let mut play_as_built = 0.0;
        all[FRICTION] = (1.0 + 2.0 * damage[0]).max(LEAST_RATIO).ln();
        all[ECCENTRICITY_COS] = damage[5];
        all[ECCENTRICITY_SIN] = damage[6];
        let warm = thermal_ratios(self.temperature.as_ref(), self.layout.at(point)).map(f64::ln);
        torque_constant += warm[ThermalNumber::BackEmf as usize];
        all[FRICTION] += warm[ThermalNumber::DryFriction as usize];
        all[VISCOUS] += warm[ThermalNumber::Viscous as usize];
        if let Some(place) = self.others.iter().position(|other| **other == Parameter::RESISTANCE) {
            all[FIXED + place] += warm[ThermalNumber::Resistance as usize];
        }
        for (number, value) in self.layout.at(point) {
            let log = (LEAST_RATIO - 1.0).max(value).ln_1p();
            match number.acts {
                Acts::TorqueConstant => torque_constant += log,
                Acts::MotorInertia => all[MOTOR_INERTIA] += log,
                Acts::SurfaceInertia => all[SURFACE_INERTIA] += log,
                Acts::DryFriction => all[FRICTION] += log,
                Acts::StaticOverKinetic => all[STATIC_OVER_KINETIC] += log,
                Acts::Viscous => all[VISCOUS] += log,
                Acts::SurfaceFriction => all[SURFACE_FRICTION] += log,
                Acts::Play => play_as_built += log,
                Acts::Efficiency => all[EFFICIENCY] += log,
                Acts::Load => load_n_m += value,
                Acts::Turns(phase) => turns[phase] += log,
                Acts::EccentricityCos => all[ECCENTRICITY_COS] += value,
                Acts::EccentricitySin => all[ECCENTRICITY_SIN] += value,
                Acts::PhaseGain(_)
                | Acts::PhaseOffset(_)
                | Acts::VoltageGain
                | Acts::Temperature
                | Acts::Coefficient(_) => {}
                Acts::Other(parameter) => {
                    let place = self.others.iter().position(|other| other == &parameter);
                    if let Some(place) = place {
                        all[FIXED + place] += log;
                    }
                }
            }
        }
        let mean = turns.iter().sum::<f64>() / 3.0;
        let scale = torque_constant + mean;
        for place in [FRICTION, VISCOUS, MOTOR_INERTIA, SURFACE_INERTIA, SURFACE_FRICTION] {
            all[place] -= scale;
        }
        all[LOAD] = load_n_m * (-scale).exp();
        all[PLAY] = play_as_built.exp() * (1.0 + 99.0 * damage[1]);
        all[IMBALANCE_A] = turns[0] - mean;
        all[IMBALANCE_B] = turns[1] - mean;
        all
    }

    /// A machine with these quantities, the torque constant at its nominal value.
    pub(crate) fn machine(&self, experiment: &Experiment, quantities: &[f64]) -> UnitMachine {
        let mut all = self.all_at(&vec![0.0; self.layout.len()]);
        for (&place, &value) in self.shown.iter().zip(quantities) {
            all[place] = value;
        }
        let mut actuator = experiment.actuator;
        for (parameter, ratio) in self.others.iter().zip(&all[FIXED..]) {
            let value = parameter.get(&actuator) * ratio.exp();
            parameter.set(&mut actuator, value);
        }
        let (motor, transmission) = (&mut actuator.motor, &mut actuator.transmission);
        let static_ratio = all[STATIC_OVER_KINETIC].exp();
        let friction = all[FRICTION].exp();
        let kinetic_n_m = transmission.kinetic_friction_n_m;
        transmission.kinetic_friction_n_m = kinetic_n_m * friction;
        transmission.static_friction_n_m =
            friction * (transmission.static_friction_n_m * static_ratio).max(kinetic_n_m);
        transmission.surface_friction_n_m *= all[SURFACE_FRICTION].exp();
        transmission.surface_inertia_kg_m2 *= all[SURFACE_INERTIA].exp();
        transmission.efficiency_ratio =
            (transmission.efficiency_ratio * all[EFFICIENCY].exp()).min(1.0);
        motor.viscous_n_m_s_per_rad *= all[VISCOUS].exp();
        motor.inertia_kg_m2 *= all[MOTOR_INERTIA].exp();
        let (a, b) = (all[IMBALANCE_A], all[IMBALANCE_B]);
        let faults = PhysicalFaults {
            friction_ratio: 1.0,
            backlash_ratio: all[PLAY].max(LEAST_RATIO),
            healthy_turns_frac: [a.exp(), b.exp(), (-a - b).exp()],
            eccentricity_cos: all[ECCENTRICITY_COS],
            eccentricity_sin: all[ECCENTRICITY_SIN],
        };
        let scenario = Scenario { load_n_m: all[LOAD], ..experiment.scenario.clone() };
        UnitMachine { actuator, faults, scenario }
    }
}

/// Tells whether a machine has nothing that a quantity scales.
fn is_absent(experiment: &Experiment, place: usize) -> bool {
    let (motor, gear) = (&experiment.actuator.motor, &experiment.actuator.transmission);
    let nominal = match place {
        FRICTION | STATIC_OVER_KINETIC => gear.static_friction_n_m,
        VISCOUS => motor.viscous_n_m_s_per_rad,
        SURFACE_INERTIA => gear.surface_inertia_kg_m2,
        SURFACE_FRICTION => gear.surface_friction_n_m,
        PLAY => gear.backlash_rad,
        _ => return false,
    };
    nominal == 0.0
}

/// Parameters that a test shows: those with which the low-fidelity signal moves. What cannot be moved
/// either way is none of them.
fn shown_of(
    experiment: &Experiment,
    parameters: Vec<&'static Parameter>,
) -> Vec<&'static Parameter> {
    let moved = |parameter: &'static Parameter, ratio: f64| {
        let mut actuator = experiment.actuator;
        parameter.set(&mut actuator, ratio * parameter.get(&experiment.actuator));
        let model = LowFidelity::new(&actuator, &experiment.scenario).ok()?;
        model.with_effects(&experiment.effects).ok()
    };
    let sides = |parameter: &&'static Parameter| {
        Some([moved(parameter, 1.0 - SHOWN_STEP)?, moved(parameter, 1.0 + SHOWN_STEP)?])
    };
    let movable: Vec<_> =
        parameters.into_iter().filter_map(|one| Some((one, sides(&one)?))).collect();
    let healthy = PhysicalFaults::from(&FaultCoordinates([0.0; FAULT_COUNT]));
    let tests: Vec<_> =
        movable.iter().flat_map(|(_, sides)| sides).map(|model| (model, &healthy)).collect();
    let mut currents_a = Vec::new();
    LowFidelity::simulate_tests(&tests, &mut currents_a);
    let moves = |sides: &[Vec<f64>]| {
        let changes = sides[0].iter().zip(&sides[1]).map(|(a, b)| (a - b) * (a - b));
        let rms_a = (changes.sum::<f64>() / sides[0].len() as f64).sqrt();
        rms_a > SHOWN_SHARE * experiment.actuator.controller.current_limit_a
    };
    let shown = movable.into_iter().zip(currents_a.chunks(2)).filter(|(_, sides)| moves(sides));
    shown.map(|((parameter, _), _)| parameter).collect()
}

/// A machine in a test.
#[derive(Clone, Debug)]
pub(crate) struct UnitMachine {
    pub(crate) actuator: Actuator,
    pub(crate) faults: PhysicalFaults,
    pub(crate) scenario: Scenario,
}
