//! Observers of a run, who see every segment exactly as it was solved.

use crate::{
    drive_train::DriveTrain,
    phase::PerPhase,
    series::Series,
    shorted_loops::ShortedLoops,
    winding::{LegVolts, SectorWinding, Segment},
};

/// The legs during a segment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Circuit<'a> {
    /// Potentials of the positive and the negative phase's legs.
    pub(crate) legs: LegVolts,
    /// Potential of the idle phase's leg while a diode of it conducts, or while it is connected.
    pub(crate) idle_v: f64,
    /// True where the idle phase's leg is switched as the others are.
    pub(crate) connected: bool,
    pub(crate) at: &'a SectorWinding,
    /// Resistance of the winding over that of the cold one.
    pub(crate) warmth_ratio: f64,
    /// Shorted turns in which a current circulates.
    pub(crate) shorted: Option<&'a ShortedLoops>,
}

/// The surface during a segment, where an elastic shaft drives it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceSegment {
    pub(crate) motor_speed: Series,
    pub(crate) speed: Series,
    /// Torque of the shaft on the surface.
    pub(crate) torque: Series,
    pub(crate) per_gear_ratio: f64,
    /// Loss of the gear besides that torque, over it.
    pub(crate) gear_loss_ratio: f64,
    pub(crate) load_n_m: f64,
    pub(crate) inertia_kg_m2: f64,
    pub(crate) stiffness_n_m_per_rad: f64,
    pub(crate) damping_n_m_s_per_rad: f64,
    /// Twist of the shaft at the end, beyond the play; zero where no flank holds.
    pub(crate) beyond_rad: f64,
}

/// An observer; the one that sees nothing is `()` and costs nothing.
pub(crate) trait Probe {
    /// A segment, before the state moves to its end.
    fn segment(
        &mut self,
        segment: &Segment,
        span_s: f64,
        circuit: &Circuit<'_>,
        train: &DriveTrain,
    );

    /// Kinetic energy is lost at a stop.
    fn impact(&mut self, lost_j: f64);

    /// The surface in the segment that was just seen.
    fn surface(&mut self, _: &SurfaceSegment, _: f64) {}

    /// A flank lets go of a twist.
    fn released(&mut self, _energy_j: f64) {}

    /// A tick of the controller, with what the current's sensor adds to each phase in it.
    fn tick(&mut self, _sensor_error_a: &PerPhase) {}

    /// Factor on the longest segment; below one, segments are cut finer.
    fn longest_segment_ratio(&self) -> f64 {
        1.0
    }
}

impl Probe for () {
    #[inline]
    fn segment(&mut self, _: &Segment, _: f64, _: &Circuit<'_>, _: &DriveTrain) {}
    #[inline]
    fn impact(&mut self, _: f64) {}
}
