//! Tests of the blind cases from outside.

mod alone;
mod cases;
