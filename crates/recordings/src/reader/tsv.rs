//! Text whose cells stand apart by tabs.

pub(super) use super::csv::read;
