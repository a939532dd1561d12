//! Why a run ended.

/// Why a solver or a study ended; none of them is an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum StopReason {
    /// The objective reached the target.
    TargetReached,
    /// The step, or what it could still gain, is below the tolerance.
    Converged,
    /// The allowed evaluations are spent.
    BudgetSpent,
    /// No progress over the allowed number of tries.
    Stalled,
    /// The caller asked to stop.
    Cancelled,
}
