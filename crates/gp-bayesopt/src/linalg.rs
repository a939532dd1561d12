//! Small dense linear algebra on contiguous memory.
//!
//! The kernels work element by element in a fixed order, without fused
//! multiply-add, so that every vector width gives the same bits; the width is
//! chosen at run time ([`wide`]). Factors of many rows are made by blocks instead.

mod blocked;
mod cholesky;
mod least_squares;
mod symmetric;

pub(crate) use cholesky::{Factor, GROUP, factor, lanes_dot, subtract_rows, wide};
pub(crate) use least_squares::damped_step;
pub(crate) use symmetric::{eigen, solve_positive, solve_small};
