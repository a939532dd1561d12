//! Integration tests of `fdi`: exit code, standard output and standard error.

#![expect(
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "helpers of tests fail by panicking, and say when a test is skipped"
)]

mod any_actuator;
mod batch;
mod binary;
mod bundle;
mod clocks;
mod commands;
mod config;
mod decisions;
mod diagnosis;
mod effects;
mod explain;
mod explained;
mod files;
mod first_guide;
mod fleet_guide;
#[cfg(unix)]
mod guides;
mod killed;
mod load;
mod merge;
mod missed;
mod planned;
mod reference;
mod report;
mod schema;
mod sealed;
mod servo_axis;
mod setup;
mod stand_in;
mod together;
mod two_phases;
mod unit;
mod voltage;
mod wiring;
