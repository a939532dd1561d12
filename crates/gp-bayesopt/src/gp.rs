//! Gaussian process regression with one kernel for all outputs.

mod data;
mod evidence;
mod fit;
#[cfg(feature = "serde")]
mod layout;
mod leave_one_out;
mod predict;
mod selection;

pub use fit::{FitReport, GaussianProcess, GpOptions, Hyperparameters, Noise};
pub use leave_one_out::LeaveOneOut;
pub(crate) use predict::{Belief, BeliefSlope, Block};
pub use predict::{Prediction, PredictionSlope};
pub use selection::{ChosenSurrogate, SurrogateChoice};
