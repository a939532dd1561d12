//! Traces of runs that may have ended early.

use crate::{runaway::Runaway, simulation_error::SimulationError};

/// A trace that knows whether its run came to its end.
pub(crate) trait Ended: Sized {
    /// The reason why it did not.
    fn runaway(&self) -> Option<&Runaway>;

    /// All channels of the trace.
    fn channels(&mut self) -> Vec<&mut Vec<f64>>;

    /// With NaN where a run that ended early has no samples, so that nothing takes it for whole.
    fn filled(mut self, samples: usize) -> Self {
        if self.runaway().is_some() {
            for channel in self.channels() {
                channel.resize(samples, f64::NAN);
            }
        }
        self
    }

    /// The trace of a whole run.
    fn whole(self) -> Result<Self, SimulationError> {
        match self.runaway() {
            Some(runaway) => Err(SimulationError::Runaway(Box::new(runaway.clone()))),
            None => Ok(self),
        }
    }
}
