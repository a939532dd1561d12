//! Units that are learnt from recordings as new, and diagnosed on another day.

use std::sync::Arc;

use fdi_core::{
    Bundle, BundleError, Channel, ChannelName, Dataset, DatasetRequest, DiagnoseOptions, Diagnoser,
    EMBEDDED_BUNDLES, Encoding, Experiment, Purpose, Recording, ReferenceDesign, RootSeed,
    ToleranceUse, UnitLearningError, default_noise_a,
    ema_sim::{Actuator, FaultCoordinates, Imperfections, Level, Spread, UncertainNumber, presets},
    in_parallel,
    report::FaultId,
};
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::{
    hidden::{BUS_GAIN, Hidden, HiddenDamage, Label, SESSION, Scatter, UNIT},
    score::{UnitsScore, scored},
    tolerance_at,
};
use crate::{chance::Chance, request::EvaluationError};

/// Chance that a z-score against the references calls a healthy machine faulty.
const Z_RATE: f64 = 0.02;

/// One line of the study: units that are learnt, at full tolerances.
#[derive(Clone, Copy, Debug)]
pub struct LearntLine {
    /// Recordings of each unit as new, each of a day of its own.
    pub references: usize,
    /// Days on which it is recorded.
    pub days: Days,
    /// Damage when the unit is diagnosed.
    pub damage: HiddenDamage,
    /// Most that a number's scatter is more or less than stated, as a factor.
    pub misstated: f64,
    /// Units.
    pub units: usize,
    /// Units that are diagnosed by a shift against the references too, as without tolerances.
    pub shifted: usize,
}

/// Scores of a line.
#[derive(Clone, Debug)]
pub struct LearntResult {
    /// The line.
    pub line: LearntLine,
    /// Units that were learnt.
    pub learnt: UnitsScore,
    /// The first of them against references without tolerances.
    pub shifted: UnitsScore,
    /// Units that a z-score of the current's rms against the references calls faulty.
    pub z_detected: usize,
}

/// The embedded chirp, learnt anew for days with winding's temperatures within a half-width.
///
/// # Errors
///
/// [`BundleError`] when nothing can be learnt.
pub fn bundle_over_days(half_width_k: f64, seed: u64) -> Result<Bundle, BundleError> {
    let embedded = Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes)?;
    let experiment = over_days(embedded.experiment, half_width_k);
    Bundle::build(&experiment, embedded.datasets, embedded.noise_a, RootSeed(seed))
}

/// A test of EMA-48 at its usual tolerances, on days with winding's temperatures within a half-width.
pub fn over_days(test: Experiment, half_width_k: f64) -> Experiment {
    let mut tolerance = tolerance_at(1.0, true);
    for one in &mut tolerance {
        if one.number == UncertainNumber::WindingTemperature {
            one.spread = Spread::HalfWidth(half_width_k);
            one.level = Level::Session;
        }
    }
    Experiment { tolerance, temperature: Some(presets::ema_48_temperature()), ..test }
}

/// A bundle of a test, built as `fdi setup` does, for a rotor that starts where the test does.
///
/// # Errors
///
/// [`EvaluationError`] when its machines cannot be simulated, or nothing can be learnt.
pub fn bundle_of_test(
    test: &Experiment,
    seed: u64,
    jobs: usize,
) -> Result<Bundle, EvaluationError> {
    const CONDITIONS: usize = 100;
    let dataset = |design| {
        let request = DatasetRequest {
            design,
            conditions: CONDITIONS,
            seed,
            imperfections: Imperfections::REAL,
            jobs,
        };
        Dataset::generate(test, &request)
    };
    let datasets = vec![dataset(ReferenceDesign::Incipient)?, dataset(ReferenceDesign::Sparse)?];
    Ok(Bundle::build(test, datasets, default_noise_a(&test.actuator), RootSeed(seed))?)
}

/// Learns the units of a line and diagnoses them.
///
/// # Errors
///
/// [`EvaluationError`] when a machine cannot be simulated.
pub fn evaluate_learnt(
    diagnoser: &Diagnoser,
    line: &LearntLine,
    seed: u64,
    jobs: usize,
) -> Result<LearntResult, EvaluationError> {
    let experiment = &diagnoser.bundle().experiment;
    let indices: Vec<u64> = (0..line.units as u64).collect();
    let judged = in_parallel(&indices, jobs, |_, &index| -> Result<_, EvaluationError> {
        let own = RootSeed(seed).derive(Purpose::Units, index);
        let mut unit = Owned::drawn(experiment, line.days, line.misstated, own);
        let references = unit.records_as_new(line.references)?;
        let damage = line.damage.draw(&mut unit.chance);
        let recording = unit.record(damage)?;
        let options =
            DiagnoseOptions { tolerance: ToleranceUse::Model, ..DiagnoseOptions::default() };
        let answer = diagnoser.learn_unit(&references, &options).ok().and_then(|learnt| {
            let options = DiagnoseOptions { unit: Some(Arc::new(learnt)), ..options };
            diagnoser.diagnose(&recording, &options).ok()
        });
        let shifted = (index < line.shifted as u64).then(|| {
            let bundle = diagnoser.bundle().clone();
            let shifted = Diagnoser::with_references(bundle, Encoding::Full, &references).ok()?;
            shifted.diagnose(&recording, &DiagnoseOptions::default()).ok()
        });
        Ok((damage, answer, shifted, is_z_detected(&references, &recording)))
    })?;
    let learnt: Vec<_> =
        judged.iter().map(|(damage, answer, ..)| (damage, answer.as_ref())).collect();
    let shifted = judged
        .iter()
        .filter_map(|(damage, _, shifted, _)| Some((damage, shifted.as_ref()?.as_ref())));
    Ok(LearntResult {
        line: *line,
        learnt: scored(&learnt),
        shifted: scored(&shifted.collect::<Vec<_>>()),
        z_detected: judged.iter().filter(|(.., detected)| *detected).count(),
    })
}

