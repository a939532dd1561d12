//! One file a command.

mod bundle;
mod calibrate;
mod dataset;
mod diagnose;
mod effects;
mod evaluate;
mod explain;
mod generated;
mod inspect;
mod merge;
mod propose;
mod schema;
mod setup;
mod simulate;
mod unit;

pub(crate) use bundle::{build, show};
pub(crate) use calibrate::calibrate;
pub(crate) use dataset::dataset;
pub use diagnose::diagnose_with;
pub(crate) use diagnose::{diagnose, list_sha256, sources};
pub(crate) use effects::effects;
pub(crate) use evaluate::evaluate_protocol;
pub(crate) use explain::explain;
pub(crate) use generated::{completions, man};
pub(crate) use inspect::inspect;
pub(crate) use merge::merge;
pub(crate) use propose::propose;
pub(crate) use schema::schema;
pub(crate) use setup::setup;
pub(crate) use simulate::simulate;
pub(crate) use unit::{learn, reset, show_unit, update, write_model};
