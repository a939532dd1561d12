//! Fault detection and isolation of electromechanical actuators from stator current.
//!
//! # Recordings
//!
//! A recording is a file of channels, each with its own time axis; the names of
//! its columns carry the units (`docs/formats.md`).
//!
//! ```
//! use fdi_core::{ChannelName, ColumnMap, Recording};
//!
//! let text = "# rate-hz = 2000\ntime_s,current_a\n0,0.10\n0.0005,0.12\n0.0010,0.11\n";
//! let recording = Recording::parse("bench.csv", text.as_bytes(), &ColumnMap::default())?;
//! let current = recording.channel(ChannelName::Current).expect("the file has it");
//! assert_eq!(current.values(), [0.10, 0.12, 0.11]);
//! assert_eq!(current.sampling()?.rate_hz, 2000.0);
//! # Ok::<_, fdi_core::RecordError>(())
//! ```

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod banded;
mod error_model;
mod experiment;
mod noise_covariance;
mod record;
pub mod report;
mod schema;
mod seed;
pub mod store;

pub use banded::{BandedCholesky, BandedMatrix, NotPositiveDefinite};
pub use error_model::{ErrorModel, ErrorModelError, Trend, choose_taper};
pub use experiment::{Experiment, Monitor};
pub use noise_covariance::unit_noise_covariance;
pub use record::{
    Channel, ChannelKind, ChannelName, ColumnMap, ColumnMapError, CommandSource, CsvFormat,
    Current, EnvelopeKind, Metadata, OtherColumn, RecordError, Recording, RecordingDate, Sampling,
    WriteError, list_recordings,
};
pub use schema::Schema;
pub use seed::{Purpose, RootSeed};
