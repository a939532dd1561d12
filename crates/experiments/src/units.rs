//! Machines that differ from their model file: hidden numbers, hidden faults, one recording each.
//!
//! The generator knows nothing of how the diagnosis treats tolerances: it changes the numbers of the
//! high-fidelity model itself, sensors included, with scatter written down here.

use fdi_core::{
    Bundle, BundleError, Channel, ChannelName, CommandSource, DiagnoseOptions, Diagnoser,
    EMBEDDED_BUNDLES, Experiment, Metadata, Purpose, Recording, RootSeed, ToleranceUse,
    ema_sim::{
        Actuator, Converter, FaultCoordinates, HighFidelity, LowFidelity, PhaseSensors,
        PhysicalFaults, Scenario, Sector, SimulationError, Spread, Tolerance, UncertainNumber,
        presets,
    },
    in_parallel,
    report::{FaultId, RecordDiagnosis, Verdict},
    unit_noise_covariance,
};

use inference::{BandedMatrix, SymmetricMatrix, dot, tapered_covariance};

use crate::{request::EvaluationError, score::median};

/// Standard deviations of one machine from its data sheet, relative unless named otherwise.
///
/// # Source
///
/// Tolerances of data sheets of motors, gears and current sensors: `docs/models/tolerances.md`.
#[derive(Clone, Copy, Debug)]
struct Scatter {
    torque_constant: f64,
    resistance: f64,
    inductance: f64,
    motor_inertia: f64,
    surface_inertia: f64,
    friction: f64,
    static_over_kinetic: f64,
    viscous: f64,
    play: f64,
    efficiency: f64,
    load_ratio: f64,
    load_n_m: f64,
    bus: f64,
    gain: f64,
    offset_a: f64,
    turns: f64,
    eccentricity: f64,
}

/// Scatter of units.
const UNIT: Scatter = Scatter {
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
};

/// Scatter of sessions of one unit.
const SESSION: Scatter = Scatter {
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
};

/// Standard deviations beyond which nothing is drawn.
const FARTHEST: f64 = 2.5;
/// Sensors of the recordings: 20 mA, 12 bits over ±20 A.
const SENSORS: PhaseSensors = PhaseSensors { noise_a: 0.020, converter: Some(Converter::DEFAULT) };

/// Random numbers of one machine.
struct Chance {
    root: RootSeed,
    drawn: u64,
}

impl Chance {
    fn new(seed: u64) -> Self {
        Self { root: RootSeed(seed), drawn: 0 }
    }

    fn uniform(&mut self) -> f64 {
        self.drawn += 1;
        (self.root.derive(Purpose::Units, self.drawn) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        loop {
            let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
            let value = radius * (std::f64::consts::TAU * self.uniform()).cos();
            if value.abs() <= FARTHEST {
                return value;
            }
        }
    }
}

/// A machine that no one has seen: numbers, sensors and damage.
#[derive(Clone, Debug)]
struct Hidden {
    actuator: Actuator,
    load_n_m: f64,
    gains: [f64; 3],
    offsets_a: [f64; 3],
    turns: [f64; 3],
    eccentricity: [f64; 2],
    damage: FaultCoordinates,
}

impl Hidden {
    fn nominal(experiment: &Experiment) -> Self {
        Self {
            actuator: experiment.actuator,
            load_n_m: experiment.scenario.load_n_m,
            gains: [0.0; 3],
            offsets_a: [0.0; 3],
            turns: [0.0; 3],
            eccentricity: [0.0; 2],
            damage: FaultCoordinates([0.0; 7]),
        }
    }

    /// Scatters the numbers.
    fn scatter(&mut self, by: &Scatter, scale: f64, as_built: bool, chance: &mut Chance) {
        let mut ratio = |std: f64| 1.0 + scale * std * chance.normal();
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
    }

