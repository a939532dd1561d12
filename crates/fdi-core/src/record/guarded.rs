//! Decoders that others wrote, kept from taking the program with them.

use std::panic::{AssertUnwindSafe, catch_unwind};

use super::{FileFormat, RecordError};

/// Runs a decoder over bytes of unknown origin: a panic inside it is the file's fault and
/// becomes an error. The decoder's state is dropped with it, so nothing half done is seen.
pub(super) fn guarded<T>(
    format: FileFormat,
    decode: impl FnOnce() -> Result<T, RecordError>,
) -> Result<T, RecordError> {
    catch_unwind(AssertUnwindSafe(decode)).unwrap_or_else(|_| {
        Err(RecordError::Damaged { format, reason: "the decoder gave up on it".to_owned() })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decoder_that_panics_is_an_error() {
        let outcome: Result<(), _> = guarded(FileFormat::Mf4, || panic!("a test of the guard"));
        let message = outcome.unwrap_err().to_string();
        assert_eq!(message, "damaged `.mf4` file: the decoder gave up on it");
    }
}
