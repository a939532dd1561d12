//! Corrections of a recording: shifts, factors, and inputs taken for a load.

/// Change that sets a recording right.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Correction {
    /// A channel brought earlier, s; of what stands at its end all channels are cut.
    Earlier(f64),
    /// A channel divided by a factor.
    Divided(f64),
    /// Inputs behind the controller taken off the drive signal and put into the load.
    Inputs {
        /// Input at each sample, in the unit of the drive.
        values: Vec<f64>,
        /// Torque or force over the drive signal.
        torque_per_drive: f64,
    },
}
