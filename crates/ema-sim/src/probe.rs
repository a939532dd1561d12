//! What an observer sees of a run: every segment, exactly as it was solved.

use crate::{
    drive_train::DriveTrain,
    winding::{SectorWinding, Segment},
};

/// The legs during a segment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Circuit<'a> {
    /// Potentials of the positive and the negative phase's legs.
    pub(crate) legs_v: (f64, f64),
    /// Potential of the idle phase's leg while a diode of it conducts, or while it is connected.
    pub(crate) idle_v: f64,
    /// Whether the idle phase's leg is switched as the others are.
    pub(crate) connected: bool,
    pub(crate) at: &'a SectorWinding,
    /// Resistance of the winding over that of the cold one.
    pub(crate) warmth_ratio: f64,
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
