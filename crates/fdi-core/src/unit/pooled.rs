//! One answer to several recordings of a machine in one state of health.
//!
//! ```text
//! c, ν̂ = arg min  Σ_r |z_r(c, ν_r)|² + |references|² + |priors|²       z_r white, ν_r = u + w_s + e_r
//! D = ℓ(all) − ℓ(the first)                       χ² with the white numbers of the others
//! ```
//!
//! Each recording is diagnosed by itself first, with the bundle of its test. What is left of it, its
//! evidence (`crates/fdi-core/src/unit/evidence.rs`), is explained with that of the others and of the
//! references: one damage `c`, numbers as built `u` in common, what differs between sessions and
//! recordings apart. No signal is simulated any more. `ℓ` is the least sum of squares; where `D` is
//! beyond what one state of health shows, the recordings are said to disagree.
//!
//! # Source
//!
//! Hierarchical normal model, Gelman et al., *Bayesian Data Analysis*, 3rd ed., chapter 5;
//! `docs/models/units.md`.

use std::sync::Arc;

use nalgebra::DMatrix;
use recordings::Recording;

use crate::{
    diagnose::Diagnoser,
    online::{error::DiagnoseError, options::DiagnoseOptions, posterior::Posterior, watch::Watch},
    report::{
        FaultId, Finding, Fit, Identifiability, Notice, NoticeCode, PooledLevel, PooledRecording,
        RecordDiagnosis, Status, Verdict,
    },
    unit::{
        agreement::{CHANGE_RATE, disagree, of_currents},
        answer::Conclusion,
        contradiction::NO_SESSION,
        finding::{Findings, History, Since},
        identifiability::Outlook,
        joint::{DamageFit, Joint, OfTest, OfUnit, Wear},
        layout::{Component, Layout},
        learnt_unit::{Earlier, Learnt, LearntUnit, basis, session_of},
        quantities::Quantities,
        search::Explained,
    },
};

/// A recording that was diagnosed by itself, with what it leaves for an answer to several.
#[derive(Clone, Debug)]
pub struct DiagnosedAlone {
    answer: RecordDiagnosis,
    explained: Option<Explained>,
    session: Option<String>,
    quantities: Arc<Quantities>,
    /// Identity of the test.
    basis: String,
    unit: Option<Arc<LearntUnit>>,
    /// True where it is asked how well each fault can be told.
    asks_identifiability: bool,
}

impl DiagnosedAlone {
    /// The answer to the recording by itself.
    pub fn answer(&self) -> &RecordDiagnosis {
        &self.answer
    }

    /// The answer to the recording by itself, to be given name, date and actuator.
    pub fn answer_mut(&mut self) -> &mut RecordDiagnosis {
        &mut self.answer
    }

    /// Session of the recording, else its day, where it states either.
    pub fn session(&self) -> Option<&str> {
        self.session.as_deref()
    }

    fn layout(&self) -> &Layout {
        self.quantities.layout()
    }

    /// Why an answer to several cannot rest on what the recording shows; `None` where it can.
    fn unexplained(&self) -> Option<String> {
        let Some(explained) = &self.explained else {
            let unused = self.answer.notice(NoticeCode::TolerancesUnused);
            let reason = unused.map_or("the model does not explain it", |notice| &notice.message);
            return Some(reason.to_owned());
        };
        if explained.is_widened {
            Some("its damage is beyond that of the machines whose error was learnt".to_owned())
        } else if self.answer.is_unfinished() {
            Some("its search did not finish".to_owned())
        } else if !self.answer.fit.adequate {
            Some(
                "its residual has the form of physics that the model file does not have".to_owned(),
            )
        } else {
            None
        }
    }
}

/// Why an answer to several recordings does not rest on one of them.
enum Against {
    /// The model does not explain it, or not well enough: what the machine shows there is not known.
    Unexplained(String),
    /// One of the others, by the name of that.
    Repeats(String),
}

impl Against {
    fn in_words(&self) -> String {
        match self {
            Self::Unexplained(reason) => reason.clone(),
            Self::Repeats(other) => format!("it is `{other}` again"),
        }
    }
}

