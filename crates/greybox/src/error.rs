//! Errors of an explanation.

use ema_sim::SimulationError;

use crate::signal_chain::{SignalCode, SignalFind};

/// Why recordings could not be compared with a model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GreyboxError {
    /// Nothing to fit.
    #[error("no recording to train on")]
    NoTraining,
    /// A recording of no use.
    #[error("{record}: {reason}")]
    Record {
        /// Which.
        record: String,
        /// Reason, and what was expected.
        reason: String,
    },
    /// Recordings whose signal chain is not sound.
    #[error("{told}")]
    Signal {
        /// Lack in a word.
        code: SignalCode,
        /// Lack and remedy in words.
        told: String,
    },
    /// A recording too short to be compared.
    #[error("{record}: lasts {duration_s:.3} s, expected {least_s} s at least")]
    Short {
        /// Which.
        record: String,
        /// Length of the recording.
        duration_s: f64,
        /// Least length.
        least_s: f64,
    },
    /// Recordings that the catalogue explains whatever they show, and nothing tells the noise.
    #[error(
        "the recordings fitted have {samples} samples at the rate compared, no more than the catalogue has \
         numbers: they tell no noise; record longer, or at a higher rate"
    )]
    FewSamples {
        /// Samples compared.
        samples: usize,
    },
    /// One recording given for two uses.
    #[error("{first} and {second} are one recording, expected one use of each")]
    Twice {
        /// The recording.
        first: String,
        /// The recording under its other name.
        second: String,
    },
    /// The rates of controller and recording do not fit.
    #[error(
        "{record}: sampled at {rate_hz} Hz, which the controller's {sample_hz} Hz is no multiple of"
    )]
    Rate {
        /// Which recording.
        record: String,
        /// Rate of the recording.
        rate_hz: f64,
        /// The controller's.
        sample_hz: f64,
    },
    /// A number that the machine does not have.
    #[error("`{key}`: no number of the machine, expected a key of its model file")]
    Number {
        /// Key.
        key: String,
    },
    /// The model cannot be run on a recording's command.
    #[error("{record}: {reason}")]
    Simulation {
        /// Which recording.
        record: String,
        /// Reason that the simulation gives.
        reason: SimulationError,
    },
    /// A simulation that has no finite answer.
    #[error("{record}: the model's answer is not finite")]
    NotFinite {
        /// Which recording.
        record: String,
    },
}

impl From<&SignalFind> for GreyboxError {
    fn from(find: &SignalFind) -> Self {
        Self::Signal { code: find.code, told: find.sentence() }
    }
}

/// Nothing where the machine cannot be run so: at such numbers it explains nothing, and that is no
/// error.
pub(crate) fn if_run<T>(outcome: Result<T, GreyboxError>) -> Result<Option<T>, GreyboxError> {
    match outcome {
        Ok(value) => Ok(Some(value)),
        Err(GreyboxError::Simulation { .. } | GreyboxError::NotFinite { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}
