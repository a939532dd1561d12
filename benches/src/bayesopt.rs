//! Inverse problems and the methods that are compared on them.

mod held_out;
mod inversion;
mod methods;
mod problem;
mod regression;
mod tracker;

pub use held_out::held_out;
pub use inversion::{inversion, reference_values};
pub use methods::{METHODS, Method, Start, local_runs_to_truth, run};
pub use problem::{Chart, Problem};
pub use regression::regression;
pub use tracker::{Level, Run, Tracker};
