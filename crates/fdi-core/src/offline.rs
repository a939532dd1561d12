//! Learning before a recording is seen: reference datasets, error models, bundles.

pub(crate) mod artefact;
pub(crate) mod bound;
pub(crate) mod bundle;
pub(crate) mod dataset;
pub(crate) mod dataset_file;
pub(crate) mod electronics;
pub(crate) mod embedded;
pub(crate) mod encoder_fit;
pub(crate) mod encoding;
pub(crate) mod encoding_bounds;
pub(crate) mod error_choice;
pub(crate) mod error_model;
pub(crate) mod estimator;
pub(crate) mod factor;
pub(crate) mod joined_datasets;
pub(crate) mod mode_figure;
pub(crate) mod rounded_signals;
pub(crate) mod signal_codes;
pub mod store;
pub(crate) mod summary;
