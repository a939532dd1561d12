//! Integration tests of `recordings`: what a user of the crate can see.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail by panicking")]

mod files;
mod properties;
mod readers;
