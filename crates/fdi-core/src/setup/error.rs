//! Reasons why a machine cannot be set up.

use ema_sim::SimulationError;
use recordings::{RecordError, Recording};

use crate::{
    report::{SetupRefusal, SetupRefusalCode},
    simulation::simulated::SimulatedRecordingError,
};

/// Why a machine cannot be set up.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SetupError {
    /// Test or recordings are not fit for it.
    #[error("{}{}", .0.recording.as_ref().map(|name| format!("{name}: ")).unwrap_or_default(), .0.reason)]
    Refused(SetupRefusal),
    /// The unit cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The simulated tests form no recording.
    #[error(transparent)]
    Recording(#[from] SimulatedRecordingError),
    /// The columns of a simulated test form no recording.
    #[error(transparent)]
    Columns(#[from] RecordError),
}

impl SetupError {
    pub(super) fn refused(
        code: SetupRefusalCode,
        recording: Option<&Recording>,
        reason: String,
    ) -> Self {
        let recording = recording.map(|one| one.name.clone());
        Self::Refused(SetupRefusal { code, recording, reason })
    }
}
