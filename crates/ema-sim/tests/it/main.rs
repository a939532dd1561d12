//! Tests of the crate as others use it.

mod model_file;
