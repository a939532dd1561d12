//! Numbers that the decisions of an answer rest on.

/// Chance that a fault that is not there is called detected.
pub const FALSE_ALARM_RATE: f64 = 0.003;
/// Largest incipient level.
pub const INCIPIENT_LEVEL: f64 = 0.05;
