//! Fault detection and isolation of electromechanical actuators from stator current.
//!
//! ```text
//! offline  ReferenceDesign ─▶ high fidelity ─▶ Dataset ─▶ Bundle
//! online   Recording ─▶ signal ─▶ likelihood (bundle) ─▶ search ─▶ RecordDiagnosis
//! ```
//!
//! [`Bundle`] holds reference signals of the high-fidelity model. [`Diagnoser`] learns from them
//! how the low-fidelity model errs, and finds the fault levels at which that model and its learnt
//! error explain a recording. Levels come with a covariance, intervals and decisions; a recording
//! that no levels explain is `model-inadequate` (`docs/models/diagnosis.md`).
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

mod action;
mod diagnose;
mod offline;
mod online;
mod planning;
mod seed;
mod setup;
mod signal_diagnosis;
mod signals;
mod simulation;
mod statistics;
mod unit;

pub use action::{SEVERE_SHARE, SEVERE_TIMES, decide, decide_together};
pub use diagnose::Diagnoser;
/// The simulation whose types stand in this crate's interface.
pub use ema_sim;
/// The published forms that answers have.
pub use fdi_report as report;
pub use fdi_report::{
    Encoding, FALSE_ALARM_RATE, FitSignals, INCIPIENT_LEVEL, Schema, ToleranceUse,
    convergence_figure_svg, detection_figure_svg, fault_change_figure_svg, fault_figure_svg,
    fit_figure_svg, held_out_figure_svg, residual_curve_figure_svg, residual_curves_figure_svg,
    search_figure_svg, trend_figure_svg,
};
/// The statistics whose types stand in this crate's interface.
pub use inference::{BandedCholesky, BandedMatrix, NotPositiveDefinite};
pub use offline::artefact::{dataset_from_bytes, dataset_to_bytes};
pub use offline::bound::sensor_bound_std;
pub use offline::bundle::{
    Bundle, BundleError, ModelChoice, Modelled, StartAngle, default_noise_a,
};
pub use offline::dataset::{Condition, Dataset, DatasetError, DatasetRequest, ReferenceDesign};
pub use offline::dataset_file::{DatasetFileError, check_dataset_file};
pub use offline::embedded::{EMBEDDED_BUNDLES, EmbeddedBundle};
pub use offline::error_model::{CovarianceShape, ErrorModel, ErrorModelError, Trend};
pub use offline::joined_datasets::{ExperimentDifference, JoinedDatasets};
pub use offline::mode_figure::mode_figure_svg;
pub use offline::store;
pub use online::command_clock::timed_by_command;
pub use online::emulator::{Emulated, Emulator};
pub use online::error_bounds::{ErrorBound, ErrorBounds};
pub use online::fitting::fitting_experiment;
pub use online::high_search::{HighFidelityFit, HighFidelitySearch, HighFidelitySettings};
pub use online::learnt::CorrectedMonitor;
pub use online::observation_error::ObservationError;
pub use online::scalar_search::{ScalarMinimum, ScalarSearch, ScalarSearchError};
pub use online::wiring::MappedColumn;
pub use online::{error::DiagnoseError, options::DiagnoseOptions};
pub use planning::{PlanError, PlanRequest, PlannedTest, expected_stds, motion_limits, plan_test};
/// The recordings that are diagnosed.
pub use recordings::{
    self, AskedFor, Channel, ChannelKind, ChannelName, ClockNote, ColumnGuess, ColumnMap,
    ColumnMapError, CommandColumn, CommandSource, CsvFormat, Current, EnvelopeKind, FileFormat,
    Gaps, Metadata, OtherColumn, RecordError, Recording, RecordingDate, Sampling, SharedNumbers,
    StatedUnit, WriteError, guess_columns, is_decoding, list_recordings, nearest, recording_sha256,
};
/// The compression whose settings stand in this crate's interface.
pub use reduction;
pub use seed::{Purpose, RootSeed};
pub use setup::{Setup, SetupError, SetupOptions, check_test};
pub use signal_diagnosis::{EnvelopeSignal, SignalDiagnosis};
pub use simulation::compared_signals::{ComparedSignals, ComparedSignalsError, GivenCommand};
pub use simulation::experiment::{Experiment, ExperimentError, MASK_POINTS, Monitor, RECORDED};
pub use simulation::model_source::{ReadModelError, read_machine, read_model};
pub use simulation::recorded_test::RecordedTestError;
pub use simulation::resampling::resampled;
pub use simulation::simulated::{RecordedContent, SimulatedRecording, SimulatedRecordingError};
pub use simulation::simulated_axis::{
    AxisTest, axis_csv_format, command_channel, load_channel, with_current_noise,
};
pub use statistics::noise_covariance::unit_noise_covariance;
pub use statistics::parallel::in_parallel;
pub use unit::{
    contradiction::Contradiction,
    error::UnitErrorError,
    explaining::{
        Cause, CauseRecording, CauseTried, CauseVerdict, Causes, ExplainError, ExplainOptions,
    },
    layout::Component,
    learning::{Disagreement, NotLearnt, UnitLearningError},
    learnt_unit::{LearntUnit, OtherBundle, UnitRecording, UnitState},
    numbers::{LearntNumber, LearntNumbers},
    pooled::{DiagnosedAlone, TogetherError, diagnose_together},
    search::UnitSearchError,
    voltage::VoltageWorth,
};