/// Days on which a unit is recorded.
#[derive(Clone, Copy, Debug)]
pub struct Days {
    /// Half-width of the winding's temperature over them, K.
    pub half_width_k: f64,
    /// Standard deviation of the winding's temperature as read, K; `None`: it is not read.
    pub reading_std_k: Option<f64>,
    /// True where the drive's duty and its supply are recorded.
    pub has_voltage: bool,
    /// Most by which the load of a day, which its recordings state, is off that of the test, N·m.
    pub load_within_n_m: f64,
}

/// Cold and hot halls, the temperature read.
const DAYS: Days =
    Days { half_width_k: 40.0, reading_std_k: Some(3.0), has_voltage: false, load_within_n_m: 0.0 };

/// A hidden unit with what is drawn for it.
pub(super) struct Owned<'a> {
    experiment: &'a Experiment,
    days: Days,
    pub(super) hidden: Hidden,
    session: Scatter,
    pub(super) chance: Chance,
    seed: u64,
    recorded: u64,
}

impl<'a> Owned<'a> {
    pub(super) fn drawn(experiment: &'a Experiment, days: Days, misstated: f64, seed: u64) -> Self {
        let mut chance = Chance::new(seed);
        let unit = UNIT.misstated(misstated, &mut chance);
        // the temperature is drawn by the days
        let session = Scatter { temperature_k: 0.0, ..SESSION.misstated(misstated, &mut chance) };
        let mut hidden = Hidden::nominal(experiment);
        hidden.scatter(&unit, 1.0, true, &mut chance);
        Self { experiment, days, hidden, session, chance, seed, recorded: 0 }
    }

    /// A unit whose scatter is as stated, on cold and hot days whose temperature is read.
    pub(super) fn usual(experiment: &'a Experiment, seed: u64) -> Self {
        Self::drawn(experiment, DAYS, 1.0, seed)
    }

    /// A number of the unit as built, or a coefficient, by the key of its tolerance.
    pub(super) fn number(&self, key: &str) -> Option<f64> {
        self.hidden.coefficient(key).or_else(|| self.hidden.number(key))
    }

    /// Play of the unit as built over that of the model file.
    pub(super) fn play_ratio(&self) -> f64 {
        let play_rad = |actuator: &Actuator| actuator.transmission.backlash_rad;
        play_rad(&self.hidden.actuator) / play_rad(&self.experiment.actuator)
    }

    /// Recordings as new, each of a day of its own.
    pub(super) fn records_as_new(
        &mut self,
        recordings: usize,
    ) -> Result<Vec<Recording>, EvaluationError> {
        (0..recordings).map(|_| self.record(FaultCoordinates([0.0; 7]))).collect()
    }

    /// A recording of a new day.
    pub(super) fn record(
        &mut self,
        damage: FaultCoordinates,
    ) -> Result<Recording, EvaluationError> {
        self.record_several(damage, 1).map(|mut one| one.remove(0))
    }

    /// Recordings of a new day, each with noise of its own.
    pub(super) fn record_several(
        &mut self,
        damage: FaultCoordinates,
        recordings: usize,
    ) -> Result<Vec<Recording>, EvaluationError> {
        let Day { hidden, label, seed } = self.day(damage);
        let seeds = (1..recordings as u64).map(|nth| RootSeed(seed).derive(Purpose::Units, nth));
        let seeds = std::iter::once(seed).chain(seeds);
        seeds.map(|seed| hidden.record(self.experiment, seed, &label)).collect()
    }

    /// Error of the supply's measurement on the day to come.
    fn bus_gain(&self) -> f64 {
        let [unit, day] = BUS_GAIN;
        unit * self.apart(2_000_000).normal() + day * self.apart(2_000_001 + self.recorded).normal()
    }

    /// Draws of their own, so that all others stay those of a unit without them.
    fn apart(&self, stream: u64) -> Chance {
        Chance::new(RootSeed(self.seed).derive(Purpose::Units, stream))
    }

