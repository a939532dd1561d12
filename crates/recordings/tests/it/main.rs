//! Integration tests of `recordings`: what a user of the crate can see.

#![expect(
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "helpers of tests fail by panicking, and say when a test is skipped"
)]

mod files;
mod properties;
mod readers;
