//! Errors of commutation and of the back-EMF's shape.

use crate::waveform::Waveform;

/// Electrical angle that a segment covers at most.
const LONGEST_ELECTRICAL_RAD: f64 = 0.1;
/// Share of the time constant of the torque's dip that a segment covers at most.
const LONGEST_DIP: f64 = 0.1;

/// Errors of commutation and of the back-EMF's shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CommutationErrors {
    /// Shape of the back-EMF.
    pub(crate) wave: Waveform,
    /// Angle by which the commutation is early, electrical.
    pub(crate) offset_rad: f64,
    /// True where the wave or the sectors are not the machine's own.
    pub(crate) shaped: bool,
}

impl CommutationErrors {
    /// No errors.
    pub(crate) const NONE: Self = Self {
        wave: Waveform { flat_loss_rad: 0.0, fifth: 0.0, seventh: 0.0 },
        offset_rad: 0.0,
        shaped: false,
    };
}

/// Longest turn of the motor in a segment with errors of commutation.
pub(crate) fn longest_turn_rad(pole_pairs: f64) -> f64 {
    LONGEST_ELECTRICAL_RAD / pole_pairs
}

/// Longest segment with a dip of the torque after commutation.
pub(crate) fn longest_span_s(dip_s: f64) -> f64 {
    LONGEST_DIP * dip_s
}
