//! Readers: one file a format, chosen by the table of `format.rs`.
//!
//! The table declares the module of each reader; how to add one stands there.

mod clean_text;
mod dialect;
mod guarded;
mod number_text;
mod preamble;
mod single_precision;
mod stamp;
mod text_encoding;
mod time_decimals;

pub use dialect::Dialect;
pub use guarded::is_decoding;
pub use in_memory::MemoryColumn;
pub(crate) use number_text::is_lacking;

use std::path::Path;

use crate::{
    ColumnMap, FileFormat, RecordError, Recording, format::formats, sha256::sha256_hex, source,
};

use guarded::guarded;

/// Makes a recording of the name and the bytes of a file.
type Reader = fn(String, Vec<u8>, &ColumnMap) -> Result<Recording, RecordError>;

macro_rules! readers {
    ($($variant:ident $ending:literal $what:literal [$($feature:tt)?] $decoder:ident $module:ident;)+) => {
        #[cfg_attr(
            not(any($($(feature = $feature,)?)+)),
            expect(dead_code, reason = "without another format no file has columns to assemble")
        )]
        mod container;
        mod chosen_rows;
        mod in_memory;
        $(
            $(#[cfg(feature = $feature)])?
            mod $module;
        )+

        /// The reader of a format.
        ///
        /// # Errors
        /// [`RecordError::NotBuiltIn`] where this build leaves the format out.
        fn reader(format: FileFormat) -> Result<Reader, RecordError> {
            match format {
                $(
                    $(#[cfg(feature = $feature)])?
                    FileFormat::$variant => Ok($module::read),
                    $(
                        #[cfg(not(feature = $feature))]
                        FileFormat::$variant => {
                            Err(RecordError::NotBuiltIn { format, feature: $feature })
                        }
                    )?
                )+
            }
        }
    };
}

formats!(readers);

impl Recording {
    /// Reads a file of any [`FileFormat`] that is built in, known by its name; the
    /// recording's [`name`](Self::name) is the path.
    ///
    /// # Errors
    /// Any [`RecordError`] but those of the `require_…` checks. The message does
    /// not repeat the path, which the caller knows.
    pub fn read(path: &Path, map: &ColumnMap) -> Result<Self, RecordError> {
        let (format, bytes) = source::read_bytes(path)?;
        Self::from_bytes(path.display().to_string(), format, bytes, map)
    }

    /// Reads a file as [`read`](Self::read) does, and gives the SHA-256 of the bytes that were read.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn read_with_sha256(path: &Path, map: &ColumnMap) -> Result<(Self, String), RecordError> {
        let (format, bytes) = source::read_bytes(path)?;
        let sha256 = sha256_hex(&bytes);
        Ok((Self::from_bytes(path.display().to_string(), format, bytes, map)?, sha256))
    }

    /// Reads the bytes of a file.
    ///
    /// # Errors
    /// As [`read`](Self::read), without those of the file itself.
    pub fn from_bytes(
        name: impl Into<String>,
        format: FileFormat,
        bytes: Vec<u8>,
        map: &ColumnMap,
    ) -> Result<Self, RecordError> {
        let (name, read) = (name.into(), reader(format)?);
        if format.has_foreign_decoder() {
            return guarded(format, || read(name, bytes, map));
        }
        read(name, bytes, map)
    }

    /// Reads the text of a recording, not compressed.
    ///
    /// # Errors
    /// As [`read`](Self::read), without those of the file itself.
    pub fn parse(
        name: impl Into<String>,
        bytes: &[u8],
        map: &ColumnMap,
    ) -> Result<Self, RecordError> {
        csv::parse(name.into(), bytes, map)
    }
}
