//! Decoders that others wrote, kept from taking the program with them.

use std::{
    cell::Cell,
    panic::{AssertUnwindSafe, catch_unwind},
};

use crate::{FileFormat, RecordError};

thread_local! {
    static IS_DECODING: Cell<bool> = const { Cell::new(false) };
}

/// True while this thread runs a decoder whose panics become errors.
///
/// A program that sets a panic hook asks this, so that a damaged file is told as the error that
/// it is and nothing else.
pub fn is_decoding() -> bool {
    IS_DECODING.get()
}

/// Runs a decoder over bytes of unknown origin: a panic inside it is the file's fault and
/// becomes an error. The decoder's state is dropped with it, so nothing half done is seen.
pub(super) fn guarded<T>(
    format: FileFormat,
    decode: impl FnOnce() -> Result<T, RecordError>,
) -> Result<T, RecordError> {
    IS_DECODING.set(true);
    let outcome = catch_unwind(AssertUnwindSafe(decode));
    IS_DECODING.set(false);
    outcome.unwrap_or_else(|_| {
        Err(RecordError::Damaged { format, reason: "the decoder gave up on it".to_owned() })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decoder_that_panics_is_an_error() {
        let outcome: Result<(), _> = guarded(FileFormat::Mf4, || {
            assert!(is_decoding());
            panic!("a test of the guard")
        });
        assert!(!is_decoding());
        let message = outcome.unwrap_err().to_string();
        assert_eq!(message, "damaged `.mf4` file: the decoder gave up on it");
    }
}
