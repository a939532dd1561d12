//! A checkpoint as serialised data.

use serde::{Deserialize, Serialize};

use super::state::{Outcome, StudyState};
use crate::gp::SurrogateChoice;

/// Version of the layout; another one is refused.
const VERSION: u32 = 1;

/// A [`StudyState`] with the version of its layout.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Layout {
    version: u32,
    points: Vec<Vec<f64>>,
    outcomes: Vec<Outcome>,
    earlier: usize,
    pending: Vec<Vec<f64>>,
    asked: usize,
    hyperparameters: Option<Vec<f64>>,
    fitted_at: usize,
    /// Kernel and form of the outputs of the last fit, where they are chosen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    chosen: Option<SurrogateChoice>,
    cancelled: bool,
}

/// Reasons to refuse serialised data. `Study::resume` checks it against the options besides.
#[derive(Debug, thiserror::Error)]
pub(super) enum LayoutError {
    #[error("layout of version {found}, {VERSION} is read")]
    Version { found: u32 },
    #[error("{points} points but {outcomes} outcomes, {earlier} of them of earlier runs")]
    Counts { points: usize, outcomes: usize, earlier: usize },
    #[error("point {point} has {found} coordinates, the first has {expected}")]
    PointLength { point: usize, expected: usize, found: usize },
    #[error("outcome {outcome} is of another kind or length than those before")]
    Outcome { outcome: usize },
    #[error("a number of the {what} is NaN or infinite")]
    NotFinite { what: &'static str },
}

impl From<StudyState> for Layout {
    fn from(state: StudyState) -> Self {
        Self {
            version: VERSION,
            points: state.points,
            outcomes: state.outcomes,
            earlier: state.earlier,
            pending: state.pending,
            asked: state.asked,
            hyperparameters: state.hyperparameters,
            fitted_at: state.fitted_at,
            chosen: state.chosen,
            cancelled: state.cancelled,
        }
    }
}

impl TryFrom<Layout> for StudyState {
    type Error = LayoutError;

    fn try_from(layout: Layout) -> Result<Self, LayoutError> {
        layout.check()?;
        Ok(Self {
            points: layout.points,
            outcomes: layout.outcomes,
            earlier: layout.earlier,
            pending: layout.pending,
            asked: layout.asked,
            hyperparameters: layout.hyperparameters,
            fitted_at: layout.fitted_at,
            chosen: layout.chosen,
            cancelled: layout.cancelled,
        })
    }
}

impl Layout {
    fn check(&self) -> Result<(), LayoutError> {
        if self.version != VERSION {
            return Err(LayoutError::Version { found: self.version });
        }
        let (points, outcomes, earlier) = (self.points.len(), self.outcomes.len(), self.earlier);
        if points != outcomes || earlier > points || self.fitted_at > points {
            return Err(LayoutError::Counts { points, outcomes, earlier });
        }
        let mut all = self.points.iter().chain(&self.pending);
        let expected = all.clone().next().map_or(0, Vec::len);
        if let Some((point, odd)) = all.clone().enumerate().find(|(_, p)| p.len() != expected) {
            return Err(LayoutError::PointLength { point, expected, found: odd.len() });
        }
        let is_finite = |values: &Vec<f64>| values.iter().all(|value| value.is_finite());
        if !all.all(is_finite) {
            return Err(LayoutError::NotFinite { what: "points" });
        }
        if !self.hyperparameters.iter().all(is_finite) {
            return Err(LayoutError::NotFinite { what: "hyperparameters" });
        }
        self.check_outcomes()
    }

    fn check_outcomes(&self) -> Result<(), LayoutError> {
        let mut width = None;
        for (outcome, told) in self.outcomes.iter().enumerate() {
            // a number has no length, a vector has one
            let (found, finite) = match told {
                Outcome::Value(value) => (0, value.is_finite()),
                Outcome::Residual(values) => (values.len(), values.iter().all(|v| v.is_finite())),
                Outcome::Failed => continue,
            };
            if *width.get_or_insert(found) != found {
                return Err(LayoutError::Outcome { outcome });
            }
            if !finite {
                return Err(LayoutError::NotFinite { what: "outcomes" });
            }
        }
        Ok(())
    }
}
