//! Learning units from recordings.

use std::sync::Arc;

use recordings::Recording;

use crate::{
    diagnose::Diagnoser,
    online::{
        error::DiagnoseError, motor_voltage::MotorVoltage, options::DiagnoseOptions, watch::Watch,
    },
    report::{Finding, Notice, NoticeCode, RecordDiagnosis, ToleranceUse, Verdict},
    unit::{
        contradiction::Agreement,
        evidence::Evidence,
        finding::{Findings, History, Since},
        joint::{Joint, OfTest, OfUnit, Wear},
        layout::Component,
        learnt_unit::{
            Earlier, Learnt, LearntUnit, OtherBundle, UnitRecording, UnitState, basis, session_of,
        },
    },
};

/// Why a unit cannot be learnt, or used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum UnitLearningError {
    /// There is nothing to learn from.
    #[error("no recording to learn from")]
    Nothing,
    /// A recording cannot be diagnosed.
    #[error("{name}: {reason}")]
    Recording {
        /// Name of the recording.
        name: String,
        /// Why.
        reason: Box<DiagnoseError>,
    },
    /// A recording that no machine within the tolerances explains.
    #[error("{name}: {reason}: nothing of the unit can be learnt from it")]
    Unexplained {
        /// Recording.
        name: String,
        /// Why not.
        reason: String,
    },
    /// Two actuators.
    #[error("{name}: is of actuator `{found}`, expected `{expected}`")]
    OtherActuator {
        /// Recording.
        name: String,
        /// Actuator of the recording.
        found: String,
        /// Actuator of the unit.
        expected: String,
    },
    /// A recording that the unit has already.
    #[error("{name}: the unit has learnt from it already, as `{earlier}`")]
    Twice {
        /// Recording.
        name: String,
        /// Name under which the unit has it.
        earlier: String,
    },
    /// Recordings that leave a number without a most probable value.
    #[error("the unit's recordings do not determine its numbers: learn it again from them")]
    Undetermined,
    /// The unit was learnt with another bundle.
    #[error(transparent)]
    OtherBundle(#[from] OtherBundle),
}

/// A recording that disagrees with the others of its unit, or with its type.
#[derive(Clone, Debug, PartialEq)]
pub struct Disagreement {
    /// Name of the recording.
    pub name: String,
    /// Directions of damage that it shows against the others, in words.
    pub findings: Vec<String>,
    /// True where it stands against other recordings; false where it stands against the type alone.
    pub against_others: bool,
}

/// A recording that a unit was not updated with.
#[derive(Clone, Debug, PartialEq)]
pub struct NotLearnt {
    /// Name of the recording.
    pub name: String,
    /// Reason in words.
    pub reason: String,
}

impl Diagnoser {
    /// Learns a unit from recordings of it as new.
    ///
    /// # Errors
    ///
    /// [`UnitLearningError`] names the recording that nothing can be learnt from.
    pub fn learn_unit(
        &self,
        recordings: &[Recording],
        options: &DiagnoseOptions,
    ) -> Result<LearntUnit, UnitLearningError> {
        let experiment = &self.bundle().experiment;
        let mut unit = LearntUnit {
            actuator_id: None,
            model_name: experiment.model_name.clone(),
            command: experiment.name.clone(),
            basis: basis(self.bundle(), &self.learnt.quantities()),
            replaced: [0; Component::COUNT],
            recordings: Vec::new(),
            agreement: Agreement::default(),
        };
        for recording in recordings {
            unit.check(recording)?;
            let learnt = self.evidence_of(recording, options)?;
            unit.take(recording, learnt, UnitState::AsNew)?;
        }
        if unit.recordings.is_empty() { Err(UnitLearningError::Nothing) } else { Ok(unit) }
    }

    /// True where a unit was learnt with a bundle of this one's model, test and set of numbers.
    pub fn knows_unit(&self, unit: &LearntUnit) -> bool {
        unit.check_basis(self.bundle(), &self.learnt.quantities()).is_ok()
    }

    /// Learns on from later recordings of a unit. Those on which damage is found, or that nothing
    /// explains, are left out and told.
    ///
    /// # Errors
    ///
    /// [`UnitLearningError`] for a unit of another bundle and a recording that cannot be diagnosed.
    pub fn update_unit(
        &self,
        unit: &LearntUnit,
        recordings: &[Recording],
        options: &DiagnoseOptions,
    ) -> Result<(LearntUnit, Vec<NotLearnt>), UnitLearningError> {
        unit.check_basis(self.bundle(), &self.learnt.quantities())?;
        let mut updated = unit.clone();
        let mut left_out = Vec::new();
        for recording in recordings {
            updated.check(recording)?;
            let of_unit = DiagnoseOptions {
                unit: Some(Arc::new(updated.clone())),
                tolerance: ToleranceUse::Model,
                ..options.clone()
            };
            let (answer, posterior) = self
                .diagnose_shown(recording, &of_unit, &Watch::NOTHING)
                .map_err(|reason| failed(recording, reason))?;
            let name = recording.name.clone();
            match (answer.verdict, posterior.explained) {
                (Verdict::Healthy | Verdict::Undetermined, Some(explained))
                    if answer.fit.adequate =>
                {
                    updated.take(recording, explained.evidence, UnitState::Since)?;
                }
                (Verdict::Faulty, _) => {
                    let reason = format!("{} detected", detected(&answer).join(", "));
                    left_out.push(NotLearnt { name, reason });
                }
                _ => {
                    let reason = unexplained(&answer);
                    left_out.push(NotLearnt { name, reason });
                }
            }
        }
        Ok((updated, left_out))
    }

