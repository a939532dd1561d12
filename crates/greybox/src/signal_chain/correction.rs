//! Ways in which a recording is set right.

/// How a recording is set right.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Correction {
    /// A channel that is late, s.
    Earlier(f64),
    /// A channel that is a multiple of what it should be; −1 for a wrong sign.
    Divided(f64),
    /// Inputs behind the controller, in the unit of the drive at each sample: they leave the drive
    /// and push the machine as a load, by torque or force over the drive.
    Inputs { values: Vec<f64>, torque_per_drive: f64 },
}
