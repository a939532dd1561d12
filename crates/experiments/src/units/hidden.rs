//! Hidden machines: the generator of the study, which knows nothing of how a diagnosis treats
//! tolerances.

use fdi_core::{
    Channel, ChannelName, CommandSource, Experiment, Metadata, Purpose, Recording, RootSeed,
    SEVERE_SHARE, SEVERE_TIMES,
    ema_sim::{
        Actuator, Effect, FaultCoordinates, HighFidelity, HighFidelityTrace, LowFidelity,
        Parameter, PhysicalFaults, Scenario, Sector, SimulationError, ThermalNumber,
        UncertainNumber,
    },
    report::FaultId,
};

use crate::{answers::SENSORS, chance::Chance, request::EvaluationError};

/// Standard deviations of one machine from its data sheet, relative unless named otherwise.
///
/// # Source
///
/// Tolerances of data sheets of motors, gears and current sensors: `docs/models/tolerances.md`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scatter {
    pub(super) torque_constant: f64,
    pub(super) resistance: f64,
    pub(super) inductance: f64,
    pub(super) motor_inertia: f64,
    pub(super) surface_inertia: f64,
    pub(super) friction: f64,
    pub(super) static_over_kinetic: f64,
    pub(super) viscous: f64,
    pub(super) play: f64,
    pub(super) efficiency: f64,
    pub(super) load_ratio: f64,
    pub(super) load_n_m: f64,
    pub(super) bus: f64,
    pub(super) gain: f64,
    pub(super) offset_a: f64,
    pub(super) turns: f64,
    pub(super) eccentricity: f64,
    pub(super) temperature_k: f64,
    pub(super) coefficients: [f64; 4],
}

impl Scatter {
    /// Each number's scatter times a factor of its own, log-uniform within a limit: a fleet that is
    /// not as its data sheet says.
    pub(super) fn misstated(self, most: f64, chance: &mut Chance) -> Self {
        let mut off = |std: f64| std * (most.ln() * (2.0 * chance.uniform() - 1.0)).exp();
        Self {
            torque_constant: off(self.torque_constant),
            resistance: off(self.resistance),
            inductance: off(self.inductance),
            motor_inertia: off(self.motor_inertia),
            surface_inertia: off(self.surface_inertia),
            friction: off(self.friction),
            static_over_kinetic: off(self.static_over_kinetic),
            viscous: off(self.viscous),
            play: off(self.play),
            efficiency: off(self.efficiency),
            load_ratio: off(self.load_ratio),
            load_n_m: off(self.load_n_m),
            bus: off(self.bus),
            gain: off(self.gain),
            offset_a: off(self.offset_a),
            turns: off(self.turns),
            eccentricity: off(self.eccentricity),
            temperature_k: off(self.temperature_k),
            coefficients: self.coefficients.map(off),
        }
    }
}

/// Temperature coefficients of a machine's back-EMF, resistance, dry friction and viscous drag, 1/K.
pub(super) const COEFFICIENTS: [f64; 4] = [-0.0011, 0.0039, -0.004, -0.02];
/// Temperature of a winding that the numbers are of, K.
const NOMINAL_K: f64 = 293.15;

/// Scatter of units.
pub(super) const UNIT: Scatter = Scatter {
    torque_constant: 0.03,
    resistance: 0.05,
    inductance: 0.10,
    motor_inertia: 0.03,
    surface_inertia: 0.05,
    friction: 0.20,
    static_over_kinetic: 0.10,
    viscous: 0.30,
    play: 0.30,
    efficiency: 0.02 / 0.85,
    load_ratio: 0.05,
    load_n_m: 0.1,
    bus: 0.01,
    gain: 0.01,
    offset_a: 0.02,
    turns: 0.003,
    eccentricity: 0.02 * std::f64::consts::FRAC_1_SQRT_2,
    temperature_k: 0.0,
    coefficients: [0.0002, 0.0, 0.001, 0.005],
};

