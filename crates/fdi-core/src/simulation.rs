//! The machine in a test: experiments, models, simulated recordings.

pub(crate) mod compared_signals;
pub(crate) mod cut_phase;
pub(crate) mod drive_signal;
pub(crate) mod envelope;
pub(crate) mod experiment;
pub(crate) mod high_fidelity_signal;
pub(crate) mod low_pass;
pub(crate) mod model_source;
pub(crate) mod recorded_test;
pub(crate) mod resampling;
pub(crate) mod sampled;
pub(crate) mod shifting;
pub(crate) mod simulated;
pub(crate) mod simulated_axis;
