//! Recordings of electric machines: channels with their own time axes, and metadata.
//!
//! A recording is a file of channels; the names of its columns carry the units. CSV is always
//! read; Parquet, MATLAB 5 to 7, MDF 4, TDMS and HDF5 with the features `parquet`, `mat`, `mf4`,
//! `tdms`, `hdf5`.
//! Every message of a file that cannot be read names line, column or field, and what was
//! expected. The crate knows no machine.
//!
//! ```
//! use recordings::{ChannelName, ColumnMap, Recording};
//!
//! let text = "# rate-hz = 2000\ntime_s,current_a\n0,0.10\n0.0005,0.12\n0.0010,0.11\n";
//! let recording = Recording::parse("bench.csv", text.as_bytes(), &ColumnMap::default())?;
//! let current = recording.channel(ChannelName::Current).expect("the file has it");
//! assert_eq!(current.values(), [0.10, 0.12, 0.11]);
//! assert_eq!(current.sampling()?.rate_hz, 2000.0);
//! # Ok::<_, recordings::RecordError>(())
//! ```

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod align;
mod channel;
mod channel_name;
mod clock;
mod column_map;
mod error;
mod evened;
mod format;
mod guess;
mod held_rows;
mod kernel;
mod lines;
mod long_form;
mod metadata;
mod metadata_key;
mod name_pattern;
mod nearest;
mod places;
mod property;
mod reader;
mod recording;
mod row_choice;
mod row_places;
mod rows_beside;
mod sampling;
mod sha256;
mod shared_numbers;
mod source;
mod star;
mod unit;
mod writer;

pub use align::{AskedFor, CommandColumn};
pub use channel::{Channel, OtherColumn};
pub use channel_name::{ChannelKind, ChannelName};
pub use column_map::{ColumnMap, ColumnMapError};
pub use error::RecordError;
pub use evened::{ClockNote, Gaps, TakenRate};
pub use format::FileFormat;
pub use guess::{ColumnGuess, guess_columns};
pub use metadata::{CommandSource, EnvelopeKind, Metadata, RecordingDate, WINDING_TEMPERATURES_K};
pub use metadata_key::{METADATA_KEYS, MetadataKey};
pub use name_pattern::{NamePattern, NamedRecording};
pub use nearest::nearest;
pub use property::Property;
pub use reader::{Dialect, MemoryColumn, is_decoding};
pub use recording::{Current, Recording};
pub use row_places::RowPlaces;
pub use sampling::Sampling;
pub use sha256::sha256_hex;
pub use shared_numbers::SharedNumbers;
pub use source::{list_recordings, recording_sha256};
pub use unit::StatedUnit;
pub use writer::{CsvFormat, WriteError};