/// Scatter of sessions of one unit.
pub(super) const SESSION: Scatter = Scatter {
    torque_constant: 0.0,
    resistance: 0.0,
    inductance: 0.0,
    motor_inertia: 0.0,
    surface_inertia: 0.0,
    friction: 0.03,
    static_over_kinetic: 0.03,
    viscous: 0.05,
    play: 0.0,
    efficiency: 0.0,
    load_ratio: 0.0,
    load_n_m: 0.0,
    bus: 0.01,
    gain: 0.002,
    offset_a: 0.01,
    turns: 0.0,
    eccentricity: 0.0,
    temperature_k: 15.0,
    coefficients: [0.0; 4],
};

/// Scatter of the gain with which a supply is measured: of units, and of sessions of one unit.
pub(super) const BUS_GAIN: [f64; 2] = [0.01, 0.001];
/// Noise and step of the supply's measurement: 12 bits of 100 V.
const BUS_NOISE_V: f64 = 0.05;
const BUS_STEP_V: f64 = 100.0 / 4096.0;
/// Step of the drive's duty: 1250 counts of its timer.
const DUTY_STEP: f64 = 1.0 / 1250.0;

/// Least share of a number that a machine is given.
const LEAST_RATIO: f64 = 0.05;

/// Statements of a recording about itself.
#[derive(Clone, Debug, Default)]
pub(super) struct Label {
    pub(super) session: Option<String>,
    /// Error of the winding's temperature as it was read, where it was read.
    pub(super) temperature_error_k: Option<f64>,
    /// Error of the supply's measurement, where duty and supply were recorded.
    pub(super) bus_gain: Option<f64>,
    /// Load of the day, where it is not that of the test, N·m.
    pub(super) load_n_m: Option<f64>,
}

/// A machine that no one has seen: numbers, sensors and damage.
#[derive(Clone, Debug)]
pub(super) struct Hidden {
    pub(super) actuator: Actuator,
    pub(super) load_n_m: f64,
    pub(super) gains: [f64; 3],
    pub(super) offsets_a: [f64; 3],
    pub(super) turns: [f64; 3],
    pub(super) eccentricity: [f64; 2],
    pub(super) coefficients: [f64; 4],
    /// Temperature beyond that of the model file's numbers.
    pub(super) temperature_k: f64,
    pub(super) damage: FaultCoordinates,
    /// Physics that the model file does not have.
    pub(super) effects: Vec<Effect>,
}

impl Hidden {
    pub(super) fn nominal(experiment: &Experiment) -> Self {
        Self {
            actuator: experiment.actuator,
            load_n_m: experiment.scenario.load_n_m,
            gains: [0.0; 3],
            offsets_a: [0.0; 3],
            turns: [0.0; 3],
            eccentricity: [0.0; 2],
            coefficients: COEFFICIENTS,
            temperature_k: 0.0,
            damage: FaultCoordinates([0.0; 7]),
            effects: Vec::new(),
        }
    }

    /// Scatters the numbers.
    pub(super) fn scatter(
        &mut self,
        by: &Scatter,
        scale: f64,
        as_built: bool,
        chance: &mut Chance,
    ) {
        let mut ratio = |std: f64| (1.0 + scale * std * chance.normal()).max(LEAST_RATIO);
        let actuator = &mut self.actuator;
        actuator.motor.back_emf_v_s_per_rad *= ratio(by.torque_constant);
        actuator.motor.resistance_ohm *= ratio(by.resistance);
        actuator.motor.inductance_henry *= ratio(by.inductance);
        actuator.motor.inertia_kg_m2 *= ratio(by.motor_inertia);
        actuator.motor.viscous_n_m_s_per_rad *= ratio(by.viscous);
        actuator.inverter.bus_voltage_v *= ratio(by.bus);
        let gear = &mut actuator.transmission;
        gear.surface_inertia_kg_m2 *= ratio(by.surface_inertia);
        let friction = ratio(by.friction);
        gear.kinetic_friction_n_m *= friction;
        gear.static_friction_n_m *= friction * ratio(by.static_over_kinetic);
        gear.static_friction_n_m = gear.static_friction_n_m.max(gear.kinetic_friction_n_m);
        gear.backlash_rad *= ratio(by.play);
        gear.efficiency_ratio = (gear.efficiency_ratio * ratio(by.efficiency)).min(1.0);
        self.load_n_m =
            self.load_n_m * ratio(by.load_ratio) + scale * by.load_n_m * chance.normal();
        for phase in 0..3 {
            self.gains[phase] += scale * by.gain * chance.normal();
            self.offsets_a[phase] += scale * by.offset_a * chance.normal();
            self.turns[phase] += if as_built { scale * by.turns * chance.normal() } else { 0.0 };
        }
        for part in &mut self.eccentricity {
            *part += if as_built { scale * by.eccentricity * chance.normal() } else { 0.0 };
        }
        for (coefficient, std) in self.coefficients.iter_mut().zip(by.coefficients) {
            *coefficient += scale * std * chance.normal();
        }
        self.temperature_k += scale * by.temperature_k * chance.normal();
    }