/// Why recordings have no answer together.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TogetherError {
    /// There is none.
    #[error("no recording to diagnose")]
    Nothing,
    /// Bundles of two machines.
    #[error(
        "{name}: its bundle is of a machine with other tolerances or faults than that of `{first}`"
    )]
    OtherMachine {
        /// Recording.
        name: String,
        /// Recording that it is compared with.
        first: String,
    },
    /// Recordings of one test with different units.
    #[error("{name}: its unit is another than that of `{first}`")]
    OtherUnit {
        /// Recording.
        name: String,
        /// Recording that it is compared with.
        first: String,
    },
    /// The recordings and the tolerances leave a level without a most probable value.
    #[error("the recordings together do not determine all faults looked for")]
    Undetermined,
}

impl Diagnoser {
    /// Diagnoses a recording by itself, for an answer to several by [`diagnose_together`].
    ///
    /// # Errors
    ///
    /// [`DiagnoseError`] for a recording that does not fit the bundle.
    pub fn diagnose_alone(
        &self,
        recording: &Recording,
        options: &DiagnoseOptions,
    ) -> Result<DiagnosedAlone, DiagnoseError> {
        let (mut answer, posterior) = self.diagnose_shown(recording, options, &Watch::NOTHING)?;
        answer.recording.clone_from(&recording.name);
        let quantities = self.learnt.quantities();
        Ok(DiagnosedAlone {
            answer,
            explained: posterior.explained,
            session: session_of(&recording.metadata),
            basis: basis(self.bundle(), &quantities),
            quantities,
            unit: options.unit.clone().filter(|unit| self.contradiction(unit).is_none()),
            asks_identifiability: options.identifiability,
        })
    }
}

/// Answers recordings of one machine in one state of health together.
///
/// The recordings may be of several sessions and of several tests, each diagnosed with the bundle of
/// its test, and with the unit as it was learnt with that bundle. What the answer does not rest on,
/// such as a recording that the model does not explain, is told in `together`.
///
/// Where it can rest on none, it is that of the recording with the worst verdict. A machine is not said
/// to be healthy where the model does not explain one of its recordings: where that one is faulty by
/// itself, the answer is its own if the others decide nothing, and `model-inadequate` if they show a
/// healthy machine; else the verdict is `undetermined`.
///
/// # Errors
///
/// [`TogetherError`] where there is no recording, or the recordings are not of one machine.
pub fn diagnose_together(recordings: &[DiagnosedAlone]) -> Result<RecordDiagnosis, TogetherError> {
    let pool = Pool::of(recordings)?;
    if pool.used.is_empty() { pool.worst() } else { pool.answer() }
}

/// Recordings of one machine.
struct Pool<'a> {
    all: &'a [DiagnosedAlone],
    /// Why the answer does not rest on each; `None` where it does.
    against: Vec<Option<Against>>,
    /// Recordings that the answer rests on.
    used: Vec<usize>,
    /// One recording of each test.
    tests: Vec<&'a DiagnosedAlone>,
}

impl<'a> Pool<'a> {
    fn of(all: &'a [DiagnosedAlone]) -> Result<Self, TogetherError> {
        let again = |place: usize| {
            let own = all[place].explained.as_ref()?;
            let is_same = |other: &&DiagnosedAlone| {
                other.explained.as_ref().is_some_and(|one| one.evidence == own.evidence)
            };
            let known = all[..place].iter().find(is_same)?;
            Some(Against::Repeats(known.answer.recording.clone()))
        };
        let against = |place: usize| {
            let unexplained = all[place].unexplained().map(Against::Unexplained);
            unexplained.or_else(|| again(place))
        };
        let against: Vec<Option<Against>> = (0..all.len()).map(against).collect();
        let used: Vec<usize> = (0..all.len()).filter(|&place| against[place].is_none()).collect();
        let mut tests: Vec<&DiagnosedAlone> = Vec::new();
        for one in used.iter().map(|&place| &all[place]) {
            let names =
                |of: &DiagnosedAlone| (one.answer.recording.clone(), of.answer.recording.clone());
            if let Some(first) = tests.first()
                && !one.layout().is_of_machine(first.layout())
            {
                let (name, first) = names(first);
                return Err(TogetherError::OtherMachine { name, first });
            }
            match tests.iter().find(|test| test.basis == one.basis) {
                Some(test) if test.unit != one.unit => {
                    let (name, first) = names(test);
                    return Err(TogetherError::OtherUnit { name, first });
                }
                Some(_) => {}
                None => tests.push(one),
            }
        }
        Ok(Self { all, against, used, tests })
    }

