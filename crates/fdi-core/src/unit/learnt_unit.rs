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
        evidence::Evidence,
        joint::{BuiltFit, Joint, OfUnit, Wear},
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
}

/// A unit that was learnt with another bundle than the one it is used with.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the unit was learnt with another bundle than this one of `{model}` and `{command}`: learn it \
     again from its recordings"
)]
pub struct OtherBundle {
    /// Model of the bundle.
    pub model: String,
    /// Command of the bundle.
    pub command: String,
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
        self.session_numbers(None).1
    }

    /// Notes that a component was replaced: what was learnt of it is of the old one.
    #[must_use]
    pub fn with_replaced(mut self, component: Component) -> Self {
        self.replaced[component as usize] += 1;
        self
    }

    /// Number of each recording's session, and that of another recording.
    ///
    /// Recordings that state no session share one. A recording diagnosed that states none has its
    /// own: nothing says that it is of the references' day.
    fn session_numbers(&self, other: Option<&str>) -> (Vec<usize>, usize) {
        let mut known: Vec<Option<&str>> = Vec::new();
        let mut numbers = Vec::new();
        for recording in &self.recordings {
            let session = recording.session.as_deref();
            let number = known.iter().position(|one| *one == session).unwrap_or_else(|| {
                known.push(session);
                known.len() - 1
            });
            numbers.push(number);
        }
        let of_other = known.iter().position(|one| one.is_some() && *one == other);
        (numbers, of_other.unwrap_or(known.len()))
    }

    /// The recordings as they are explained together with one of a session.
    pub(crate) fn earlier(&self, session: Option<&str>) -> Earlier<'_> {
        let (numbers, of_other) = self.session_numbers(session);
        let mut later: Vec<(usize, [u32; Component::COUNT])> = Vec::new();
        let others = self.recordings.iter().zip(numbers).map(|(recording, session)| {
            let replaced = recording.replaced;
            let wear = match recording.state {
                UnitState::AsNew => Wear::AsNew,
                UnitState::Since => {
                    later.push((session, replaced));
                    Wear::Since(sessions_worn(&later))
                }
            };
            OfUnit { evidence: &recording.evidence, session, wear, replaced }
        });
        let others = others.collect();
        let nth = later.len() + 1;
        later.push((of_other, self.replaced));
        Earlier { others, session: of_other, worn: Wear::Since(sessions_worn(&later)), nth }
    }

    /// The machine as built with the parts that it has now, by all its recordings; `None` where they and
    /// the tolerances do not determine it.
    pub(crate) fn as_built(&self, quantities: &Quantities) -> Option<BuiltFit> {
        let all = self.earlier(None).others;
        Joint::learnt(quantities, &all, &self.replaced)?.as_built(&self.replaced)
    }

    /// True where the unit was learnt with a bundle of this model, test and set of numbers.
    pub fn is_of(&self, bundle: &Bundle) -> bool {
        self.check_basis(bundle, &Quantities::new(&bundle.experiment)).is_ok()
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
        let (model, command) =
            (bundle.experiment.model_name.clone(), bundle.experiment.name.clone());
        Err(OtherBundle { model, command })
    }
}

/// Recordings of a unit beside one that is diagnosed.
#[derive(Clone, Debug)]
pub(crate) struct Earlier<'a> {
    pub(crate) others: Vec<OfUnit<'a>>,
    /// Number of the session diagnosed.
    pub(crate) session: usize,
    /// Wear that the recording diagnosed has where parts wear alike each session.
    pub(crate) worn: Wear,
    /// Place of the recording diagnosed among those that are not as new, from 1.
    pub(crate) nth: usize,
}

/// Sessions of each component after those in which it was new, up to the last of some recordings that
/// are not as new, each given by its session and the parts replaced before it.
///
/// The first session of a part that was replaced is its session as new.
fn sessions_worn(later: &[(usize, [u32; Component::COUNT])]) -> [usize; Component::COUNT] {
    let mut worn = [0; Component::COUNT];
    let Some((_, latest)) = later.last() else { return worn };
    for (component, count) in worn.iter_mut().enumerate() {
        let same = later.iter().filter(|(_, replaced)| replaced[component] == latest[component]);
        let mut sessions: Vec<usize> = same.map(|(session, _)| *session).collect();
        sessions.sort_unstable();
        sessions.dedup();
        *count = sessions.len() - usize::from(latest[component] > 0);
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