    /// Recordings of a unit as new that show damage against the others, or, where there are no
    /// others, against their type.
    ///
    /// # Errors
    ///
    /// [`UnitLearningError::OtherBundle`] for a unit of another bundle.
    pub fn disagreements(&self, unit: &LearntUnit) -> Result<Vec<Disagreement>, UnitLearningError> {
        unit.check_basis(self.bundle(), &self.learnt.quantities())?;
        let quantities = self.learnt.quantities();
        let learnt = Learnt { unit, test: OfTest::only(&quantities) };
        let earlier = Earlier::of(&[learnt], &[]).others;
        let shows = |place: usize, others: &[OfUnit<'_>]| -> Vec<String> {
            let own = earlier[place];
            let since = if others.is_empty() { Since::AsBuilt } else { Since::References };
            let joint = Joint::new(others, &[own], &[]);
            let damage = joint.as_ref().and_then(Joint::damage);
            let Some((joint, damage)) = joint.zip(damage) else { return Vec::new() };
            let history = History { joint, worn: None, since, nth: 1 };
            let findings = Findings::of(quantities.layout(), &history, &damage);
            let found = findings.all.iter().filter(|finding| finding.detected);
            found.map(Finding::label).collect()
        };
        let mut disagreements = Vec::new();
        for (place, recording) in unit.recordings.iter().enumerate() {
            if recording.state != UnitState::AsNew {
                continue;
            }
            let is_other =
                |(other, one): &(usize, &OfUnit<'_>)| *other != place && one.wear == Wear::AsNew;
            let others = earlier.iter().enumerate().filter(is_other).map(|(_, one)| *one);
            let others: Vec<_> = others.collect();
            for others in [&[][..], &others] {
                let findings = shows(place, others);
                if !findings.is_empty() {
                    let (name, against_others) = (recording.name.clone(), !others.is_empty());
                    disagreements.push(Disagreement { name, findings, against_others });
                    break;
                }
            }
        }
        Ok(disagreements)
    }

    fn evidence_of(
        &self,
        recording: &Recording,
        options: &DiagnoseOptions,
    ) -> Result<Evidence, UnitLearningError> {
        let alone =
            DiagnoseOptions { unit: None, tolerance: ToleranceUse::Model, ..options.clone() };
        let (answer, posterior) = self
            .diagnose_shown(recording, &alone, &Watch::NOTHING)
            .map_err(|reason| failed(recording, reason))?;
        // physics that the model file does not have is the unit's own, where it has it as new
        let explained = posterior.explained.map(|explained| explained.evidence);
        explained.ok_or_else(|| {
            let (name, reason) = (recording.name.clone(), unexplained(&answer));
            UnitLearningError::Unexplained { name, reason }
        })
    }
}

impl LearntUnit {
    /// Names of those recordings of the unit that have the motor's voltage, which was not used: a diagnosis
    /// of each says why.
    pub fn without_voltage<'a>(&self, recordings: &'a [Recording]) -> Vec<&'a str> {
        let is_unread = |name: &str| {
            let own = self.recordings.iter().find(|one| one.name == name);
            own.is_some_and(|one| one.evidence.voltage.is_none())
        };
        let with_voltage = recordings.iter().filter(|one| MotorVoltage::is_recorded(one));
        with_voltage.map(|one| one.name.as_str()).filter(|name| is_unread(name)).collect()
    }

    /// Refuses a recording of another actuator.
    fn check(&self, recording: &Recording) -> Result<(), UnitLearningError> {
        if let (Some(found), Some(expected)) = (&recording.metadata.actuator_id, &self.actuator_id)
            && found != expected
        {
            let (name, found, expected) = (recording.name.clone(), found.clone(), expected.clone());
            return Err(UnitLearningError::OtherActuator { name, found, expected });
        }
        Ok(())
    }

    fn take(
        &mut self,
        recording: &Recording,
        evidence: Evidence,
        state: UnitState,
    ) -> Result<(), UnitLearningError> {
        let name = recording.name.clone();
        if let Some(earlier) = self.with_evidence(&evidence) {
            return Err(UnitLearningError::Twice { name, earlier: earlier.name.clone() });
        }
        if self.actuator_id.is_none() {
            self.actuator_id.clone_from(&recording.metadata.actuator_id);
        }
        self.agreement = Agreement::default();
        let (session, replaced) = (session_of(&recording.metadata), self.replaced);
        self.recordings.push(UnitRecording { name, session, state, replaced, evidence });
        Ok(())
    }
}

fn failed(recording: &Recording, reason: DiagnoseError) -> UnitLearningError {
    UnitLearningError::Recording { name: recording.name.clone(), reason: Box::new(reason) }
}

/// Labels of the findings that are detected, of an answer without findings names of the faults.
fn detected(answer: &RecordDiagnosis) -> Vec<String> {
    let findings = answer.findings.iter().filter(|finding| finding.detected);
    let found: Vec<String> = findings.map(Finding::label).collect();
    if found.is_empty() {
        let faults = answer.faults.iter().filter(|fault| fault.detected == Some(true));
        faults.map(|fault| fault.name.clone()).collect()
    } else {
        found
    }
}

/// Reason for which nothing is learnt from a recording.
fn unexplained(answer: &RecordDiagnosis) -> String {
    let codes = [NoticeCode::TolerancesUnused, NoticeCode::UnmodelledPhysics];
    let tells = |notice: &&Notice| codes.contains(&notice.code);
    let notice = answer.notices.iter().find(tells);
    notice.map_or("the model does not explain it", |one| &one.message).to_owned()
}
