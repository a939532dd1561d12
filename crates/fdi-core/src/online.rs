//! What is made of a recording: observation, likelihood, searches, posterior.

pub(crate) mod commutation;
pub(crate) mod emulator;
pub(crate) mod high_monitor;
pub(crate) mod likelihood;
pub(crate) mod observation;
pub(crate) mod posterior;
pub(crate) mod scalar_search;
pub(crate) mod signals;
