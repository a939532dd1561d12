//! Cases shared by the benches: seeded and in memory.

pub mod bayesopt;
pub mod diagnose;
pub mod reduce;
pub mod simulate;
