//! Readers: one file a format, and the one place that chooses between them.

#[cfg_attr(
    not(any(feature = "mat", feature = "mf4", feature = "parquet", feature = "tdms")),
    expect(dead_code, reason = "without another format no file has columns to assemble")
)]
mod container;
mod csv;
mod guarded;
#[cfg(feature = "mat")]
mod mat;
#[cfg(feature = "mf4")]
mod mf4;
#[cfg(feature = "parquet")]
mod parquet;
#[cfg(feature = "parquet")]
mod parquet_pages;
#[cfg(feature = "tdms")]
mod tdms;

pub(crate) use container::Property;
pub(crate) use csv::parse as parse_csv;
pub use guarded::is_decoding;

use crate::{ColumnMap, FileFormat, RecordError, Recording, source};

/// Reads the bytes of a file of a format.
pub(crate) fn read(
    name: String,
    format: FileFormat,
    bytes: Vec<u8>,
    map: &ColumnMap,
) -> Result<Recording, RecordError> {
    match format {
        FileFormat::Csv | FileFormat::CsvGz => csv::parse(name, &source::text(bytes, format)?, map),
        #[cfg(feature = "mat")]
        FileFormat::Mat => container::assemble(name, &mat::MatFile::open(&bytes)?, map),
        #[cfg(feature = "mf4")]
        FileFormat::Mf4 => mf4::read(name, bytes, map),
        #[cfg(feature = "parquet")]
        FileFormat::Parquet => parquet::read(name, bytes, map),
        #[cfg(feature = "tdms")]
        FileFormat::Tdms => container::assemble(name, &tdms::TdmsFile::open(bytes)?, map),
        #[cfg(not(all(feature = "mat", feature = "mf4", feature = "parquet", feature = "tdms")))]
        format => Err(format.left_out()),
    }
}
