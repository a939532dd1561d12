//! Integration tests of `fdi-core`: what a user of the crate can see.

#![expect(
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "helpers of tests fail by panicking, and say when a test is skipped"
)]

mod beginning;
mod budget;
mod composite;
mod encoding;
mod fuzz;
mod outside;
mod own_clock;
mod properties;
mod voltage;
