//! Integration tests of `experiments`: what a user of the crate can see.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail by panicking")]

mod evaluation;
mod numbers;
mod seeded_searches;
mod severe;