    /// A number of the machine as built, by the key of its tolerance.
    pub(super) fn number(&self, key: &str) -> Option<f64> {
        let gear = &self.actuator.transmission;
        if let Some((over, under)) = key.split_once(" / ") {
            return Some(self.number(over)? / self.number(under)?);
        }
        if let Some(parameter) = Parameter::find(key) {
            return Some(parameter.get(&self.actuator));
        }
        let (of, part) = key.rsplit_once('.')?;
        let place = ["a", "b", "c"].iter().position(|phase| *phase == part);
        match UncertainNumber::find(key).or_else(|| UncertainNumber::find(of))? {
            UncertainNumber::StaticOverKinetic => {
                Some(gear.static_friction_n_m / gear.kinetic_friction_n_m)
            }
            UncertainNumber::Load => Some(self.load_n_m),
            UncertainNumber::PhaseGain => Some(1.0 + self.gains[place?]),
            UncertainNumber::PhaseOffset => Some(self.offsets_a[place?]),
            UncertainNumber::Turns => Some(1.0 + self.turns[place?]),
            UncertainNumber::Eccentricity => Some(self.eccentricity[usize::from(part == "sin")]),
            _ => None,
        }
    }

    /// A temperature coefficient, 1/K, by its key `temperature.…`.
    pub(super) fn coefficient(&self, key: &str) -> Option<f64> {
        let is_it = |number: &ThermalNumber| key == format!("temperature.{}", number.key());
        Some(self.coefficients[ThermalNumber::ALL.iter().position(is_it)?])
    }

    /// The actuator at its temperature.
    fn warm(&self) -> Actuator {
        let mut actuator = self.actuator;
        let [back_emf, resistance, friction, viscous] =
            self.coefficients.map(|coefficient| coefficient * self.temperature_k);
        actuator.motor.back_emf_v_s_per_rad *= 1.0 + back_emf;
        actuator.motor.resistance_ohm *= 1.0 + resistance;
        actuator.motor.viscous_n_m_s_per_rad *= viscous.exp();
        actuator.transmission.kinetic_friction_n_m *= 1.0 + friction;
        actuator.transmission.static_friction_n_m *= 1.0 + friction;
        actuator
    }

    /// Phases of the high-fidelity model as its sensors show them, without their noise.
    pub(super) fn phases(
        &self,
        scenario: &Scenario,
        seed: u64,
    ) -> Result<([Vec<f64>; 3], Vec<f64>), SimulationError> {
        let trace = self.trace(scenario, seed)?;
        Ok((self.sensed(trace.phase_currents_a), trace.motor_angle_rad))
    }

    /// Run of the high-fidelity model.
    fn trace(&self, scenario: &Scenario, seed: u64) -> Result<HighFidelityTrace, SimulationError> {
        let scenario = Scenario { load_n_m: self.load_n_m, ..scenario.clone() };
        let scenario = scenario.with_real_electronics(seed);
        let model = HighFidelity::new(&self.warm(), &scenario)?.with_effects(&self.effects)?;
        model.try_simulate(&self.faults())
    }