    /// The unknowns of the machine.
    fn layout(&self) -> &'a Layout {
        self.tests[0].layout()
    }

    /// Some of the recordings with what their units were learnt from.
    fn beside(&self, used: &[usize]) -> Option<Beside<'a>> {
        let number = |one: &DiagnosedAlone| {
            self.tests.iter().position(|test| test.basis == one.basis).unwrap_or_default()
        };
        let test =
            |one: &'a DiagnosedAlone| OfTest { quantities: &one.quantities, number: number(one) };
        let learnt =
            |one: &&'a DiagnosedAlone| Some(Learnt { unit: one.unit.as_deref()?, test: test(one) });
        let units: Vec<Learnt<'a>> = self.tests.iter().filter_map(learnt).collect();
        let sessions: Vec<Option<&str>> =
            used.iter().map(|&place| self.all[place].session()).collect();
        let Earlier { others, sessions, worn, nth } = Earlier::of(&units, &sessions);
        let own = used.iter().zip(sessions).map(|(&place, session)| {
            let one = &self.all[place];
            Some(OfUnit {
                evidence: &one.explained.as_ref()?.evidence,
                test: test(one),
                session,
                wear: Wear::AsNew,
                replaced: one.unit.as_ref().map(|unit| unit.replaced).unwrap_or_default(),
            })
        });
        let own = own.collect::<Option<Vec<_>>>()?;
        let since = if units.is_empty() { Since::AsBuilt } else { Since::References };
        Some(Beside { others, own, worn, nth, since, start: self.start(used) })
    }

    /// Mean of the most probable unknowns of some recordings.
    fn start(&self, used: &[usize]) -> Vec<f64> {
        let mut mean = vec![0.0; self.layout().len()];
        let points = used.iter().filter_map(|&place| self.all[place].explained.as_ref());
        for explained in points {
            for (mean, value) in mean.iter_mut().zip(&explained.point) {
                *mean += value / used.len() as f64;
            }
        }
        mean
    }

    /// Covariance of the damage, were every number known.
    fn known_numbers(&self) -> Option<DMatrix<f64>> {
        let damage = self.layout().sought.len();
        let mut information = DMatrix::zeros(damage, damage);
        for &place in &self.used {
            let explained = self.all[place].explained.as_ref()?;
            information += explained.known_numbers.clone().try_inverse()?;
        }
        information.try_inverse()
    }

    fn answer(&self) -> Result<RecordDiagnosis, TogetherError> {
        let undetermined = || TogetherError::Undetermined;
        let beside = self.beside(&self.used).ok_or_else(undetermined)?;
        let joint = beside.joint().ok_or_else(undetermined)?;
        let damage = DamageFit {
            known_numbers: self.known_numbers().ok_or_else(undetermined)?,
            ..joint.damage().ok_or_else(undetermined)?
        };
        let history = beside.history(joint);
        let found = Conclusion::of(self.layout(), &history, damage, None, false);
        let by_used = found.verdict(self.is_loud());
        let faulty_apart = self.faulty_apart();
        if by_used == Verdict::Undetermined && !faulty_apart.is_empty() {
            return self.worst();
        }
        let changes = self.changes();
        let disagreement = if !changes.is_empty() {
            Some(changed_notice(&changes))
        } else if self.disagree() {
            Some(self.disagreement_notice())
        } else if by_used == Verdict::Healthy && !faulty_apart.is_empty() {
            Some(faulty_apart_notice(&faulty_apart))
        } else {
            None
        };
        let disagree = disagreement.is_some();
        let verdict = match by_used {
            _ if disagree => Verdict::ModelInadequate,
            Verdict::Healthy if self.unexplained().next().is_some() => Verdict::Undetermined,
            by_used => by_used,
        };
        let mut notices: Vec<Notice> = found.direction_notice().into_iter().collect();
        notices.extend(disagreement);
        notices.extend(found.hidden_notice(verdict));
        notices.extend(self.notices());
        let is_whole = self.used.len() == self.all.len() && !disagree;
        let first = &self.all[self.used[0]].answer;
        let Conclusion { posterior, mut faults, mut findings, .. } = found;
        if disagree {
            // what no machine shows is no damage of one
            for fault in &mut faults {
                fault.detected = None;
            }
            for finding in &mut findings {
                finding.detected = false;
            }
        }
        Ok(RecordDiagnosis {
            status: if is_whole { Status::Ok } else { Status::Partial },
            verdict,
            evaluations: self.all.iter().map(|one| one.answer.evaluations).sum(),
            discrepancy: self.root_mean_square(|answer| answer.discrepancy),
            fit: Fit {
                rms_a: self.root_mean_square(|answer| answer.fit.rms_a),
                noise_floor_a: self.root_mean_square(|answer| answer.fit.noise_floor_a),
                noise_a: self.root_mean_square(|answer| answer.fit.noise_a),
                adequate: !disagree,
                ..first.fit
            },
            faults,
            findings,
            identifiability: if disagree { Vec::new() } else { self.identifiability(&beside) },
            action: None,
            covariance: posterior.report_covariance(),
            notices,
            together: self.told(),
            ..first.clone()
        })
    }

    /// How well each fault can be told from the recordings that the answer rests on, where it is asked.
    fn identifiability(&self, beside: &Beside<'_>) -> Vec<Identifiability> {
        if !self.used.iter().any(|&place| self.all[place].asks_identifiability) {
            return Vec::new();
        }
        let voltage = |&place: &usize| self.all[place].explained.as_ref()?.voltage_to_come.clone();
        let voltages: Vec<_> = self.used.iter().map(voltage).collect();
        let outlook = Outlook {
            layout: self.layout(),
            others: &beside.others,
            own: &beside.own,
            has_unit: beside.since == Since::References,
            start: &beside.start,
            voltages: &voltages,
        };
        outlook.identifiability()
    }

    /// The answer to the recording with the worst verdict.
    fn worst(&self) -> Result<RecordDiagnosis, TogetherError> {
        let rank = |one: &&DiagnosedAlone| match one.answer.verdict {
            Verdict::Faulty => 3,
            Verdict::ModelInadequate => 2,
            Verdict::Undetermined => 1,
            Verdict::Healthy => 0,
        };
        let worst = self.all.iter().max_by_key(rank).ok_or(TogetherError::Nothing)?;
        let mut answer = RecordDiagnosis { together: self.told(), ..worst.answer.clone() };
        answer.notices.extend(self.answered_alone_notice(&worst.answer));
        answer.notices.extend(self.repeats_notice());
        Ok(answer)
    }

    /// Recordings that are faulty by themselves and show damage beyond that of those that are not, each
    /// with its directions in words.
    fn changes(&self) -> Vec<(&'a str, String)> {
        let is_faulty = |place: &usize| self.all[*place].answer.verdict == Verdict::Faulty;
        let (faulty, sound): (Vec<usize>, Vec<usize>) =
            self.used.iter().partition(|&p| is_faulty(p));
        if sound.is_empty() {
            return Vec::new();
        }
        let named = |place: usize| {
            let name = self.all[place].answer.recording.as_str();
            Some((name, self.change(&sound, place)?))
        };
        faulty.into_iter().filter_map(named).collect()
    }

    /// Directions of damage that a recording shows since others; `None` where there are none.
    ///
    /// All of them have a damage in common, beside references that are as new, and the recording has more.
    fn change(&self, others: &[usize], place: usize) -> Option<String> {
        let worn = |one: OfUnit<'a>| OfUnit { wear: Wear::Since([1; Component::COUNT]), ..one };
        let beside = self.beside(&[others, &[place]].concat())?;
        let mut own: Vec<OfUnit<'a>> = beside.own.into_iter().map(worn).collect();
        let changed = own.pop()?;
        let as_new = beside.others.into_iter().filter(|one| one.wear == Wear::AsNew);
        let before: Vec<OfUnit<'a>> = as_new.chain(own).collect();
        let mut start = self.start(others);
        let damage = self.layout().sought.len();
        for (more, level) in start.iter_mut().zip(self.start(&[place])).take(damage) {
            *more = level - *more;
        }
        let joint = Joint::beyond_wear(&before, &[changed], &start)?;
        let damage = joint.damage()?;
        let history = History { joint, worn: None, since: Since::References, nth: 1 };
        let Findings { all, .. } = Findings::at_rate(CHANGE_RATE, self.layout(), &history, &damage);
        let found: Vec<String> =
            all.iter().filter(|one| one.detected).map(Finding::label).collect();
        (!found.is_empty()).then(|| found.join(", "))
    }

    /// True where by their currents no machine in one state of health shows the recordings.
    fn disagree(&self) -> bool {
        let all = self.beside(&self.used).and_then(|beside| beside.sum_of_currents());
        let first = self.beside(&self.used[..1]).and_then(|beside| beside.sum_of_currents());
        disagree(all, first)
    }

    /// True where the noise of every recording is far above that of the bundle.
    fn is_loud(&self) -> bool {
        let loud = |&place: &usize| self.all[place].answer.notice(NoticeCode::NoiseAboveBundle);
        self.used.iter().all(|place| loud(place).is_some())
    }

    fn root_mean_square(&self, of: impl Fn(&RecordDiagnosis) -> f64) -> f64 {
        let squares = self.used.iter().map(|&place| of(&self.all[place].answer)).map(|x| x * x);
        (squares.sum::<f64>() / self.used.len() as f64).sqrt()
    }

    /// Notices of the recordings that the answer rests on, each once.
    fn notices(&self) -> Vec<Notice> {
        // those are of an answer by itself
        let own = [NoticeCode::PhaseUndetermined, NoticeCode::TolerancesHideLevels];
        let mut known: Vec<(Notice, Vec<&str>)> = Vec::new();
        for &place in &self.used {
            let answer = &self.all[place].answer;
            let kept = answer.notices.iter().filter(|notice| !own.contains(&notice.code));
            for notice in kept {
                match known.iter_mut().find(|(one, _)| one == notice) {
                    Some((_, of)) => of.push(&answer.recording),
                    None => known.push((notice.clone(), vec![&answer.recording])),
                }
            }
        }
        let all = self.used.len();
        let with_names = |(notice, of): (Notice, Vec<&str>)| {
            if of.len() == all {
                return notice;
            }
            Notice { message: format!("{}: {}", of.join(", "), notice.message), ..notice }
        };
        let beside = [self.left_out_notice(), self.repeats_notice()].into_iter().flatten();
        known.into_iter().map(with_names).chain(beside).collect()
    }

    /// Answers to the recordings that the model does not explain well enough, each with the reason.
    fn unexplained(&self) -> impl Iterator<Item = (&DiagnosedAlone, &str)> {
        self.all.iter().zip(&self.against).filter_map(|(one, against)| match against {
            Some(Against::Unexplained(reason)) => Some((one, reason.as_str())),
            _ => None,
        })
    }

    /// Names of recordings that the answer does not rest on and that are faulty by themselves, beside
    /// tolerances: without any every machine that is not its model file to the last digit is faulty.
    fn faulty_apart(&self) -> Vec<&str> {
        let faulty = self.unexplained().filter(|(one, _)| {
            one.answer.verdict == Verdict::Faulty && !one.layout().numbers.is_empty()
        });
        faulty.map(|(one, _)| one.answer.recording.as_str()).collect()
    }

    /// Recordings that the model does not explain well enough, with the reasons, in words; `None` where
    /// there are none.
    fn unexplained_in_words(&self) -> Option<String> {
        let told =
            self.unexplained().map(|(one, reason)| format!("{}: {reason}", one.answer.recording));
        let told: Vec<String> = told.collect();
        (!told.is_empty()).then(|| told.join("; "))
    }

    fn left_out_notice(&self) -> Option<Notice> {
        self.unexplained_in_words().map(|told| Notice {
            code: NoticeCode::RecordingsLeftOut,
            message: format!("the answer does not rest on {told}"),
        })
    }

    /// The notice that an answer is that of one of several recordings.
    fn answered_alone_notice(&self, answer: &RecordDiagnosis) -> Option<Notice> {
        let told = self.unexplained_in_words().filter(|_| self.all.len() > 1);
        told.map(|told| Notice {
            code: NoticeCode::RecordingsLeftOut,
            message: format!("the answer is that of `{}` by itself; {told}", answer.recording),
        })
    }

    fn repeats_notice(&self) -> Option<Notice> {
        let told = self.all.iter().zip(&self.against).filter_map(|(one, against)| {
            let repeats = against.as_ref().filter(|one| matches!(one, Against::Repeats(_)))?;
            Some(format!("{}: {}", one.answer.recording, repeats.in_words()))
        });
        let told: Vec<String> = told.collect();
        (!told.is_empty()).then(|| Notice {
            code: NoticeCode::RecordingsRepeated,
            message: format!("counted once: {}", told.join("; ")),
        })
    }

    fn disagreement_notice(&self) -> Notice {
        let states_none = self.used.iter().all(|&place| self.all[place].session.is_none());
        let session = if states_none { NO_SESSION } else { "" };
        Notice {
            code: NoticeCode::RecordingsDisagree,
            message: format!(
                "no machine in one state of health explains the {} recordings together{session}; \
                 diagnose them session by session, or one by one",
                self.used.len()
            ),
        }
    }

    /// Each recording with what it shows by itself, and what the answer would be without it.
    fn told(&self) -> Vec<PooledRecording> {
        let told = |place: usize| {
            let DiagnosedAlone { answer, session, .. } = &self.all[place];
            let without = self.stds_without(place);
            let level = |&id: &FaultId| {
                let fault = answer.fault(id)?;
                let (value, std) = (fault.value?, fault.std?);
                let std_without = without.as_ref().and_then(|stds| stds[id as usize]);
                Some(PooledLevel { id, value, std, std_without })
            };
            PooledRecording {
                recording: answer.recording.clone(),
                session: session.clone(),
                date: answer.date.clone(),
                verdict: answer.verdict,
                left_out: self.against[place].as_ref().map(Against::in_words),
                levels: FaultId::ALL[..6].iter().filter_map(level).collect(),
            }
        };
        (0..self.all.len()).map(told).collect()
    }

    /// Standard deviations of k1 to k6 without a recording; `None` where the answer does not rest on
    /// it, or on nothing else.
    fn stds_without(&self, place: usize) -> Option<[Option<f64>; 6]> {
        let others: Vec<usize> = self.used.iter().copied().filter(|&one| one != place).collect();
        if others.is_empty() || others.len() == self.used.len() {
            return None;
        }
        let DamageFit { estimate, covariance, .. } = self.beside(&others)?.joint()?.damage()?;
        let indices = self.layout().sought.clone();
        let faults = Posterior { indices, estimate, covariance, explained: None }.faults();
        Some([0, 1, 2, 3, 4, 5].map(|fault| faults[fault].std))
    }
}

