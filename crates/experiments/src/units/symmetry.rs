//! Directions in which damage and the machine's numbers draw the same current.

use fdi_core::{
    Bundle, Dataset, DatasetRequest, DiagnoseOptions, Diagnoser, EMBEDDED_BUNDLES, Experiment,
    Purpose, Recording, RootSeed, ToleranceUse,
    ema_sim::{Actuator, Spread, UncertainNumber, presets},
    in_parallel,
    report::{FaultId, RecordDiagnosis},
};

use super::{
    HiddenDamage,
    hidden::{Hidden, Label, SESSION, UNIT},
    tolerance_at,
};
use crate::{chance::Chance, request::EvaluationError, score::median};

/// Directions that damage shares with the data sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symmetry {
    /// k1, and the dry friction.
    Friction,
    /// k2, and the play as built.
    Play,
    /// k3, k4 and k5 alike, and turns, resistance and inductance of the motor.
    TorqueConstant,
}

impl Symmetry {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Friction, Self::Play, Self::TorqueConstant];

    /// The finding of the direction.
    pub fn finding(self) -> &'static str {
        match self {
            Self::Friction => "friction",
            Self::Play => "play",
            Self::TorqueConstant => "torque-constant",
        }
    }

    /// Standard deviation of the stated tolerance of the number alone, as a level: between units,
    /// days and temperatures.
    pub fn stated_std(self) -> f64 {
        let warm = |per_k: f64| per_k * SESSION.temperature_k;
        match self {
            Self::Friction => {
                let parts = [UNIT.friction, SESSION.friction, warm(0.004)];
                0.5 * parts.iter().map(|part| part * part).sum::<f64>().sqrt()
            }
            Self::Play => UNIT.play / 99.0,
            Self::TorqueConstant => UNIT.torque_constant.hypot(warm(0.0011)),
        }
    }

    /// A machine with damage along the direction.
    fn damaged(self, machine: &Hidden) -> Hidden {
        let mut damaged = machine.clone();
        let levels = &mut damaged.damage.0;
        match self {
            Self::Friction => levels[0] = 0.05,
            Self::Play => levels[1] = 0.003,
            Self::TorqueConstant => levels[2..5].fill(0.03),
        }
        damaged
    }

    /// A machine without damage whose data sheet is off as much: friction `1 + 2·k1`, play
    /// `1 + 99·k2`, turns `1 - k` of all phases.
    fn built(self, machine: &Hidden) -> Hidden {
        let mut built = machine.clone();
        let (motor, gear) = (&mut built.actuator.motor, &mut built.actuator.transmission);
        match self {
            Self::Friction => {
                gear.kinetic_friction_n_m *= 1.1;
                gear.static_friction_n_m *= 1.1;
            }
            Self::Play => gear.backlash_rad *= 1.0 + 99.0 * 0.003,
            Self::TorqueConstant => {
                motor.back_emf_v_s_per_rad *= 0.97;
                motor.resistance_ohm *= 0.97;
                motor.inductance_henry *= 0.97 * 0.97;
            }
        }
        built
    }
}

/// How a direction fares over the pairs.
#[derive(Clone, Copy, Debug)]
pub struct SymmetryResult {
    /// The direction.
    pub symmetry: Symmetry,
    /// Pairs that were diagnosed, both of them.
    pub pairs: usize,
    /// Median standard deviation of its finding.
    pub std: f64,
    /// Largest deviation of that standard deviation from what the tolerances alone leave open,
    /// relative.
    pub off_prior: f64,
    /// Mean difference of a pair's levels over their standard deviation: that of the level in which
    /// it is largest.
    pub difference: f64,
    /// Root mean square difference of that level over its standard deviation.
    pub difference_rms: f64,
}

/// Diagnoses pairs of machines, one with damage and one whose data sheet is off as much, with
/// independent noise.
///
/// # Errors
///
/// [`EvaluationError`] when a machine cannot be simulated.
pub fn evaluate_symmetries(
    diagnoser: &Diagnoser,
    pairs: usize,
    seed: u64,
    jobs: usize,
) -> Result<Vec<SymmetryResult>, EvaluationError> {
    let mut results = Vec::new();
    for (place, symmetry) in Symmetry::ALL.into_iter().enumerate() {
        let indices: Vec<u64> = (0..pairs as u64).collect();
        let pairs = in_parallel(&indices, jobs, |_, &index| -> Result<_, EvaluationError> {
            let own = RootSeed(seed + place as u64).derive(Purpose::Units, index);
            let machine = scattered(&diagnoser.bundle().experiment, own);
            let answer = |hidden: Hidden, noise: u64| -> Result<_, EvaluationError> {
                let noise = RootSeed(own).derive(Purpose::SensorNoise, noise);
                let recording =
                    hidden.record(&diagnoser.bundle().experiment, noise, &Label::default())?;
                Ok(diagnoser.diagnose(&recording, &options()).ok())
            };
            let damaged = answer(symmetry.damaged(&machine), 1)?;
            Ok(damaged.zip(answer(symmetry.built(&machine), 2)?))
        })?;
        results.push(judged(symmetry, &pairs.into_iter().flatten().collect::<Vec<_>>()));
    }
    Ok(results)
}

fn options() -> DiagnoseOptions {
    DiagnoseOptions { tolerance: ToleranceUse::Model, ..DiagnoseOptions::default() }
}

/// A machine at full tolerances.
fn scattered(experiment: &Experiment, seed: u64) -> Hidden {
    let mut chance = Chance::new(seed);
    let mut hidden = Hidden::nominal(experiment);
    hidden.scatter(&UNIT, 1.0, true, &mut chance);
    hidden.scatter(&SESSION, 1.0, false, &mut chance);
    hidden
}

