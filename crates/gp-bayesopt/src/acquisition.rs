//! Criteria that say where to look next; all are maximised.

mod expected;
mod lookahead;
mod norm;

pub(crate) use expected::one_output;
pub use expected::{Acquisition, Confidence, Scored};
pub(crate) use lookahead::Second;
pub use lookahead::{Fantasies, TwoStep};
pub use norm::NormImprovement;
pub(crate) use norm::{Cumulants, ln_improvement_above, ln_with_slope};
