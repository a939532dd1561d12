//! Tests of the crate as others use it.

mod analytic;
mod bad_input;
mod brute_force;
mod effects;
mod energy;
mod model_file;
mod severe;
