//! Tests of the crate as others use it.

mod brute_force;
mod model_file;
mod severe;
