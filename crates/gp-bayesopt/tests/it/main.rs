//! Integration tests, one binary.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod adaptive;
mod baselines;
mod conversions;
mod gradients;
mod references;
mod robust;
mod sampling;
mod serialised;
mod solver;
mod study;
