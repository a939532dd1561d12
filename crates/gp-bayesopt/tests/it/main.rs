//! Integration tests, one binary.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod gradients;
mod solver;
mod study;