    /// Duty of the drive, and the supply as it is measured with a gain and noise.
    fn duty_and_bus(
        &self,
        voltage_v: &[f64],
        gain: f64,
        seed: u64,
    ) -> [(ChannelName, Vec<f64>); 2] {
        let bus_v = self.actuator.inverter.bus_voltage_v;
        let mut chance = Chance::new(RootSeed(seed).derive(Purpose::SensorNoise, 1));
        let mut measured = || {
            let noisy_v = (1.0 + gain) * bus_v + BUS_NOISE_V * chance.normal();
            (noisy_v / BUS_STEP_V).round() * BUS_STEP_V
        };
        let measured_v: Vec<f64> = voltage_v.iter().map(|_| measured()).collect();
        let duty = voltage_v.iter().map(|v| (v / bus_v / DUTY_STEP).round() * DUTY_STEP).collect();
        [(ChannelName::Duty, duty), (ChannelName::BusVoltage, measured_v)]
    }

    /// Filtered envelope of the high-fidelity model without the sensors' noise, A.
    pub(super) fn signal(
        &self,
        experiment: &Experiment,
        seed: u64,
    ) -> Result<Vec<f64>, SimulationError> {
        let (phases, angle_rad) = self.phases(&experiment.scenario, seed)?;
        let views = [&phases[0][..], &phases[1][..], &phases[2][..]];
        let pole_pairs = experiment.actuator.motor.pole_pairs;
        let envelope_a = experiment.envelope.of_phases_at(views, &angle_rad, pole_pairs);
        Ok(experiment.filter.apply(&envelope_a, experiment.actuator.controller.sample_hz))
    }

    fn faults(&self) -> PhysicalFaults {
        let mut faults = PhysicalFaults::from(&self.damage);
        for (turns, built) in faults.healthy_turns_frac.iter_mut().zip(self.turns) {
            *turns *= 1.0 + built;
        }
        faults.eccentricity_cos += self.eccentricity[0];
        faults.eccentricity_sin += self.eccentricity[1];
        faults
    }

    fn sensed(&self, mut phases: [Vec<f64>; 3]) -> [Vec<f64>; 3] {
        for ((phase, gain), offset_a) in phases.iter_mut().zip(self.gains).zip(self.offsets_a) {
            for value in phase {
                *value = (1.0 + gain) * *value + offset_a;
            }
        }
        phases
    }

    /// The diagnosed signal of the low-fidelity model, whose two conducting phases carry its current.
    pub(super) fn low_fidelity_signal(
        &self,
        experiment: &Experiment,
    ) -> Result<Vec<f64>, SimulationError> {
        let scenario = Scenario { load_n_m: self.load_n_m, ..experiment.scenario.clone() };
        let model = LowFidelity::new(&self.warm(), &scenario)?.with_effects(&self.effects)?;
        let trace = model.try_simulate(&self.faults())?;
        let pole_pairs = self.actuator.motor.pole_pairs;
        let pattern = |angle_rad: &f64| {
            Sector::of_electrical_angle(f64::from(pole_pairs) * angle_rad).pattern()
        };
        let patterns: Vec<_> = trace.motor_angle_rad.iter().map(pattern).collect();
        let phases = [0, 1, 2].map(|phase| {
            patterns.iter().zip(&trace.current_a).map(|(signs, i)| signs[phase] * i).collect()
        });
        let phases = self.sensed(phases);
        let views = [&phases[0][..], &phases[1][..], &phases[2][..]];
        let envelope_a =
            experiment.envelope.of_phases_at(views, &trace.motor_angle_rad, pole_pairs);
        Ok(experiment.filter.apply(&envelope_a, trace.rate_hz))
    }

    /// Temperature of the winding as it was read, K; `None` where it was not.
    pub(super) fn read_temperature_k(&self, label: &Label) -> Option<f64> {
        label.temperature_error_k.map(|error_k| NOMINAL_K + self.temperature_k + error_k)
    }