    /// Phases of the high-fidelity model as its sensors show them, without their noise.
    fn phases(
        &self,
        scenario: &Scenario,
        seed: u64,
    ) -> Result<([Vec<f64>; 3], Vec<f64>), SimulationError> {
        let scenario = Scenario { load_n_m: self.load_n_m, ..scenario.clone() };
        let scenario = scenario.with_real_electronics(seed);
        let trace = HighFidelity::new(&self.actuator, &scenario)?.try_simulate(&self.faults())?;
        Ok((self.sensed(trace.phase_currents_a), trace.motor_angle_rad))
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
    fn low_fidelity_signal(&self, experiment: &Experiment) -> Result<Vec<f64>, SimulationError> {
        let scenario = Scenario { load_n_m: self.load_n_m, ..experiment.scenario.clone() };
        let trace = LowFidelity::new(&self.actuator, &scenario)?.try_simulate(&self.faults())?;
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

    fn record(&self, experiment: &Experiment, seed: u64) -> Result<Recording, EvaluationError> {
        let root = RootSeed(seed);
        let electronics = root.derive(Purpose::ControllerNoise, 0);
        let (phases, angle_rad) = self.phases(&experiment.scenario, electronics)?;
        let views = [&phases[0][..], &phases[1][..], &phases[2][..]];
        let [a, b, c] = SENSORS.measure(views, root.derive(Purpose::SensorNoise, 0));
        let rate_hz = experiment.actuator.controller.sample_hz;
        let channels = [
            (ChannelName::PhaseACurrent, a),
            (ChannelName::PhaseBCurrent, b),
            (ChannelName::PhaseCCurrent, c),
            (ChannelName::MotorAngle, angle_rad),
        ];
        let channels = channels
            .into_iter()
            .map(|(name, values)| Channel::uniform(name, 0.0, rate_hz, values))
            .collect::<Result<Vec<_>, _>>()?;
        let metadata = Metadata {
            command: Some(CommandSource::Named(experiment.name.clone())),
            rate_hz: Some(rate_hz),
            ..Metadata::default()
        };
        Ok(Recording::new("hidden", metadata, channels)?)
    }
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
}

impl HiddenDamage {
    fn draw(self, chance: &mut Chance) -> FaultCoordinates {
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
        match self {
            Self::Healthy => {}
            Self::OneToThree => {
                for _ in 0..=(3.0 * chance.uniform()) as usize {
                    let place = (6.0 * chance.uniform()) as usize;
                    let level = 0.01 + 0.04 * chance.uniform();
                    put(place, level, chance.uniform());
                }
            }
            Self::Alone(fault, level) => {
                let place = match fault {
                    FaultId::K3 | FaultId::K4 | FaultId::K5 => {
                        2 + (3.0 * chance.uniform()) as usize
                    }
                    other => other as usize,
                };
                put(place, level, chance.uniform());
            }
        }
        damage
    }
}

/// One line of the study: many machines at a share of their tolerances.
#[derive(Clone, Copy, Debug)]
pub struct UnitsLine {
    /// Share of the tolerances that machines scatter with, and that the model file states.
    pub scale: f64,
    /// Damage.
    pub damage: HiddenDamage,
    /// True where mismatch of turns and eccentricity as built are there.
    pub as_built: bool,
    /// Machines.
    pub machines: usize,
    /// Machines that are diagnosed as their model file's too.
    pub twins: usize,
}

/// Scores of one way to diagnose the machines of a line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UnitsScore {
    /// Machines.
    pub machines: usize,
    /// Counts of the verdicts healthy, faulty, undetermined, model-inadequate, and refusals.
    pub verdicts: [usize; 5],
    /// Machines on which something is detected.
    pub detected: usize,
    /// Machines on which each of k1 to k6 is detected.
    pub detected_of: [usize; 6],
    /// Machines with a short on which one is detected, of whichever phase.
    pub short_detected: usize,
    /// Machines on which the damaged phase alone is detected among the shorts.
    pub phase_right: usize,
    /// Machines whose truth the 95 % interval of k1 to k5, and the region of (k6, k7), holds.
    pub covered: [usize; 6],
    /// Median standard deviations of k1 to k5 and k6.
    pub std_median: [f64; 6],
    /// Median evaluations of the low-fidelity model.
    pub evaluations_median: f64,
}

/// A line with its scores.
#[derive(Clone, Debug)]
pub struct UnitsResult {
    /// The line.
    pub line: UnitsLine,
    /// The diagnosis with tolerances.
    pub with_tolerances: UnitsScore,
    /// The first of these recordings, the machine taken to be exactly its model file.
    pub without: UnitsScore,
}

/// The embedded chirp with tolerances at a share of their size, learnt anew; with or without those of
/// what is there as built, mismatch of turns and eccentricity.
///
/// # Errors
///
/// [`BundleError`] when nothing can be learnt.
pub fn bundle_at(scale: f64, as_built: bool, seed: u64) -> Result<Bundle, BundleError> {
    let embedded = Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes)?;
    let mut experiment = embedded.experiment.clone();
    experiment.tolerance = tolerance_at(scale, as_built);
    Bundle::build(&experiment, embedded.datasets, embedded.noise_a, RootSeed(seed))
}

/// The tolerances of the preset at a share of their size; none at zero.
fn tolerance_at(scale: f64, as_built: bool) -> Vec<Tolerance> {
    let scaled = |tolerance: Tolerance| Tolerance {
        spread: match tolerance.spread {
            Spread::HalfWidth(half_width) => Spread::HalfWidth(scale * half_width),
            Spread::Std(std) => Spread::Std(scale * std),
        },
        ..tolerance
    };
    if scale > 0.0 {
        let is_kept = |tolerance: &Tolerance| {
            let built = [UncertainNumber::Turns, UncertainNumber::Eccentricity];
            as_built || !built.contains(&tolerance.number)
        };
        presets::ema_48_tolerance().into_iter().filter(is_kept).map(scaled).collect()
    } else {
        Vec::new()
    }
}

/// Diagnoses the machines of a line with and without tolerances.
///
/// # Errors
///
/// [`EvaluationError`] when a machine cannot be simulated.
pub fn evaluate_units(
    diagnoser: &Diagnoser,
    line: &UnitsLine,
    seed: u64,
    jobs: usize,
) -> Result<UnitsResult, EvaluationError> {
    let experiment = &diagnoser.bundle().experiment;
    let indices: Vec<u64> = (0..line.machines as u64).collect();
    let options = |tolerance| DiagnoseOptions { tolerance, ..DiagnoseOptions::default() };
    let judged = in_parallel(&indices, jobs, |_, &index| -> Result<_, EvaluationError> {
        let own = RootSeed(seed).derive(Purpose::Units, index);
        let mut chance = Chance::new(own);
        let mut hidden = Hidden::nominal(experiment);
        hidden.damage = line.damage.draw(&mut chance);
        hidden.scatter(&UNIT, line.scale, line.as_built, &mut chance);
        hidden.scatter(&SESSION, line.scale, false, &mut chance);
        let recording = hidden.record(experiment, own)?;
        let answer = |tolerance| diagnoser.diagnose(&recording, &options(tolerance)).ok();
        let is_twin = index < line.twins as u64;
        let twin = is_twin.then(|| answer(ToleranceUse::None));
        Ok((hidden.damage, answer(ToleranceUse::Model), twin))
    })?;
    let with: Vec<_> = judged.iter().map(|(damage, answer, _)| (damage, answer.as_ref())).collect();
    let twins =
        judged.iter().filter_map(|(damage, _, twin)| Some((damage, twin.as_ref()?.as_ref())));
    let without: Vec<_> = twins.collect();
    Ok(UnitsResult { line: *line, with_tolerances: scored(&with), without: scored(&without) })
}

/// Simulations behind the covariance of the electronics' noise.
const NOISE_RUNS: u64 = 200;
/// Samples that its taper reaches.
const TAPER_SAMPLES: usize = 60;
/// Share of a number's scatter that its slope is taken over.
const SLOPE_SHARE: f64 = 0.3;

/// Least standard deviations of k1 to k5 and k6 that any unbiased diagnosis of one recording of a
/// healthy machine can have, given tolerances at a share of their size.
///
/// ```text
/// C = (Jᵀ·Σ⁻¹·J + diag(0, 1/s²))⁻¹
/// ```
///
/// with `J` the slopes of the low-fidelity signal in damage and numbers (those of the high-fidelity one
/// hold every switching instant, which the noise of the electronics hides), `Σ` the covariance of the
/// noise of sensors and electronics, and `s` the scatter of the numbers. `k6` is the root mean
/// square of its two coordinates.
///
/// # Errors
///
/// [`EvaluationError`] when the machine cannot be simulated.
///
/// # Source
///
/// Cramér and Rao's inequality with priors: Van Trees, *Detection, Estimation, and Modulation Theory*,
/// part I, 2.4.
pub fn unit_bounds(
    experiment: &Experiment,
    scale: f64,
    jobs: usize,
) -> Result<[f64; 6], EvaluationError> {
    let nominal = Hidden::nominal(experiment);
    let signal = |hidden: &Hidden, seed: u64| -> Result<Vec<f64>, EvaluationError> {
        let (phases, angle_rad) = hidden.phases(&experiment.scenario, seed)?;
        let views = [&phases[0][..], &phases[1][..], &phases[2][..]];
        let pole_pairs = experiment.actuator.motor.pole_pairs;
        let envelope_a = experiment.envelope.of_phases_at(views, &angle_rad, pole_pairs);
        Ok(experiment.filter.apply(&envelope_a, experiment.actuator.controller.sample_hz))
    };
    let seeds: Vec<u64> = (0..NOISE_RUNS).collect();
    let mut runs = in_parallel(&seeds, jobs, |_, &seed| signal(&nominal, seed))?;
    let count = runs.len() as f64;
    let samples = runs[0].len();
    let mean: Vec<f64> =
        (0..samples).map(|n| runs.iter().map(|run| run[n]).sum::<f64>() / count).collect();
    for run in &mut runs {
        for (value, mean) in run.iter_mut().zip(&mean) {
            *value = (*value - mean) * (count / (count - 1.0)).sqrt();
        }
    }
    let electronics: BandedMatrix = tapered_covariance(&runs, TAPER_SAMPLES);
    let rate_hz = experiment.actuator.controller.sample_hz;
    let sensors = unit_noise_covariance(&experiment.filter, rate_hz, samples);
    let mut whole = electronics.plus(&sensors.scaled(SENSORS.variance_a2()));
    whole.add_to_diagonal(1e-10);
    let factor =
        whole.cholesky().map_err(|error| EvaluationError::Search { reason: error.to_string() })?;
    let unknowns = unknowns(scale);
    let mut rows = in_parallel(&unknowns, jobs, |_, unknown| -> Result<_, EvaluationError> {
        let side = |by: f64| {
            let mut moved = nominal.clone();
            (unknown.add)(&mut moved, by);
            moved.low_fidelity_signal(experiment)
        };
        let (above, below) = (side(unknown.step)?, side(-unknown.step)?);
        let slope = above.iter().zip(&below).map(|(a, b)| (a - b) / (2.0 * unknown.step));
        Ok(slope.collect::<Vec<f64>>())
    })?;
    factor.whiten_each(&mut rows);
    let information = SymmetricMatrix::from_fn(rows.len(), |i, j| {
        let prior = if i == j { unknowns[i].std.map_or(0.0, |std| 1.0 / (std * std)) } else { 0.0 };
        dot(&rows[i], &rows[j]) + prior
    });
    let variance = |place: usize| -> f64 {
        let mut unit = vec![0.0; rows.len()];
        unit[place] = 1.0;
        information.solve_semidefinite(&unit)[place]
    };
    let std = |place: usize| match place {
        5 => (0.5 * (variance(5) + variance(6))).sqrt(),
        other => variance(other).sqrt(),
    };
    Ok([0, 1, 2, 3, 4, 5].map(std))
}

/// Change of a machine by the size of an unknown.
type Addition = Box<dyn Fn(&mut Hidden, f64) + Sync>;

/// One unknown of the bound.
struct UnknownOfBound {
    add: Addition,
    step: f64,
    std: Option<f64>,
}

/// Change of a machine by the size of one number.
type Change = fn(&mut Hidden, f64);

/// Scatter of the machine's numbers between units and between sessions, the step of their slopes where
/// another unknown does the same, and how they change the machine.
///
/// The controller's ticks have kinks: what is alike takes equal differences, a friction of 2·0.01 of
/// k1, a play of 99·0.001 of k2.
const MACHINE_NUMBERS: [(f64, f64, Option<f64>, Change); 9] = [
    (UNIT.torque_constant, 0.0, None, |hidden, by| {
        hidden.actuator.motor.back_emf_v_s_per_rad *= 1.0 + by;
    }),
    (UNIT.motor_inertia, 0.0, None, |hidden, by| {
        hidden.actuator.motor.inertia_kg_m2 *= 1.0 + by;
    }),
    (UNIT.surface_inertia, 0.0, None, |hidden, by| {
        hidden.actuator.transmission.surface_inertia_kg_m2 *= 1.0 + by;
    }),
    (UNIT.viscous, SESSION.viscous, None, |hidden, by| {
        hidden.actuator.motor.viscous_n_m_s_per_rad *= 1.0 + by;
    }),
    (UNIT.friction, SESSION.friction, Some(0.02), |hidden, by| {
        hidden.actuator.transmission.kinetic_friction_n_m *= 1.0 + by;
        hidden.actuator.transmission.static_friction_n_m *= 1.0 + by;
    }),
    (UNIT.static_over_kinetic, SESSION.static_over_kinetic, None, |hidden, by| {
        hidden.actuator.transmission.static_friction_n_m *= 1.0 + by;
    }),
    (UNIT.play, 0.0, Some(0.099), |hidden, by| {
        hidden.actuator.transmission.backlash_rad *= 1.0 + by;
    }),
    (UNIT.efficiency, 0.0, None, |hidden, by| {
        hidden.actuator.transmission.efficiency_ratio *= 1.0 + by;
    }),
    (LOAD_STD_N_M, 0.0, None, |hidden, by| hidden.load_n_m += by),
];

/// Scatter of the load of the chirp, 0.5 N·m: 5 % and 0.1 N·m in squares.
const LOAD_STD_N_M: f64 = 0.103_077_640_640_441_5;

/// Damage without a prior, then the numbers with their scatter.
fn unknowns(scale: f64) -> Vec<UnknownOfBound> {
    let mut all: Vec<UnknownOfBound> = (0..7)
        .map(|place| UnknownOfBound {
            add: Box::new(move |hidden: &mut Hidden, by: f64| hidden.damage.0[place] += by),
            step: if place == 1 { 0.001 } else { 0.01 },
            std: None,
        })
        .collect();
    if scale <= 0.0 {
        return all;
    }
    let number = |unit: f64, session: f64, step: Option<f64>, add| UnknownOfBound {
        add,
        step: step.unwrap_or(SLOPE_SHARE * unit),
        std: Some(scale * unit.hypot(session)),
    };
    for (unit, session, step, add) in MACHINE_NUMBERS {
        all.push(number(unit, session, step, Box::new(add)));
    }
    let parts = |phase: usize| -> [(f64, f64, Addition); 3] {
        [
            (UNIT.gain, SESSION.gain, Box::new(move |hidden, by| hidden.gains[phase] += by)),
            (
                UNIT.offset_a,
                SESSION.offset_a,
                Box::new(move |hidden, by| hidden.offsets_a[phase] += by),
            ),
            (UNIT.turns, 0.0, Box::new(move |hidden, by| hidden.turns[phase] += by)),
        ]
    };
    for (unit, session, add) in (0..3).flat_map(parts) {
        all.push(number(unit, session, None, add));
    }
    for part in 0..2 {
        let add = Box::new(move |hidden: &mut Hidden, by: f64| hidden.eccentricity[part] += by);
        all.push(number(UNIT.eccentricity, 0.0, None, add));
    }
    all
}

fn scored(judged: &[(&FaultCoordinates, Option<&RecordDiagnosis>)]) -> UnitsScore {
    let mut score = UnitsScore { machines: judged.len(), ..UnitsScore::default() };
    let mut stds: [Vec<f64>; 6] = Default::default();
    let mut evaluations = Vec::new();
    for (damage, answer) in judged {
        let Some(answer) = answer else {
            score.verdicts[4] += 1;
            continue;
        };
        let place = match answer.verdict {
            Verdict::Healthy => 0,
            Verdict::Faulty => 1,
            Verdict::Undetermined => 2,
            Verdict::ModelInadequate => 3,
        };
        score.verdicts[place] += 1;
        let finding = answer.findings.iter().any(|finding| finding.detected);
        score.detected += usize::from(answer.any_detected() || finding);
        for (fault, found) in answer.faults[..6].iter().zip(&mut score.detected_of) {
            *found += usize::from(fault.detected == Some(true));
        }
        let shorts = [2, 3, 4].map(|place| answer.faults[place].detected == Some(true));
        let truth = [2, 3, 4].map(|place| damage.0[place] > 0.0);
        score.short_detected += usize::from(truth.contains(&true) && shorts.contains(&true));
        score.phase_right += usize::from(truth.contains(&true) && shorts == truth);
        for place in 0..5 {
            let interval = answer.faults[place].interval_95;
            let holds = interval.is_some_and(|[a, b]| (a..=b).contains(&damage.0[place]));
            score.covered[place] += usize::from(holds);
            stds[place].extend(answer.faults[place].std);
        }
        score.covered[5] += usize::from(region_holds(answer, damage));
        stds[5].extend(answer.faults[5].std);
        evaluations.push(answer.evaluations as f64);
    }
    score.std_median = stds.map(median);
    score.evaluations_median = median(evaluations);
    score
}

/// Tells whether the 95 % region of the eccentricity holds the truth.
fn region_holds(answer: &RecordDiagnosis, damage: &FaultCoordinates) -> bool {
    let covariance = &answer.covariance;
    let place = |name: &str| covariance.parameters.iter().position(|parameter| parameter == name);
    let (Some(x), Some(y)) = (place("k6_cos"), place("k6_sin")) else { return false };
    let off = [damage.0[5] - covariance.estimate[x], damage.0[6] - covariance.estimate[y]];
    let m = &covariance.matrix;
    let (a, b, c) = (m[x][x], m[x][y], m[y][y]);
    let determinant = a * c - b * b;
    let distance2 =
        (c * off[0] * off[0] - 2.0 * b * off[0] * off[1] + a * off[1] * off[1]) / determinant;
    // the 95 % quantile of χ² with two degrees of freedom
    distance2 <= -2.0 * 0.05f64.ln()
}
