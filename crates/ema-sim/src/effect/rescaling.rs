//! Factors on constants of the machine that effects change for a whole run.

/// Factors on constants of the machine, and the voltage that its inverter loses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rescaling {
    /// Torque constant and back-EMF.
    pub(crate) torque_constant_ratio: f64,
    /// Gains of the position loop.
    pub(crate) position_gain_ratio: f64,
    /// Proportional gain of the speed loop.
    pub(crate) speed_gain_ratio: f64,
    /// Integral gain of the speed loop.
    pub(crate) speed_integral_ratio: f64,
    /// Limit of the controller's output.
    pub(crate) output_limit_ratio: f64,
    /// Mean voltage lost in the inverter's dead time.
    pub(crate) lost_v: f64,
}

impl Rescaling {
    /// The machine as it is.
    pub(crate) const NONE: Self = Self {
        torque_constant_ratio: 1.0,
        position_gain_ratio: 1.0,
        speed_gain_ratio: 1.0,
        speed_integral_ratio: 1.0,
        output_limit_ratio: 1.0,
        lost_v: 0.0,
    };
}
