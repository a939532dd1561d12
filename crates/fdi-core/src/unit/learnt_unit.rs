//! Units that were learnt: the evidence of each recording.
//!
//! Nothing is forgotten and nothing is averaged: a learnt unit holds the evidence of each recording
//! (`crates/fdi-core/src/unit/evidence.rs`), and a diagnosis explains all of them together with the
//! recording diagnosed.

use ema_sim::EffectId;
use recordings::{Metadata, sha256_hex};

use crate::{
    offline::bundle::Bundle,
    unit::{
        contradiction::Agreement,
        evidence::Evidence,
        joint::{BuiltFit, Joint, OfTest, OfUnit, Wear},
        layout::Component,
        quantities::Quantities,
    },
};

/// State of a unit when a recording of it was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum UnitState {
    /// As new: its damage counts as none.
    AsNew,
    /// Later: it may have worn, slowly.
    Since,
}

/// A recording that a unit was learnt from.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitRecording {
    /// Name of the file.
    pub name: String,
    /// Session, or else the day, that it is of; `None` where neither is stated.
    pub session: Option<String>,
    /// State of the unit.
    pub state: UnitState,
    /// Parts replaced before it, by component.
    pub(crate) replaced: [u32; Component::COUNT],
    pub(crate) evidence: Evidence,
}

impl UnitRecording {
    /// Effects that the model file does not have and that the recording's residual has the form of.
    pub fn unmodelled(&self) -> &[EffectId] {
        &self.evidence.unmodelled
    }
}

/// Evidence of recordings on one unit.
#[derive(Clone, Debug, PartialEq)]
pub struct LearntUnit {
    pub(crate) actuator_id: Option<String>,
    pub(crate) model_name: String,
    pub(crate) command: String,
    /// Identity of the bundle's model, test and numbers.
    pub(crate) basis: String,
    /// Parts replaced so far, by component.
    pub(crate) replaced: [u32; Component::COUNT],
    pub(crate) recordings: Vec<UnitRecording>,
    pub(crate) agreement: Agreement,
}

/// A unit that was learnt with another bundle than the one it is used with.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", self.message())]
pub struct OtherBundle {
    /// Model of the bundle.
    pub model: String,
    /// Command of the bundle.
    pub command: String,
    /// Model that the unit was learnt with.
    pub unit_model: String,
    /// Command that the unit was learnt with.
    pub unit_command: String,
}

impl OtherBundle {
    fn message(&self) -> String {
        let Self { model, command, unit_model, unit_command } = self;
        if (model, command) == (unit_model, unit_command) {
            return format!(
                "the unit was learnt with another bundle than this one of `{model}` and \
                 `{command}`: learn it again from its recordings"
            );
        }
        format!(
            "the unit was learnt from recordings of `{unit_command}` on `{unit_model}`, and the \
             bundle is of `{command}` on `{model}`: give the unit that was learnt from this test, \
             or learn one (`fdi unit learn`)"
        )
    }
}

impl LearntUnit {
    /// The actuator, where a recording says it.
    pub fn actuator_id(&self) -> Option<&str> {
        self.actuator_id.as_deref()
    }

    /// Name of the model file.
    pub fn model_name(&self) -> &str {
        &self.model_name
    }

    /// Name of the test's command.
    pub fn command(&self) -> &str {
        &self.command
    }

    /// The recordings in the order in which they were learnt.
    pub fn recordings(&self) -> &[UnitRecording] {
        &self.recordings
    }

    /// Recordings of the unit as new.
    pub fn references(&self) -> usize {
        self.recordings.iter().filter(|one| one.state == UnitState::AsNew).count()
    }

    /// True where most recordings as new have the form of effects that the model file does not have.
    pub(crate) fn is_unmodelled_as_new(&self) -> bool {
        let as_new = self.recordings.iter().filter(|one| one.state == UnitState::AsNew);
        2 * as_new.filter(|one| !one.unmodelled().is_empty()).count() > self.references()
    }

