//! Limits of a file of datasets.

use crate::{
    offline::{dataset::ReferenceDesign, store},
    simulation::experiment::Experiment,
};

/// Bytes of a sample: in full, and rounded to 16 bits.
const BYTES_PER_SAMPLE: usize = 10;

/// Why datasets cannot be kept in one file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DatasetFileError {
    /// One design more than once.
    #[error("`{}` is given twice", design.name())]
    Twice {
        /// The design.
        design: ReferenceDesign,
    },
    /// A start angle for designs that all have their own.
    #[error("the designs asked for start anywhere")]
    StartsAnywhere,
    /// A file that could not be read again.
    #[error(
        "{signals} signals of {samples} samples make a file of {bytes} bytes, at most {most_bytes} \
         can be read"
    )]
    TooLarge {
        /// Signals of all designs.
        signals: usize,
        /// Samples of a signal.
        samples: usize,
        /// Bytes of the file.
        bytes: usize,
        /// Bytes that a reader takes.
        most_bytes: usize,
    },
}

/// Refuses datasets of an experiment, one for each design with so many fault conditions, that
/// cannot be made or could not be read again.
///
/// # Errors
///
/// [`DatasetFileError`] for a design that is given twice, for an experiment with a start angle
/// other than zero whose designs all start anywhere, and beyond
/// [`store::DECODE_LIMIT_BYTES`].
pub fn check_dataset_file(
    experiment: &Experiment,
    designs: &[ReferenceDesign],
    conditions: usize,
) -> Result<(), DatasetFileError> {
    for (index, &design) in designs.iter().enumerate() {
        if designs[..index].contains(&design) {
            return Err(DatasetFileError::Twice { design });
        }
    }
    let everywhere = designs.iter().all(|design| design.is_turned());
    if everywhere && experiment.scenario.start_angle_rad != 0.0 {
        return Err(DatasetFileError::StartsAnywhere);
    }
    let signals = designs.len().saturating_mul(conditions);
    let samples = experiment.samples();
    let bytes = signals.saturating_mul(samples).saturating_mul(BYTES_PER_SAMPLE);
    let most_bytes = store::DECODE_LIMIT_BYTES;
    if bytes > most_bytes {
        return Err(DatasetFileError::TooLarge { signals, samples, bytes, most_bytes });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use ReferenceDesign::{Incipient, Sparse, Turned, TurnedSparse};

    use super::*;

    fn told(start_angle_rad: f64, designs: &[ReferenceDesign], conditions: usize) -> String {
        let mut experiment = Experiment::chirp();
        experiment.scenario.start_angle_rad = start_angle_rad;
        let checked = check_dataset_file(&experiment, designs, conditions);
        checked.map_or_else(|error| error.to_string(), |()| String::new())
    }

    #[test]
    fn a_design_has_one_dataset_in_a_file() {
        assert_eq!(told(0.0, &[Incipient, Sparse], 100), "");
        assert_eq!(told(0.0, &[Incipient, Sparse, Incipient], 100), "`incipient` is given twice");
    }

    #[test]
    fn a_start_angle_needs_a_design_that_has_it() {
        assert_eq!(told(0.3, &[Turned, TurnedSparse], 100), "the designs asked for start anywhere");
        assert_eq!(told(0.3, &[Turned, Sparse], 100), "");
    }

    #[test]
    fn a_file_is_bounded_by_what_a_reader_takes() {
        let samples = Experiment::chirp().samples();
        let most = store::DECODE_LIMIT_BYTES / BYTES_PER_SAMPLE / samples;
        assert_eq!(told(0.0, &[Incipient], most), "");
        let error = told(0.0, &[Incipient], most + 1);
        assert!(error.contains("at most 268435456 can be read"), "{error}");
        assert_ne!(told(0.0, &[Incipient], usize::MAX / 2), "");
    }
}
