//! Functions of several numbers side by side, with the bits that `libm` gives for each.
//!
//! They are loops without branches that a compiler takes in vectors where the caller is compiled for
//! an instruction set that has them.

pub use crate::{lane_exp::exp_of_lanes, lane_sine::sincos_of_lanes};