    /// The unit with its damage on a new day.
    pub(super) fn day(&mut self, damage: FaultCoordinates) -> Day {
        let mut hidden = Hidden { damage, ..self.hidden.clone() };
        hidden.scatter(&self.session, 1.0, false, &mut self.chance);
        hidden.temperature_k = self.days.half_width_k * (2.0 * self.chance.uniform() - 1.0);
        let beyond_n_m = self.days.load_within_n_m
            * (2.0 * self.apart(3_000_000 + self.recorded).uniform() - 1.0);
        hidden.load_n_m += beyond_n_m;
        let load_n_m = self.experiment.scenario.load_n_m + beyond_n_m;
        let error_k = |std_k| std_k * self.chance.normal();
        let label = Label {
            session: Some(format!("day {}", self.recorded)),
            temperature_error_k: self.days.reading_std_k.map(error_k),
            bus_gain: self.days.has_voltage.then(|| self.bus_gain()),
            load_n_m: (beyond_n_m != 0.0).then_some(load_n_m),
        };
        self.recorded += 1;
        let seed = RootSeed(self.seed).derive(Purpose::Units, 1_000_000 + self.recorded);
        Day { hidden, label, seed }
    }
}

/// A unit on a day.
pub(super) struct Day {
    pub(super) hidden: Hidden,
    pub(super) label: Label,
    pub(super) seed: u64,
}

/// Recordings of one hidden unit as new, each of a day of its own: the winding within ±40 K, its
/// temperature read to 3 K.
///
/// # Errors
///
/// [`EvaluationError`] when the machine cannot be simulated.
pub fn unit_recordings(
    experiment: &Experiment,
    recordings: usize,
    seed: u64,
) -> Result<Vec<Recording>, EvaluationError> {
    Owned::usual(experiment, seed).records_as_new(recordings)
}

/// A slow wear over sessions, with `fdi unit update` after each.
#[derive(Clone, Copy, Debug)]
pub struct WearLine {
    /// Fault that grows; of k3 to k5 a random phase. `None`: nothing.
    pub fault: Option<FaultId>,
    /// Level that each session adds.
    pub rate: f64,
    /// Sessions after the four as new.
    pub sessions: usize,
    /// Units.
    pub units: usize,
}

/// Units of a line by the session in which damage was first detected, from 1.
///
/// # Errors
///
/// [`EvaluationError`] when a machine cannot be simulated.
pub fn evaluate_wear(
    diagnoser: &Diagnoser,
    line: &WearLine,
    seed: u64,
    jobs: usize,
) -> Result<Vec<Option<usize>>, EvaluationError> {
    const REFERENCES: usize = 4;
    let experiment = &diagnoser.bundle().experiment;
    let options = DiagnoseOptions { tolerance: ToleranceUse::Model, ..DiagnoseOptions::default() };
    let indices: Vec<u64> = (0..line.units as u64).collect();
    in_parallel(&indices, jobs, |_, &index| {
        let own = RootSeed(seed).derive(Purpose::Units, index);
        let mut unit = Owned::usual(experiment, own);
        let one = line.fault.map(|fault| HiddenDamage::Alone(fault, line.rate));
        let rate = one.map_or(FaultCoordinates([0.0; 7]), |one| one.draw(&mut unit.chance));
        let references = unit.records_as_new(REFERENCES)?;
        let refused =
            |error: UnitLearningError| EvaluationError::Search { reason: error.to_string() };
        let mut learnt = diagnoser.learn_unit(&references, &options).map_err(refused)?;
        for session in 1..=line.sessions {
            let damage = FaultCoordinates(rate.0.map(|level| level * session as f64));
            let recording = [unit.record(damage)?];
            let updated = diagnoser.update_unit(&learnt, &recording, &options);
            let (updated, left_out) = updated.map_err(refused)?;
            if left_out.iter().any(|left| left.reason.contains("detected")) {
                return Ok(Some(session));
            }
            learnt = updated;
        }
        Ok(None)
    })
}

/// Tells whether the rms current of a recording stands out from those of its references: Student's
/// test of one against few.
fn is_z_detected(references: &[Recording], recording: &Recording) -> bool {
    let rms = |recording: &Recording| {
        let phases =
            [ChannelName::PhaseACurrent, ChannelName::PhaseBCurrent, ChannelName::PhaseCCurrent];
        let values = phases.iter().filter_map(|&name| recording.channel(name));
        values.flat_map(Channel::values).map(|i| i * i).sum::<f64>().sqrt()
    };
    let known: Vec<f64> = references.iter().map(rms).collect();
    let count = known.len() as f64;
    let mean = known.iter().sum::<f64>() / count;
    let variance = known.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (count - 1.0);
    let Ok(student) = StudentsT::new(0.0, 1.0, count - 1.0) else { return false };
    let z = (rms(recording) - mean) / (variance * (1.0 + 1.0 / count)).sqrt();
    z.abs() > student.inverse_cdf(1.0 - 0.5 * Z_RATE)
}