    pub(super) fn record(
        &self,
        experiment: &Experiment,
        seed: u64,
        label: &Label,
    ) -> Result<Recording, EvaluationError> {
        let trace = self.trace(&experiment.scenario, electronics_seed(seed))?;
        let voltage =
            label.bus_gain.map(|gain| self.duty_and_bus(&trace.motor_voltage_v, gain, seed));
        let (phases, angle_rad) = (self.sensed(trace.phase_currents_a), trace.motor_angle_rad);
        let views = [&phases[0][..], &phases[1][..], &phases[2][..]];
        let [a, b, c] = SENSORS.measure(views, sensor_seed(seed));
        let rate_hz = experiment.actuator.controller.sample_hz;
        let channels = [
            (ChannelName::PhaseACurrent, a),
            (ChannelName::PhaseBCurrent, b),
            (ChannelName::PhaseCCurrent, c),
            (ChannelName::MotorAngle, angle_rad),
        ];
        let channels = channels
            .into_iter()
            .chain(voltage.into_iter().flatten())
            .map(|(name, values)| Channel::uniform(name, 0.0, rate_hz, values))
            .collect::<Result<Vec<_>, _>>()?;
        let metadata = Metadata {
            command: Some(CommandSource::Named(experiment.name.clone())),
            rate_hz: Some(rate_hz),
            session: label.session.clone(),
            winding_temperature_k: self.read_temperature_k(label),
            load_n_m: label.load_n_m,
            ..Metadata::default()
        };
        Ok(Recording::new("hidden", metadata, channels)?)
    }
}

/// Seed of the noise of a recording's electronics.
pub(super) fn electronics_seed(seed: u64) -> u64 {
    RootSeed(seed).derive(Purpose::ControllerNoise, 0)
}

/// Seed of the noise of a recording's sensors.
pub(super) fn sensor_seed(seed: u64) -> u64 {
    RootSeed(seed).derive(Purpose::SensorNoise, 0)
}

/// Damage of a line of the study.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HiddenDamage {
    /// None.
    Healthy,
    /// One to three faults of 0.01 to 0.05.
    OneToThree,
    /// One fault of a level: `k1` to `k6`, of shorts a random phase.
    Alone(FaultId, f64),
    /// One fault of a level beside one to three of 0.01 to 0.05.
    Among(FaultId, f64),
    /// Every fault at once, as machines in service are assumed to have them by these levels for
    /// watching, at most 1: k1 to k5 exponential with half of the level as mean, the eccentricity
    /// normal in both coordinates with half of it as standard deviation; of a share of
    /// [`SEVERE_SHARE`] each is [`SEVERE_TIMES`] as large.
    InService([f64; 6]),
}

impl HiddenDamage {
    pub(super) fn draw(self, chance: &mut Chance) -> FaultCoordinates {
        let mut damage = FaultCoordinates([0.0; 7]);
        let mut put = |place: usize, level: f64, turn: f64| {
            let angle_rad = std::f64::consts::TAU * turn;
            if place < 5 {
                damage.0[place] = level;
            } else {
                damage.0[5] = level * angle_rad.cos();
                damage.0[6] = level * angle_rad.sin();
            }
        };
        if let Self::InService(watch) = self {
            for (place, watch) in watch.into_iter().enumerate() {
                let is_severe = chance.uniform() < SEVERE_SHARE;
                let half = 0.5 * watch * if is_severe { SEVERE_TIMES } else { 1.0 };
                let decay = -(1.0 - chance.uniform()).ln();
                let level = if place < 5 { half * decay } else { half * (2.0 * decay).sqrt() };
                put(place, level.min(1.0), chance.uniform());
            }
        }
        if matches!(self, Self::OneToThree | Self::Among(..)) {
            for _ in 0..=(3.0 * chance.uniform()) as usize {
                let place = (6.0 * chance.uniform()) as usize;
                let level = 0.01 + 0.04 * chance.uniform();
                put(place, level, chance.uniform());
            }
        }
        if let Self::Alone(fault, level) | Self::Among(fault, level) = self {
            let place = match fault {
                FaultId::K3 | FaultId::K4 | FaultId::K5 => 2 + (3.0 * chance.uniform()) as usize,
                other => other as usize,
            };
            put(place, level, chance.uniform());
        }
        damage
    }
}
