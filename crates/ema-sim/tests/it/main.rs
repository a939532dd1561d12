//! Tests of the crate as others use it.

mod analytic;
mod bad_input;
mod brute_force;
mod effects;
mod energy;
mod measured;
mod model_file;
mod servo_axis;
mod severe;