/// The notice that recordings show damage which others do not have.
fn changed_notice(changes: &[(&str, String)]) -> Notice {
    let told: Vec<String> =
        changes.iter().map(|(name, labels)| format!("{name} shows {labels}")).collect();
    Notice {
        code: NoticeCode::RecordingsDisagree,
        message: format!(
            "{}, which the recordings that are not faulty by themselves do not have: no one state of \
             health explains all of them; diagnose those before the change and those after it apart",
            told.join("; ")
        ),
    }
}

/// The notice that recordings show a fault by themselves which the others exclude.
fn faulty_apart_notice(names: &[&str]) -> Notice {
    Notice {
        code: NoticeCode::RecordingsDisagree,
        message: format!(
            "{} is faulty by itself, and the other recordings show a healthy machine: no one state of \
             health explains all of them; diagnose them one by one",
            names.join(", ")
        ),
    }
}

/// Recordings beside those that their units were learnt from.
struct Beside<'a> {
    others: Vec<OfUnit<'a>>,
    own: Vec<OfUnit<'a>>,
    /// Wear of the recordings where parts wear alike each session.
    worn: Wear,
    nth: usize,
    since: Since,
    start: Vec<f64>,
}

impl<'a> Beside<'a> {
    fn joint(&self) -> Option<Joint<'a>> {
        Joint::new(&self.others, &self.own, &self.start)
    }

    /// Least sum of squares of the recordings without their voltages, and its white numbers.
    fn sum_of_currents(&self) -> Option<(f64, usize)> {
        let [of_others, of_own] = [&self.others, &self.own].map(|all| of_currents(all));
        let others = self.others.iter().zip(&of_others).map(|(one, of)| one.with_evidence(of));
        let own = self.own.iter().zip(&of_own).map(|(one, of)| one.with_evidence(of));
        let (others, own): (Vec<_>, Vec<_>) = (others.collect(), own.collect());
        let joint = Joint::new(&others, &own, &self.start)?;
        Some((joint.least_sum(&[])?, joint.white_numbers()))
    }

    fn history(&self, joint: Joint<'a>) -> History<'a> {
        let worn = || {
            let own: Vec<OfUnit<'a>> =
                self.own.iter().map(|one| OfUnit { wear: self.worn, ..*one }).collect();
            Joint::worn(&self.others, &own, &self.start)
        };
        let worn = if self.nth > 1 { worn() } else { None };
        History { joint, worn, since: self.since, nth: self.nth }
    }
}
