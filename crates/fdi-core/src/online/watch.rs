//! Observers of a diagnosis.

/// Who is shown what a diagnosis does.
pub(crate) struct Watch<'a> {
    /// Shown the residual of every evaluation of the low-fidelity model, A.
    pub(crate) residual: &'a dyn Fn(&[f64]),
    /// Shown the signal and the residual that an answer rests on, A; the last one is that of the
    /// diagnosis.
    pub(crate) answer: &'a dyn Fn(&[f64], &[f64]),
}

impl Watch<'_> {
    pub(crate) const NOTHING: Self = Self { residual: &|_| {}, answer: &|_, _| {} };
}
