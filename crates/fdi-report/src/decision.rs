//! Numbers that the decisions of an answer rest on.

/// Chance that a fault that is not there is called detected, of a machine that is exactly its model
/// file.
pub const FALSE_ALARM_RATE: f64 = 0.003;
/// Chance that anything is called detected on a healthy machine within its tolerances: over all
/// findings together.
pub const FAMILY_FALSE_ALARM_RATE: f64 = 0.02;
/// Largest incipient level.
pub const INCIPIENT_LEVEL: f64 = 0.05;
