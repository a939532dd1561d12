//! Integration tests of `fdi`: exit code, standard output and standard error.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail by panicking")]

mod batch;
mod binary;
mod reference;
mod stand_in;