fn judged(symmetry: Symmetry, pairs: &[(RecordDiagnosis, RecordDiagnosis)]) -> SymmetryResult {
    let answers = || pairs.iter().flat_map(|(damaged, built)| [damaged, built]);
    let findings = || {
        let of = |answer: &RecordDiagnosis| {
            let own = answer.findings.iter().find(|one| one.id == symmetry.finding());
            own.map(|finding| (finding.std, finding.prior_std))
        };
        answers().filter_map(of)
    };
    let off = findings().map(|(std, prior)| (std / prior - 1.0).abs()).fold(0.0, f64::max);
    let differences = differences(pairs);
    let largest = differences.into_iter().max_by(|(a, _), (b, _)| a.abs().total_cmp(&b.abs()));
    let (difference, difference_rms) = largest.unwrap_or((f64::NAN, f64::NAN));
    SymmetryResult {
        symmetry,
        pairs: pairs.len(),
        std: median(findings().map(|(std, _)| std)),
        off_prior: off,
        difference,
        difference_rms,
    }
}

/// Mean and root mean square of the differences of pairs, one entry a coordinate of the levels, over
/// the standard deviation of the first.
fn differences(pairs: &[(RecordDiagnosis, RecordDiagnosis)]) -> Vec<(f64, f64)> {
    let Some((first, _)) = pairs.first() else { return Vec::new() };
    let of = |place: usize| {
        let off: Vec<f64> = pairs
            .iter()
            .map(|(one, other)| {
                let (one, other) = (&one.covariance, &other.covariance);
                let std = one.matrix[place][place].sqrt();
                (one.estimate[place] - other.estimate[place]) / std
            })
            .collect();
        let count = off.len() as f64;
        let mean = off.iter().sum::<f64>() / count;
        (mean, (off.iter().map(|value| value * value).sum::<f64>() / count).sqrt())
    };
    (0..first.covariance.estimate.len()).map(of).collect()
}

/// The embedded chirp of a machine whose torques are all scaled alike, learnt from simulations of that
/// machine with tolerances at full size.
///
/// Back-EMF, inertias, frictions, drag and load times the ratio draw the same current.
///
/// # Errors
///
/// [`EvaluationError`] when nothing can be simulated or learnt.
pub fn bundle_of_scaled_torques(
    ratio: f64,
    seed: u64,
    jobs: usize,
) -> Result<Bundle, EvaluationError> {
    let embedded = Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes)?;
    let mut experiment = embedded.experiment.clone();
    experiment.tolerance = tolerance_at(1.0, true);
    experiment.temperature = Some(presets::ema_48_temperature());
    scale_torques(&mut experiment.actuator, ratio);
    experiment.scenario.load_n_m *= ratio;
    for tolerance in &mut experiment.tolerance {
        if let (UncertainNumber::Load, Spread::Std(std)) = (tolerance.number, &mut tolerance.spread)
        {
            *std *= ratio;
        }
    }
    let datasets = embedded.datasets.iter().map(|dataset| {
        let Dataset { design, seed, imperfections, ref conditions, .. } = *dataset;
        let conditions = conditions.len();
        let request = DatasetRequest { design, conditions, seed, imperfections, jobs };
        Dataset::generate(&experiment, &request)
    });
    let datasets = datasets.collect::<Result<Vec<_>, _>>()?;
    Ok(Bundle::build(&experiment, datasets, embedded.noise_a, RootSeed(seed))?)
}

fn scale_torques(actuator: &mut Actuator, ratio: f64) {
    let (motor, gear) = (&mut actuator.motor, &mut actuator.transmission);
    motor.back_emf_v_s_per_rad *= ratio;
    motor.inertia_kg_m2 *= ratio;
    motor.viscous_n_m_s_per_rad *= ratio;
    gear.surface_inertia_kg_m2 *= ratio;
    gear.kinetic_friction_n_m *= ratio;
    gear.static_friction_n_m *= ratio;
    gear.surface_friction_n_m *= ratio;
}

/// Mean difference of each level k1 to k6 that two diagnosers give the same recordings, over its
/// standard deviation.
///
/// # Errors
///
/// [`EvaluationError`] when a machine cannot be simulated.
pub fn difference_of_diagnosers(
    [one, other]: [&Diagnoser; 2],
    machines: usize,
    seed: u64,
    jobs: usize,
) -> Result<[f64; 6], EvaluationError> {
    let indices: Vec<u64> = (0..machines as u64).collect();
    let both = in_parallel(&indices, jobs, |_, &index| -> Result<_, EvaluationError> {
        let own = RootSeed(seed).derive(Purpose::Units, index);
        let mut hidden = scattered(&one.bundle().experiment, own);
        hidden.damage = HiddenDamage::OneToThree.draw(&mut Chance::new(!own));
        let recording = hidden.record(&one.bundle().experiment, own, &Label::default())?;
        let answer = |diagnoser: &Diagnoser, recording: &Recording| {
            diagnoser.diagnose(recording, &options()).ok()
        };
        Ok(answer(one, &recording).zip(answer(other, &recording)))
    })?;
    let both: Vec<_> = both.into_iter().flatten().collect();
    let mean = differences(&both);
    let amplitude = mean.get(FaultId::K6 as usize).zip(mean.get(6)).map(|(x, y)| x.0.hypot(y.0));
    let level = |place: usize| mean.get(place).map_or(f64::NAN, |(mean, _)| *mean);
    Ok([level(0), level(1), level(2), level(3), level(4), amplitude.unwrap_or(f64::NAN)])
}
