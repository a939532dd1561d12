//! Terms of the equation of motion that numbers of a machine set.

/// Term of the equation of motion that a number of a machine sets.
///
/// ```text
/// J·ω' = k·u − F·sgn ω − c·ω − load
/// ```
///
/// Recordings of a healthy machine determine these four together.
///
/// # Source
///
/// Inverse dynamic identification model with four parameters: Janot, Gautier, Brunot, "Data Set
/// and Reference Models of EMPS", 2019 Workshop on Nonlinear System Identification Benchmarks.
///
/// # Examples
///
/// ```
/// use ema_sim::{MotionTerm, Parameter};
///
/// let drag = Parameter::find("motor.viscous-n-m-s-per-rad").unwrap();
/// assert_eq!(drag.motion_term(), Some(MotionTerm::Drag));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MotionTerm {
    /// `J`, the inertia or mass that the motor moves; of a machine with a gear the motor's own.
    Inertia,
    /// `c`, torque or force over speed.
    Drag,
    /// `F`, kinetic dry friction.
    KineticFriction,
    /// `k`, torque or force over the drive signal; of a motor its back-EMF constant.
    TorqueConstant,
}
