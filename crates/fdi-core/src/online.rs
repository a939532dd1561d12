//! Steps of a diagnosis: observation, likelihood, searches, posterior, answer.

pub(crate) mod answer;
pub(crate) mod beginning;
pub(crate) mod cache;
pub(crate) mod commutation;
pub(crate) mod damage;
pub(crate) mod emulator;
pub(crate) mod error;
pub(crate) mod error_bounds;
pub(crate) mod fit;
pub(crate) mod high_search;
pub(crate) mod learnt;
pub(crate) mod likelihood;
pub(crate) mod method;
pub(crate) mod mixture;
pub(crate) mod noise_level;
pub(crate) mod observation;
pub(crate) mod options;
pub(crate) mod outcome;
pub(crate) mod plan;
pub(crate) mod posterior;
pub(crate) mod references;
pub(crate) mod run;
pub(crate) mod scalar_search;
pub(crate) mod severe_errors;
pub(crate) mod suspected_start;
pub(crate) mod watch;
