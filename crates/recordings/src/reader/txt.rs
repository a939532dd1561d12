//! Text whose table is written in whatever way; what it shows is read.

pub(super) use super::csv::read;