    /// Sessions of the recordings; those that state none count as one.
    pub fn sessions(&self) -> usize {
        let mut sessions = Sessions::default();
        self.session_numbers(&mut sessions);
        sessions.known.len()
    }

    /// Notes that a component was replaced: what was learnt of it is of the old one.
    #[must_use]
    pub fn with_replaced(mut self, component: Component) -> Self {
        self.replaced[component as usize] += 1;
        self
    }

    /// Number of each recording's session; recordings that state none share one.
    fn session_numbers<'a>(&'a self, sessions: &mut Sessions<'a>) -> Vec<usize> {
        let stated = |one: &'a UnitRecording| match &one.session {
            Some(session) => Session::Stated(session),
            None => Session::OfTheUnit,
        };
        self.recordings.iter().map(|one| sessions.number(stated(one))).collect()
    }

    /// The machine as built with the parts that it has now, by all its recordings; `None` where they and
    /// the tolerances do not determine it.
    pub(crate) fn as_built(&self, quantities: &Quantities) -> Option<BuiltFit> {
        let learnt = Learnt { unit: self, test: OfTest::only(quantities) };
        let all = Earlier::of(&[learnt], &[]).others;
        Joint::learnt(&all, &self.replaced)?.as_built(&self.replaced)
    }

    /// True where the unit was learnt with a bundle of this model, test and set of numbers.
    pub fn is_of(&self, bundle: &Bundle) -> bool {
        self.check_basis(bundle, &Quantities::new(&bundle.experiment)).is_ok()
    }

    /// True where two units were learnt with bundles of one model, test and set of numbers.
    pub fn is_of_test_of(&self, other: &Self) -> bool {
        self.basis == other.basis
    }

    /// The recording that some evidence is of already: two recordings never agree to the last bit.
    pub(crate) fn with_evidence(&self, evidence: &Evidence) -> Option<&UnitRecording> {
        self.recordings.iter().find(|one| one.evidence == *evidence)
    }

    /// Refuses a unit whose evidence is of another model, test or set of numbers than a bundle's.
    pub(crate) fn check_basis(
        &self,
        bundle: &Bundle,
        quantities: &Quantities,
    ) -> Result<(), OtherBundle> {
        if self.basis == basis(bundle, quantities) {
            return Ok(());
        }
        Err(OtherBundle {
            model: bundle.experiment.model_name.clone(),
            command: bundle.experiment.name.clone(),
            unit_model: self.model_name.clone(),
            unit_command: self.command.clone(),
        })
    }
}

/// Unit as it was learnt from recordings of a test.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Learnt<'a> {
    pub(crate) unit: &'a LearntUnit,
    pub(crate) test: OfTest<'a>,
}

/// Recordings of a machine, of one test or several, beside those that are diagnosed.
#[derive(Clone, Debug)]
pub(crate) struct Earlier<'a> {
    pub(crate) others: Vec<OfUnit<'a>>,
    /// Number of the session of each recording diagnosed.
    pub(crate) sessions: Vec<usize>,
    /// Wear that the recordings diagnosed have where parts wear alike each session.
    pub(crate) worn: Wear,
    /// Place of the recordings diagnosed among those that are not as new, from 1.
    pub(crate) nth: usize,
}

