//! The signals behind an answer: what was measured, what the model says, what is left.

/// Signals that a diagnosis compared, on the filtered envelope.
///
/// All signals have one sample at each time `i / rate_hz` from the start of the test.
#[derive(Clone, Debug, PartialEq)]
pub struct FitSignals {
    /// Rate of the samples, Hz.
    pub rate_hz: f64,
    /// The filtered envelope of the recording, A.
    pub measured_a: Vec<f64>,
    /// The monitoring model with the mean of its learnt error, at the levels of the answer, A.
    pub modelled_a: Vec<f64>,
    /// Root mean square of the residual at each evaluation of the monitor, in their order, A;
    /// empty for methods that evaluate none.
    pub searched_rms_a: Vec<f64>,
}

impl FitSignals {
    /// Measured less modelled envelope, A.
    pub fn residual_a(&self) -> Vec<f64> {
        self.measured_a.iter().zip(&self.modelled_a).map(|(y, m)| y - m).collect()
    }
}
