//! One file a command.

mod bundle;
mod diagnose;
mod inspect;
mod schema;
mod simulate;

pub(crate) use bundle::{build, show};
pub use diagnose::diagnose_with;
pub(crate) use inspect::inspect;
pub(crate) use schema::schema;
pub(crate) use simulate::simulate;
