//! Tests of the blind cases.