impl<'a> Earlier<'a> {
    /// The recordings that units of one machine were learnt from, as they are explained together with
    /// recordings of some sessions, all in one state of health.
    ///
    /// Recordings diagnosed that state no session have one of their own: nothing says that it is of
    /// the references' day.
    pub(crate) fn of(units: &[Learnt<'a>], diagnosed: &[Option<&'a str>]) -> Self {
        let mut sessions = Sessions::default();
        let recordings: Vec<(&UnitRecording, OfTest<'a>, usize)> = units
            .iter()
            .flat_map(|learnt| {
                let numbers = learnt.unit.session_numbers(&mut sessions);
                let of_test = |(one, number)| (one, learnt.test, number);
                learnt.unit.recordings.iter().zip(numbers).map(of_test).collect::<Vec<_>>()
            })
            .collect();
        let of_diagnosed = |stated: Option<&'a str>| match stated {
            Some(session) => sessions.number(Session::Stated(session)),
            None => sessions.number(Session::OfTheDiagnosed),
        };
        let own: Vec<usize> = diagnosed.iter().copied().map(of_diagnosed).collect();
        let since =
            |(one, ..): &&(&UnitRecording, OfTest<'a>, usize)| one.state == UnitState::Since;
        let mut later: Vec<OfPart> = recordings
            .iter()
            .filter(since)
            .map(|(one, _, session)| OfPart { session: *session, replaced: one.replaced })
            .collect();
        let nth = later.len() + 1;
        let replaced = units.first().map(|learnt| learnt.unit.replaced).unwrap_or_default();
        let newest = own.first().map_or(sessions.known.len(), |&session| session);
        let diagnosed = OfPart { session: newest, replaced };
        later.push(diagnosed);
        let others = recordings.iter().map(|&(recording, test, session)| {
            let replaced = recording.replaced;
            let wear = match recording.state {
                UnitState::AsNew => Wear::AsNew,
                UnitState::Since => {
                    Wear::Since(sessions_worn(&later, OfPart { session, replaced }))
                }
            };
            OfUnit { evidence: &recording.evidence, test, session, wear, replaced }
        });
        let others = others.collect();
        let worn = Wear::Since(sessions_worn(&later, diagnosed));
        Self { others, sessions: own, worn, nth }
    }
}

/// Session of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Session<'a> {
    Stated(&'a str),
    /// None stated, of a recording that a unit was learnt from.
    OfTheUnit,
    /// None stated, of a recording that is diagnosed.
    OfTheDiagnosed,
}

/// Sessions in the order in which they were met.
#[derive(Clone, Debug, Default)]
struct Sessions<'a> {
    known: Vec<Session<'a>>,
}

impl<'a> Sessions<'a> {
    /// Number of a session, from 0.
    fn number(&mut self, session: Session<'a>) -> usize {
        self.known.iter().position(|one| *one == session).unwrap_or_else(|| {
            self.known.push(session);
            self.known.len() - 1
        })
    }
}

/// Session of a recording with the parts replaced before it.
#[derive(Clone, Copy, Debug)]
struct OfPart {
    session: usize,
    replaced: [u32; Component::COUNT],
}

/// Sessions of each component after those in which it was new, up to one of some recordings that are
/// not as new.
///
/// The first session of a part that was replaced is its session as new.
fn sessions_worn(later: &[OfPart], latest: OfPart) -> [usize; Component::COUNT] {
    let mut worn = [0; Component::COUNT];
    for (component, count) in worn.iter_mut().enumerate() {
        let times = latest.replaced[component];
        let mut sessions: Vec<usize> = Vec::new();
        for one in later.iter().filter(|one| one.replaced[component] == times) {
            if !sessions.contains(&one.session) {
                sessions.push(one.session);
            }
        }
        let place = sessions.iter().position(|&session| session == latest.session);
        let nth = place.map_or(sessions.len(), |place| place + 1);
        *count = nth - usize::from(times > 0);
    }
    worn
}

/// Identity of what evidence is on: the datasets of a bundle, and the numbers that show.
pub(crate) fn basis(bundle: &Bundle, quantities: &Quantities) -> String {
    let shown = quantities.names().join(" ");
    sha256_hex(format!("{} {shown}", bundle.dataset_sha256.join(" ")).as_bytes())
}

/// Session that a recording states, else its day.
pub(crate) fn session_of(metadata: &Metadata) -> Option<String> {
    let day = || metadata.date.as_ref().map(|date| date.as_str().chars().take(10).collect());
    metadata.session.clone().or_else(day)
}
