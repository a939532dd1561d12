//! Setting a machine up: from recordings of it as new to the unit that later recordings are
//! diagnosed with.
//!
//! ```text
//! test ─▶ recordings ─▶ wiring, start, gear, noise ─▶ unit ─▶ tests of this unit ─▶ accepted or why not
//! ```
//!
//! Each step either finds what it needs, and says on what grounds, or ends with the reason why this
//! machine cannot be set up with these recordings. The last step simulates the unit that was learnt
//! in high fidelity, as new and damaged, and diagnoses it as later recordings will be
//! (`docs/models/setup.md`).

mod acceptance;
mod error;
mod options;
mod recorded;
mod test;

use std::sync::Arc;

use recordings::Recording;

use acceptance::Tests;
use recorded::{Healthy, Seen};
use test::checked_travel_rad;

use crate::{
    diagnose::Diagnoser,
    online::wiring::MappedColumn,
    report::{Acceptance, SetupChoice, SetupRefusal, SetupRefusalCode},
    unit::{
        learning::{Disagreement, UnitLearningError},
        learnt_unit::LearntUnit,
        numbers::LearntNumber,
    },
};

pub use error::SetupError;
pub use options::SetupOptions;
pub use test::check_test;

/// Standard deviations of a tolerance beyond which no number of this machine is believed.
const FARTHEST: f64 = 4.0;

/// Simulated tests, one of them with damage, that take as long as learning the unit: 0.24 s beside 2.3 s
/// for twenty of each with three recordings of `ema-270` in the chirp.
const TESTS_OF_LEARNING: f64 = 2.1;

/// A machine that was set up.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Setup {
    /// The unit that was learnt.
    pub unit: Arc<LearntUnit>,
    /// Column of each phase, where all recordings show another wiring than their columns say.
    pub wiring: Vec<MappedColumn>,
    /// Choices that were made, with their grounds.
    pub choices: Vec<SetupChoice>,
    /// Recordings that disagree with the others or with their type.
    pub disagreements: Vec<Disagreement>,
    /// Simulated tests of this unit.
    pub acceptance: Acceptance,
    /// Why later recordings should not be diagnosed with this unit; `None` where they can be.
    pub refusal: Option<SetupRefusal>,
}

impl Diagnoser {
    /// Sets a machine up from recordings of it as new, and tells each step in words as it begins, with
    /// the share of the time that is about over then.
    ///
    /// # Errors
    ///
    /// [`SetupError::Refused`] names the recording and the reason where the machine cannot be set
    /// up; a unit that should not be relied on is a result, with a [`Setup::refusal`].
    pub fn set_up(
        &self,
        recordings: &[Recording],
        options: &SetupOptions,
        tell: &dyn Fn(&str, f64),
    ) -> Result<Setup, SetupError> {
        let experiment = &self.bundle().experiment;
        let travel_rad = checked_travel_rad(experiment)?;
        let healthy = Healthy { travel_rad, noise_a: self.bundle().noise_a };
        tell("read what the recordings show of test and wiring", 0.0);
        let seen = recordings.iter().map(|one| Seen::of(one, experiment, &healthy));
        let seen = seen.collect::<Result<Vec<_>, _>>()?;
        let Some(first) = seen.first() else {
            let reason = "no recording of the machine as new".to_owned();
            return Err(SetupError::refused(SetupRefusalCode::NoRecording, None, reason));
        };
        tell("learn the unit", 0.0);
        let unit = Arc::new(self.learnt_of(recordings, options)?);
        if let Some(reason) = self.beyond_tolerances(&unit) {
            return Err(SetupError::refused(SetupRefusalCode::OtherMachine, None, reason));
        }
        let disagreements = self.disagreements(&unit).map_err(|error| unexplained(&error, None))?;
        let learnt = TESTS_OF_LEARNING / (TESTS_OF_LEARNING + options.tests as f64);
        tell("test this unit in simulation", learnt);
        let undetermined = || unexplained(&UnitLearningError::Undetermined, None);
        let tests = Tests::of(self, &unit, &recordings[0], &seen, &options.levels)
            .ok_or_else(undetermined)?;
        let acceptance = tests.acceptance(options)?;
        let refusal = objection(&disagreements, &acceptance);
        Ok(Setup {
            wiring: first.wiring_of_all(&seen),
            choices: recorded::choices(&seen, &unit),
            unit,
            disagreements,
            acceptance,
            refusal,
        })
    }

    /// The number of a unit that is farthest beyond its tolerance, in words; `None` where all are within.
    fn beyond_tolerances(&self, unit: &LearntUnit) -> Option<String> {
        let learnt = self.unit_numbers(unit).ok()?;
        let away = |number: &LearntNumber| (number.value - number.nominal).abs() / number.prior_std;
        let all = learnt.numbers.iter().chain(&learnt.ratios);
        let farthest = all.max_by(|a, b| away(a).total_cmp(&away(b)))?;
        let LearntNumber { key, nominal, value, .. } = farthest;
        (away(farthest) > FARTHEST).then(|| {
            format!(
                "`{key}` is {value:.4e} by the recordings and {nominal:.4e} in the model file, {:.0} \
                 standard deviations of its tolerance off: is it this machine, and is the file right?",
                away(farthest)
            )
        })
    }

    fn learnt_of(
        &self,
        recordings: &[Recording],
        options: &SetupOptions,
    ) -> Result<LearntUnit, SetupError> {
        self.learn_unit(recordings, &options.diagnosis).map_err(|error| {
            let name = match &error {
                UnitLearningError::Unexplained { name, .. } => Some(name),
                _ => None,
            };
            let of = recordings.iter().find(|one| Some(&one.name) == name);
            unexplained(&error, of)
        })
    }
}

/// Reason against a unit that was learnt; `None` where there is none.
fn objection(disagreements: &[Disagreement], tests: &Acceptance) -> Option<SetupRefusal> {
    if let Some(Disagreement { name, findings, .. }) =
        disagreements.iter().find(|one| one.against_others)
    {
        return Some(SetupRefusal {
            code: SetupRefusalCode::Disagreement,
            recording: Some(name.clone()),
            reason: format!(
                "{} against the other recordings as new: is it of this machine, and as new?",
                findings.join(", ")
            ),
        });
    }
    let (code, reason) = acceptance::objection(tests)?;
    Some(SetupRefusal { code, recording: None, reason })
}

/// A unit that cannot be learnt, as a reason.
fn unexplained(error: &UnitLearningError, recording: Option<&Recording>) -> SetupError {
    let (code, reason) = match error {
        UnitLearningError::Unexplained { reason, .. } => (
            SetupRefusalCode::OtherMachine,
            format!(
                "{reason}: no machine within the tolerances of the model file draws this current; is \
                 it this machine, this command and load, and are the tolerances wide enough?"
            ),
        ),
        UnitLearningError::OtherActuator { .. } => {
            (SetupRefusalCode::OtherMachine, error.to_string())
        }
        _ => (SetupRefusalCode::NotReadable, error.to_string()),
    };
    SetupError::refused(code, recording, reason)
}
