//! Units that are learnt from recordings as new, and diagnosed on another day.

use std::sync::Arc;

use fdi_core::{
    Bundle, BundleError, Channel, ChannelName, DiagnoseOptions, Diagnoser, EMBEDDED_BUNDLES,
    Encoding, Purpose, Recording, RootSeed, ToleranceUse,
    ema_sim::{Level, Spread, UncertainNumber, presets},
    in_parallel,
};
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::{
    hidden::{Chance, Hidden, HiddenDamage, Label, SESSION, Scatter, UNIT},
    score::{UnitsScore, scored},
    tolerance_at,
};
use crate::request::EvaluationError;

/// Chance that a z-score against the references calls a healthy machine faulty.
const Z_RATE: f64 = 0.02;

/// One line of the study: units that are learnt, at full tolerances.
#[derive(Clone, Copy, Debug)]
pub struct LearntLine {
    /// Recordings of each unit as new, each of a day of its own.
    pub references: usize,
    /// Half-width of the winding's temperature over days, K.
    pub half_width_k: f64,
    /// Standard deviation of the winding's temperature as read, K; `None`: it is not read.
    pub reading_std_k: Option<f64>,
    /// Damage when the unit is diagnosed.
    pub damage: HiddenDamage,
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
    let mut experiment = embedded.experiment.clone();
    experiment.tolerance = tolerance_at(1.0, true);
    for tolerance in &mut experiment.tolerance {
        if tolerance.number == UncertainNumber::WindingTemperature {
            tolerance.spread = Spread::HalfWidth(half_width_k);
            tolerance.level = Level::Session;
        }
    }
    experiment.temperature = Some(presets::ema_48_temperature());
    Bundle::build(&experiment, embedded.datasets, embedded.noise_a, RootSeed(seed))
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
        let mut chance = Chance::new(own);
        let mut unit = Hidden::nominal(experiment);
        unit.scatter(&UNIT, 1.0, true, &mut chance);
        let mut recorded = |day: usize, damaged: bool| {
            let mut hidden = unit.clone();
            if damaged {
                hidden.damage = line.damage.draw(&mut chance);
            }
            let session = Scatter { temperature_k: 0.0, ..SESSION };
            hidden.scatter(&session, 1.0, false, &mut chance);
            hidden.temperature_k = line.half_width_k * (2.0 * chance.uniform() - 1.0);
            let label = Label {
                session: Some(format!("day {day}")),
                temperature_error_k: line.reading_std_k.map(|std_k| std_k * chance.normal()),
            };
            let of_day = RootSeed(own).derive(Purpose::Units, 1_000_000 + day as u64);
            Ok::<_, EvaluationError>((hidden.record(experiment, of_day, &label)?, hidden.damage))
        };
        let references = (0..line.references).map(|day| Ok(recorded(day, false)?.0));
        let references = references.collect::<Result<Vec<Recording>, EvaluationError>>()?;
        let (recording, damage) = recorded(line.references, true)?;
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
