//! Errors of blind cases.

use crate::class::Class;

/// Why there is no case, or no recording for a command.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BlindError {
    /// No draw gave what the class asks for.
    #[error("no {} case in {draws} draws with seed {seed}", .class.name())]
    NothingFits {
        /// The seed.
        seed: u64,
        /// The class.
        class: Class,
        /// Draws tried.
        draws: u64,
    },
    /// A command without a column that it needs.
    #[error("the command has no column `{column}`")]
    NoColumn {
        /// The column.
        column: &'static str,
    },
    /// A line of a command that is not numbers.
    #[error("line {line} of the command is not numbers")]
    NotNumbers {
        /// The line, from 1.
        line: usize,
    },
    /// A command too short or too long to record.
    #[error("the command has {samples} samples, expected 2 to {most}")]
    Length {
        /// Samples at 2 kHz, or lines where there are fewer than two.
        samples: usize,
        /// Most samples.
        most: usize,
    },
}
