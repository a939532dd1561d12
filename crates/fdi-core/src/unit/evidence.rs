//! Evidence of one recording on its machine, in a form that outlives the signal.
//!
//! ```text
//! −2·ln p(y | q) = (q − q₀)ᵀ·I·(q − q₀) − 2·gᵀ·(q − q₀) + const
//!                = |L⁻¹·g − Lᵀ·(q − q₀)|² + const           I = L·Lᵀ
//! ```
//!
//! with `q` all that the signal shows, the quantities of the machine and the errors of the sensors,
//! and `q₀` its most probable value. What damage and numbers do to `q` is exact wherever the form is
//! used; the signal's dependence on `q` is straight about `q₀`.

use ema_sim::EffectId;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Information on what does not show, over the most that there is.
const LEAST_INFORMATION: f64 = 1e-10;
/// Largest share of a white number's variance that recordings of a unit are taken to have in common.
const MOST_SHARED: f64 = 0.98;

/// The log-likelihood of a recording as a quadratic form in what its signal shows.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Evidence {
    /// Where the form is taken, `q₀`.
    pub(crate) at: Vec<f64>,
    /// Curvature of the form, `I`.
    pub(crate) information: DMatrix<f64>,
    /// Half of the descent of the form at `q₀`, `g`.
    pub(crate) descent: Vec<f64>,
    /// Covariance of `g` by that error of the low-fidelity model which every recording of the unit
    /// has, `Jᵀ·Σ⁻¹·S_u·Σ⁻¹·J`.
    pub(crate) shared: DMatrix<f64>,
    /// Temperature of the winding, where it was read.
    pub(crate) temperature: Option<TemperatureReading>,
    /// Effects that the model file does not have and that the residual has the form of; none where
    /// damage is beyond that of the machines whose error was learnt.
    pub(crate) unmodelled: Vec<EffectId>,
}

/// Temperature of the winding as it was read beside a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TemperatureReading {
    /// Reading less the temperature of the model file's numbers, K.
    pub(crate) away_k: f64,
    /// Standard deviation of the reading, K.
    pub(crate) std_k: f64,
}

/// Evidence as white numbers.
#[derive(Clone, Debug)]
pub(crate) struct WhiteEvidence {
    at: Vec<f64>,
    /// `Lᵀ`.
    upper: DMatrix<f64>,
    /// `L⁻¹·g`.
    white: DVector<f64>,
    /// Additions of one unit of each shared error of the model, beside other recordings of the unit.
    shared: Option<DMatrix<f64>>,
    /// Temperature of the winding, where it was read.
    pub(crate) temperature: Option<TemperatureReading>,
}

impl Evidence {
    /// The form as a sum of squares, for a recording alone; `None` where it is not finite.
    pub(crate) fn white(&self) -> Option<WhiteEvidence> {
        // what does not show at `q₀`, such as a static friction below the kinetic one, gets next to
        // no information in place of none, so that there is a factor
        let mut information = self.information.clone();
        let least = LEAST_INFORMATION * information.diagonal().max();
        for place in 0..information.nrows() {
            information[(place, place)] += least;
        }
        let lower = information.cholesky()?.l();
        let white = lower.solve_lower_triangular(&DVector::from_column_slice(&self.descent))?;
        let (at, upper, temperature) = (self.at.clone(), lower.transpose(), self.temperature);
        Some(WhiteEvidence { at, upper, white, shared: None, temperature })
    }

    /// The form for a recording beside others of its unit, with the shared error of the model set
    /// apart:
    ///
    /// ```text
    /// K = L⁻¹·(Jᵀ·Σ⁻¹·S_u·Σ⁻¹·J)·L⁻ᵀ
    /// z = (1 − K)^(−½)·(L⁻¹·g − Lᵀ·(q − q₀) − K^½·β)        β normal, one for all recordings
    /// ```
    pub(crate) fn white_beside_others(&self) -> Option<WhiteEvidence> {
        let alone = self.white()?;
        let lower = alone.upper.transpose();
        let half = lower.solve_lower_triangular(&self.shared)?;
        let share = lower.solve_lower_triangular(&half.transpose())?;
        let share = SymmetricEigen::new(0.5 * (&share + share.transpose()));
        let values = share.eigenvalues.map(|value| value.clamp(0.0, MOST_SHARED));
        let function = |of: fn(f64) -> f64| {
            &share.eigenvectors
                * DMatrix::from_diagonal(&values.map(of))
                * share.eigenvectors.transpose()
        };
        let apart = function(|value| 1.0 / (1.0 - value).sqrt());
        Some(WhiteEvidence {
            upper: &apart * alone.upper,
            white: &apart * alone.white,
            shared: Some(&apart * function(f64::sqrt)),
            at: alone.at,
            temperature: alone.temperature,
        })
    }
}

impl WhiteEvidence {
    /// White numbers of a form.
    pub(crate) fn len(&self) -> usize {
        self.white.len()
    }

    /// Addition of one unit of a shared error of the model; `None` for a recording alone.
    pub(crate) fn shared(&self, error: usize) -> Option<DVector<f64>> {
        Some(self.shared.as_ref()?.column(error).into_owned())
    }

    /// White residual at what a signal shows, without the shared error.
    pub(crate) fn residual(&self, shown: &[f64]) -> DVector<f64> {
        let moved = shown.iter().zip(&self.at).map(|(now, at)| now - at);
        &self.white - &self.upper * DVector::from_iterator(self.at.len(), moved)
    }

    /// White slope of a change of what the signal shows.
    pub(crate) fn slope(&self, shown: &[f64]) -> DVector<f64> {
        &self.upper * DVector::from_column_slice(shown)
    }
}
