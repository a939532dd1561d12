use crate::{Matrix, Snapshots, decomposition, decomposition::NoConvergence, rank::numerical_rank};

/// Why sensitivities could not be learnt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SensitivityError {
    /// Parameters and snapshots do not belong together.
    #[error("parameters of {found} snapshots given for {expected}")]
    Count {
        /// Rows of parameters.
        found: usize,
        /// Snapshots.
        expected: usize,
    },
    /// Fewer snapshots than coefficients at a location.
    #[error("{found} snapshots cannot determine {needed} coefficients at a location")]
    TooFewSnapshots {
        /// Snapshots given.
        found: usize,
        /// Coefficients of the polynomial.
        needed: usize,
    },
    /// Parameters that do not vary independently over the snapshots.
    #[error("{terms} coefficients at a location, but the parameters span only {rank}")]
    Dependent {
        /// Coefficients of the polynomial.
        terms: usize,
        /// Rank of the regression.
        rank: usize,
    },
    /// A point with another number of parameters.
    #[error("{found} parameters where the regression has {expected}")]
    Parameters {
        /// Parameters given.
        found: usize,
        /// Parameters of the regression.
        expected: usize,
    },
    /// The decomposition of the regression matrix did not converge.
    #[error(transparent)]
    NoConvergence(#[from] NoConvergence),
}

/// Polynomial that the snapshots are regressed on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Regression {
    /// Constant and linear terms: one sensitivity for all parameters.
    #[default]
    Linear,
    /// All terms up to the second degree: a sensitivity at each point.
    Quadratic,
}

/// How signals answer to parameters, learnt from snapshots alone.
///
/// ```text
/// y(p) ≈ c + S·q + Σ_{a ≤ b} Q_ab·q_a·q_b,   q = (p − p̄) / s_p
/// ```
///
/// least squares over the snapshots at each location, `p̄` and `s_p` the mean
/// and the standard deviation of each parameter.
///
/// # Valid for
///
/// Parameters on which the signals depend smoothly. A direction and its
/// amplitude (a periodic parameter) are to be given as two cartesian ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensitivities {
    centre: Vec<f64>,
    scale: Vec<f64>,
    /// Constant, linear, then quadratic coefficients, in units of `scale`.
    coefficients: Matrix,
    residual_rms: f64,
}

impl Sensitivities {
    /// Regresses snapshots on parameters, one row a snapshot.
    ///
    /// # Errors
    ///
    /// Each [`SensitivityError`] but [`Parameters`](SensitivityError::Parameters).
    pub fn regress(
        snapshots: &Snapshots,
        parameters: &Matrix,
        regression: Regression,
    ) -> Result<Self, SensitivityError> {
        let (found, expected) = (parameters.rows(), snapshots.count());
        if found != expected {
            return Err(SensitivityError::Count { found, expected });
        }
        let (centre, scale) = centre_and_scale(parameters);
        let terms: Vec<Vec<f64>> = (0..expected)
            .map(|row| polynomial(&standardised(&parameters.row(row), &centre, &scale), regression))
            .collect();
        let needed = terms[0].len();
        if needed > expected {
            return Err(SensitivityError::TooFewSnapshots { found: expected, needed });
        }
        let values = terms.concat();
        let design = Matrix::raw(needed, expected, values);
        let svd = decomposition::thin_svd(&design)?;
        let rank = numerical_rank(&svd.singular_values, expected, needed);
        if rank < needed {
            return Err(SensitivityError::Dependent { terms: needed, rank });
        }
        // C = Y·V·Σ⁻¹·Uᵀ for Y ≈ C·(U·Σ·Vᵀ).
        let mut along = snapshots.matrix().times(&svd.right);
        for (index, singular) in svd.singular_values.iter().enumerate() {
            along.column_mut(index).iter_mut().for_each(|value| *value /= singular);
        }
        let coefficients = along.times(&svd.left.transposed());
        let explained = coefficients.times(&design);
        let residual = explained.values().iter().zip(snapshots.matrix().values());
        let squares: f64 = residual.map(|(a, b)| (a - b).powi(2)).sum();
        let residual_rms = (squares / explained.values().len() as f64).sqrt();
        Ok(Self { centre, scale, coefficients, residual_rms })
    }

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        self.centre.len()
    }

    /// Number of locations of the signals.
    pub fn locations(&self) -> usize {
        self.coefficients.rows()
    }

    /// Mean of each parameter over the snapshots, where
    /// [`at_centre`](Self::at_centre) holds.
    pub fn centre(&self) -> &[f64] {
        &self.centre
    }

    /// Root mean square of what the polynomial leaves of the snapshots.
    pub fn residual_rms(&self) -> f64 {
        self.residual_rms
    }

    /// Change of the signal per unit of each parameter at the centre, one
    /// parameter a column.
    pub fn at_centre(&self) -> Matrix {
        self.gradient(&vec![0.0; self.parameters()])
    }

    /// Change of the signal per unit of each parameter at a point, one
    /// parameter a column.
    ///
    /// # Errors
    ///
    /// [`SensitivityError::Parameters`].
    pub fn at(&self, parameters: &[f64]) -> Result<Matrix, SensitivityError> {
        let (found, expected) = (parameters.len(), self.parameters());
        if found != expected {
            return Err(SensitivityError::Parameters { found, expected });
        }
        Ok(self.gradient(&standardised(parameters, &self.centre, &self.scale)))
    }

    /// Directions in which the polynomial moves the signal over the snapshots:
    /// every coefficient but the constant, in units of a standard deviation.
    pub(crate) fn directions(&self) -> Matrix {
        let rows = self.locations();
        Matrix::raw(
            rows,
            self.coefficients.columns() - 1,
            self.coefficients.values()[rows..].to_vec(),
        )
    }

    fn gradient(&self, point: &[f64]) -> Matrix {
        let count = point.len();
        let mut weights = Matrix::zeros(self.coefficients.columns(), count);
        for a in 0..count {
            weights.set(1 + a, a, 1.0 / self.scale[a]);
        }
        let mut term = 1 + count;
        if self.coefficients.columns() > term {
            for a in 0..count {
                for b in a..count {
                    weights.set(term, a, weights.get(term, a) + point[b] / self.scale[a]);
                    weights.set(term, b, weights.get(term, b) + point[a] / self.scale[b]);
                    term += 1;
                }
            }
        }
        self.coefficients.times(&weights)
    }
}

fn centre_and_scale(parameters: &Matrix) -> (Vec<f64>, Vec<f64>) {
    let count = parameters.rows() as f64;
    (0..parameters.columns())
        .map(|index| {
            let column = parameters.column(index);
            let mean = column.iter().sum::<f64>() / count;
            let variance = column.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
            // A constant parameter is refused by the rank of the regression.
            (mean, if variance > 0.0 { variance.sqrt() } else { 1.0 })
        })
        .unzip()
}

fn standardised(point: &[f64], centre: &[f64], scale: &[f64]) -> Vec<f64> {
    point
        .iter()
        .zip(centre)
        .zip(scale)
        .map(|((value, mean), width)| (value - mean) / width)
        .collect()
}

fn polynomial(point: &[f64], regression: Regression) -> Vec<f64> {
    let mut terms = vec![1.0];
    terms.extend_from_slice(point);
    if regression == Regression::Quadratic {
        for (a, first) in point.iter().enumerate() {
            terms.extend(point[a..].iter().map(|second| first * second));
        }
    }
    terms
}
