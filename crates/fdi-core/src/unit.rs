//! A machine whose numbers are known only to their tolerances: what its current shows of them, how
//! the low-fidelity model errs on such machines, and which damage explains a recording.

pub(crate) mod acting;
pub(crate) mod agreement;
pub(crate) mod answer;
pub(crate) mod causes;
pub(crate) mod contradiction;
pub(crate) mod design;
pub(crate) mod effect_error;
pub(crate) mod embedded_error;
pub(crate) mod error;
pub(crate) mod evidence;
pub(crate) mod explaining;
pub(crate) mod file;
pub(crate) mod finding;
pub(crate) mod identifiability;
pub(crate) mod joint;
pub(crate) mod layout;
pub(crate) mod learning;
pub(crate) mod learnt_unit;
pub(crate) mod modelled;
pub(crate) mod monitor;
pub(crate) mod numbers;
pub(crate) mod placed;
pub(crate) mod pooled;
pub(crate) mod quantities;
pub(crate) mod search;
pub(crate) mod sensors;
#[cfg(test)]
mod tests;
pub(crate) mod together;
pub(crate) mod trend;
pub(crate) mod uneven_sensors;
pub(crate) mod unmodelled;
pub(crate) mod variants;
pub(crate) mod voltage;
pub(crate) mod volts;
pub(crate) mod weight;
