//! Fault detection and isolation of electromechanical actuators from stator current.
//!
//! ```text
//! offline  ReferenceDesign ─▶ high fidelity ─▶ Dataset ─▶ Bundle
//! online   Recording ─▶ signal ─▶ likelihood (bundle) ─▶ search ─▶ RecordDiagnosis
//! ```
//!
//! [`Bundle`] holds reference signals of the high-fidelity model. [`Diagnoser`] learns from them how
//! the monitoring model errs, and finds the fault levels at which monitor and learnt error explain
//! a recording. Levels come with a covariance, intervals and decisions; a recording that no levels
//! explain is `model-inadequate` (`docs/models/diagnosis.md`).
//!
//! ```
//! use fdi_core::{Bundle, EMBEDDED_BUNDLES, MASK_POINTS, ReferenceDesign};
//!
//! let bundle = Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes)?;
//! assert_eq!(bundle.experiment.name, "chirp");
//! assert_eq!(bundle.mask.len(), MASK_POINTS);
//! let incipient = bundle.dataset(ReferenceDesign::Incipient).expect("every bundle has it");
//! assert!(incipient.conditions.iter().all(|c| c.levels[..6].iter().all(|&k| k < 0.05)));
//! # Ok::<_, fdi_core::BundleError>(())
//! ```
//!
//! The crate's README has a diagnosis from end to end.

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod artefact;
mod banded;
mod bound;
mod bundle;
mod central;
mod commutation;
mod dataset;
mod diagnose;
mod electronics;
mod embedded;
mod emulator;
mod encoding;
mod encoding_bounds;
mod error_bounds;
mod error_choice;
mod error_model;
mod experiment;
mod high_monitor;
mod high_search;
mod likelihood;
mod mode_figure;
mod model_source;
mod noise_covariance;
mod observation;
mod parallel;
mod posterior;
mod recorded_test;
mod scalar_search;
mod seed;
mod signal_diagnosis;
mod signals;
mod simulated;
mod simulated_axis;
pub mod store;

pub use artefact::{dataset_from_bytes, dataset_to_bytes};
pub use banded::{BandedCholesky, BandedMatrix, NotPositiveDefinite};
pub use bound::sensor_bound_std;
pub use bundle::{
    Bundle, BundleError, MASK_POINTS, ModelChoice, Modelled, StartAngle, default_noise_a,
};
pub use dataset::{Condition, Dataset, DatasetError, DatasetRequest, ReferenceDesign};
pub use diagnose::{DiagnoseError, DiagnoseOptions, Diagnoser};
/// The simulation whose types stand in this crate's interface.
pub use ema_sim;
pub use embedded::{EMBEDDED_BUNDLES, EmbeddedBundle};
pub use emulator::{Emulated, Emulator};
pub use encoding::Encoding;
pub use error_bounds::{ErrorBound, ErrorBounds};
pub use error_model::{CovarianceShape, ErrorModel, ErrorModelError, Trend};
pub use experiment::{Experiment, ExperimentError, Monitor, RECORDED};
/// The published forms that answers have.
pub use fdi_report as report;
pub use fdi_report::{
    FALSE_ALARM_RATE, FitSignals, INCIPIENT_LEVEL, Schema, convergence_figure_svg,
    detection_figure_svg, fault_change_figure_svg, fault_figure_svg, fit_figure_svg,
    held_out_figure_svg, residual_curve_figure_svg, residual_curves_figure_svg, search_figure_svg,
    trend_figure_svg,
};
pub use high_search::{HighFidelityFit, HighFidelitySearch, HighFidelitySettings};
pub use mode_figure::mode_figure_svg;
pub use model_source::{ReadModelError, read_machine, read_model};
pub use noise_covariance::unit_noise_covariance;
pub use observation::ObservationError;
pub use parallel::in_parallel;
pub use recorded_test::RecordedTestError;
/// The recordings that are diagnosed.
pub use recordings::{
    self, AskedFor, Channel, ChannelKind, ChannelName, ColumnGuess, ColumnMap, ColumnMapError,
    CommandColumn, CommandSource, CsvFormat, Current, EnvelopeKind, FileFormat, Metadata,
    OtherColumn, RecordError, Recording, RecordingDate, Sampling, StatedUnit, WriteError,
    guess_columns, is_decoding, list_recordings, nearest, recording_sha256,
};
pub use scalar_search::{ScalarMinimum, ScalarSearch, ScalarSearchError};
pub use seed::{Purpose, RootSeed};
pub use signal_diagnosis::{EnvelopeSignal, SignalDiagnosis};
pub use simulated::{RecordedContent, SimulatedRecording, SimulatedRecordingError, resampled};
pub use simulated_axis::AxisTest;
