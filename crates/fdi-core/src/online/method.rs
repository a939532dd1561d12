//! Search methods, one file each, and the choice among them.

pub(crate) mod composite;
pub(crate) mod emulator;
pub(crate) mod free_start;
pub(crate) mod gls;
pub(crate) mod high_fidelity;
pub(crate) mod levenberg_marquardt;
pub(crate) mod response_surface;
pub(crate) mod scalar;
pub(crate) mod severe;
pub(crate) mod unsettled;

use crate::{
    online::{
        error::DiagnoseError,
        noise_level::Noise,
        outcome::Outcome,
        plan::Search,
        run::{Hypothesis, Run},
    },
    report::Fidelity,
};

impl Run<'_> {
    /// Explains the recording under a hypothesis.
    pub(crate) fn explain(
        &self,
        hypothesis: &Hypothesis,
        noise: Noise,
    ) -> Result<Outcome, DiagnoseError> {
        let noise_a = noise.level_a;
        let outcome = match &self.plan.search {
            Search::LeastSquares => self.least_squares(hypothesis, noise_a)?,
            Search::Composite => self.composite(hypothesis, noise_a)?,
            Search::Scalar(criterion) => self.scalar(hypothesis, noise_a, criterion.clone())?,
            Search::Emulator => match self.emulated(noise_a)? {
                Some(outcome) => outcome,
                None => self.least_squares(hypothesis, noise_a)?,
            },
        };
        match self.plan.fidelity {
            Fidelity::Low => Ok(outcome),
            Fidelity::High => self.refined(hypothesis, noise, outcome),
        }
    }
}
