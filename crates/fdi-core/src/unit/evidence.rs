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
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SymmetricEigen};

use crate::unit::voltage::VoltageReading;

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
    /// Covariance of `g` by the learnt error of the low-fidelity model, `Jᵀ·Σ⁻¹·S·Σ⁻¹·J`.
    pub(crate) error: DMatrix<f64>,
    /// Shares of it that other recordings of the unit have too.
    pub(crate) in_common: InCommon,
    /// Error of the model that looks like other quantities, where it was learnt apart.
    pub(crate) embedded: Option<EmbeddedShare>,
    /// Temperature of the winding, where it was read.
    pub(crate) temperature: Option<TemperatureReading>,
    /// Numbers that the motor's voltage shows, where it was recorded.
    pub(crate) voltage: Option<VoltageReading>,
    /// Effects that the model file does not have and that the residual has the form of; none where
    /// damage is beyond that of the machines whose error was learnt.
    pub(crate) unmodelled: Vec<EffectId>,
}

/// Error of the model that looks like other quantities, in a form that has it as one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct EmbeddedShare {
    /// Covariance of the descent by it.
    pub(crate) error: DMatrix<f64>,
    /// Shares of it that other recordings of the unit have too.
    pub(crate) in_common: InCommon,
}

/// Shares of the learnt error that recordings of one unit and test have in common, each with those
/// before it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct InCommon {
    /// In whatever state of health, on whatever day.
    pub(crate) unit: f64,
    /// In one state of health, on whatever day.
    pub(crate) state: f64,
    /// In one state of health on one day, where the drive's noise alone is another.
    pub(crate) session: f64,
}

impl InCommon {
    /// Shares as they were found, each at least as large as the one before.
    pub(crate) fn nested(unit: f64, state: f64, session: f64) -> Self {
        let unit = unit.clamp(0.0, 1.0);
        let state = state.clamp(unit, 1.0);
        Self { unit, state, session: session.clamp(state, 1.0) }
    }

    /// Share of the unit, and what state and session have beyond it.
    fn steps(self) -> [f64; 3] {
        [self.unit, self.state - self.unit, self.session - self.state]
    }

    /// The shares as they are kept.
    pub(crate) fn shares(self) -> [f64; 3] {
        [self.unit, self.state, self.session]
    }

    /// Shares that were kept; `None` where they are none.
    pub(crate) fn of_shares([unit, state, session]: [f64; 3]) -> Option<Self> {
        let is_nested = 0.0 <= unit && unit <= state && state <= session && session <= 1.0;
        is_nested.then_some(Self { unit, state, session })
    }

    /// Shares that some recording has with others: none of those that no other recording is of.
    pub(crate) fn with(self, others: With) -> Self {
        let unit = if others.of_unit { self.unit } else { 0.0 };
        let state = if others.of_state { self.state } else { unit };
        Self { unit, state, session: if others.of_session { self.session } else { state } }
    }
}

/// Other recordings that there are: of the unit, of its state of health, of the session in that
/// state.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct With {
    pub(crate) of_unit: bool,
    pub(crate) of_state: bool,
    pub(crate) of_session: bool,
}

/// Temperature of the winding as it was read beside a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TemperatureReading {
    /// Reading less the temperature of the model file's numbers, K.
    pub(crate) away_k: f64,
    /// Standard deviation of the reading, K.
    pub(crate) std_k: f64,
}

/// Evidence as white numbers: those of the current, then those of the voltage.
#[derive(Clone, Debug)]
pub(crate) struct WhiteEvidence {
    /// All that the current shows, then what the voltage does.
    at: Vec<f64>,
    /// Change of what the voltage shows by each quantity at which it is found, where it was recorded.
    pub(crate) voltage_by: Option<DMatrix<f64>>,
    /// `Lᵀ`.
    upper: DMatrix<f64>,
    /// `L⁻¹·g`.
    white: DVector<f64>,
    /// Additions of one unit of each error of the model in common with other recordings: of the unit,
    /// of the state, of the session.
    in_common: [Option<DMatrix<f64>>; 3],
    /// Temperature of the winding, where it was read.
    pub(crate) temperature: Option<TemperatureReading>,
}

/// Recordings that an error of the model is common to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CommonTo {
    Unit,
    State,
    Session,
}

impl Evidence {
    /// The form where the error of the model also looks like a change of the quantities, which have the
    /// first places, with covariance `D = F·Fᵀ`:
    ///
    /// ```text
    /// W = 1 − I·F·(1 + Fᵀ·I·F)⁻¹·Fᵀ        I ← W·I        g ← W·g        E ← W·E·Wᵀ
    /// ```
    ///
    /// with `E` the covariance of `g` by the rest of the model's error; that by the change of the
    /// quantities is `W·I·D·I·Wᵀ`. `None` where the form is not finite.
    pub(crate) fn with_embedded_error(
        self,
        quantities: &DMatrix<f64>,
        in_common: InCommon,
    ) -> Option<Self> {
        if quantities.iter().all(|value| *value == 0.0) {
            return Some(self);
        }
        let size = self.information.nrows();
        let root = SymmetricEigen::new(quantities.clone());
        let roots = root.eigenvalues.map(|value| value.max(0.0).sqrt());
        let mut factor = DMatrix::zeros(size, quantities.ncols());
        let of_quantities = root.eigenvectors * DMatrix::from_diagonal(&roots);
        factor.view_mut((0, 0), quantities.shape()).copy_from(&of_quantities);
        let shown = &self.information * &factor;
        let inner = DMatrix::identity(factor.ncols(), factor.ncols()) + factor.tr_mul(&shown);
        let inner = inner.cholesky()?;
        let share = DMatrix::identity(size, size) - &shown * inner.solve(&factor.transpose());
        let lost = &shown * inner.solve(&shown.transpose());
        let as_quantities = &share * shown;
        Some(Self {
            information: symmetric(&(self.information - lost)),
            descent: (&share * DVector::from_vec(self.descent)).data.into(),
            error: symmetric(&(&share * self.error * share.transpose())),
            embedded: Some(EmbeddedShare {
                error: symmetric(&(&as_quantities * as_quantities.transpose())),
                in_common,
            }),
            ..self
        })
    }

    /// The form as a sum of squares, with the error of the model set apart that others of its unit
    /// have too:
    ///
    /// ```text
    /// K_u = L⁻¹·(ρ_u·E + ρ_u′·E′)·L⁻ᵀ        K_s, K_d alike of what state and session have beyond it
    /// z = (1 − K_u − K_s − K_d)^(−½)·(L⁻¹·g − Lᵀ·(q − q₀) − K_u^½·β_u − K_s^½·β_s − K_d^½·β_d)
    /// ```
    ///
    /// with `E` the covariance of `g` by the learnt error, `E′` by the part of it that looks like other
    /// quantities, and `β` normal: one for all recordings of the unit, one for those of a state of health,
    /// one for those of a session. The numbers of the voltage, whose error is all learnt (`K = 1`), follow
    /// those of the current. `None` where the form is not finite.
    pub(crate) fn white(&self, with: With) -> Option<WhiteEvidence> {
        let mut white = self.white_current(with)?;
        if let Some(voltage) = &self.voltage {
            white.append(voltage.white(voltage.in_common.with(with))?);
        }
        Some(white)
    }

    fn white_current(&self, with: With) -> Option<WhiteEvidence> {
        // what does not show at `q₀`, such as a static friction below the kinetic one, gets next to
        // no information in place of none, so that there is a factor
        let mut information = self.information.clone();
        let least = LEAST_INFORMATION * information.diagonal().max();
        for place in 0..information.nrows() {
            information[(place, place)] += least;
        }
        let lower = information.cholesky()?.l();
        let white = lower.solve_lower_triangular(&DVector::from_column_slice(&self.descent))?;
        let (at, temperature) = (self.at.clone(), self.temperature);
        let shared = self.shared(&lower, with)?;
        let [unit, state, session] = &shared;
        let Some(all) = added(added(unit.clone(), state.as_ref()), session.as_ref()) else {
            let (upper, in_common) = (lower.transpose(), [None, None, None]);
            let voltage_by = None;
            return Some(WhiteEvidence { at, voltage_by, upper, white, in_common, temperature });
        };
        let apart = function_of(all, |value| 1.0 / (1.0 - value.clamp(0.0, MOST_SHARED)).sqrt());
        let root = |value: f64| value.clamp(0.0, MOST_SHARED).sqrt();
        let additions = shared.map(|part| part.map(|part| &apart * function_of(part, root)));
        Some(WhiteEvidence {
            upper: &apart * lower.transpose(),
            white: &apart * white,
            in_common: additions,
            voltage_by: None,
            at,
            temperature,
        })
    }

    /// Covariances of the white numbers that recordings of the unit have in common, and those of a state
    /// and of a session beyond them, by the lower factor of the form.
    fn shared(&self, lower: &DMatrix<f64>, with: With) -> Option<[Option<DMatrix<f64>>; 3]> {
        let embedded = self.embedded.as_ref().map(|one| (&one.error, one.in_common));
        let mut shared = [const { None }; 3];
        for (error, in_common) in
            [Some((&self.error, self.in_common)), embedded].into_iter().flatten()
        {
            let steps = in_common.with(with).steps();
            if steps == [0.0; 3] {
                continue;
            }
            let half = lower.solve_lower_triangular(error)?;
            let white = symmetric(&lower.solve_lower_triangular(&half.transpose())?);
            for (sum, share) in shared.iter_mut().zip(steps).filter(|(_, share)| *share > 0.0) {
                *sum = added(sum.take(), Some(&(share * &white)));
            }
        }
        Some(shared)
    }
}

/// The sum of two matrices, either of which may be none.
fn added(first: Option<DMatrix<f64>>, second: Option<&DMatrix<f64>>) -> Option<DMatrix<f64>> {
    match (first, second) {
        (Some(first), Some(second)) => Some(first + second),
        (first, second) => first.or_else(|| second.cloned()),
    }
}

/// A function of a symmetric matrix, by its eigenvalues.
fn function_of(matrix: DMatrix<f64>, of: impl Fn(f64) -> f64) -> DMatrix<f64> {
    let eigen = SymmetricEigen::new(matrix);
    let values = DMatrix::from_diagonal(&eigen.eigenvalues.map(of));
    &eigen.eigenvectors * values * eigen.eigenvectors.transpose()
}

/// The symmetric part of a matrix.
fn symmetric(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    0.5 * (matrix + matrix.transpose())
}

impl VoltageReading {
    /// The numbers of the voltage as white ones.
    fn white(&self, in_common: InCommon) -> Option<WhiteEvidence> {
        let lower = self.covariance.clone().cholesky().as_ref().map(Cholesky::<f64, Dyn>::l)?;
        let session = in_common.session.min(MOST_SHARED);
        let apart = 1.0 / (1.0 - session).sqrt();
        let upper = apart * lower.try_inverse()?;
        let size = self.numbers.len();
        let (unit, state) = (in_common.unit.min(session), in_common.state.min(session));
        let in_common = [unit, state - unit, session - state].map(|share| {
            (share > 0.0).then(|| DMatrix::from_diagonal_element(size, size, apart * share.sqrt()))
        });
        Some(WhiteEvidence {
            at: self.numbers.to_vec(),
            voltage_by: Some(self.by_quantities.clone()),
            white: DVector::zeros(size),
            upper,
            in_common,
            temperature: None,
        })
    }
}

/// A matrix with another below and to the right of it.
fn beside(first: &DMatrix<f64>, second: &DMatrix<f64>) -> DMatrix<f64> {
    let [(rows, columns), (more_rows, more_columns)] = [first.shape(), second.shape()];
    let mut both = DMatrix::zeros(rows + more_rows, columns + more_columns);
    both.view_mut((0, 0), (rows, columns)).copy_from(first);
    both.view_mut((rows, columns), (more_rows, more_columns)).copy_from(second);
    both
}

impl WhiteEvidence {
    /// Puts the white numbers of a voltage behind those of the current.
    fn append(&mut self, other: Self) {
        let sizes = [self.white.len(), other.white.len()];
        let [own, others] = sizes.map(|size| DMatrix::zeros(size, size));
        for (first, second) in self.in_common.iter_mut().zip(&other.in_common) {
            if first.is_some() || second.is_some() {
                let first_part = first.as_ref().unwrap_or(&own);
                *first = Some(beside(first_part, second.as_ref().unwrap_or(&others)));
            }
        }
        self.upper = beside(&self.upper, &other.upper);
        self.at.extend(other.at);
        self.white.extend(other.white.iter().copied());
        self.voltage_by = other.voltage_by;
    }

    /// White numbers of a form.
    pub(crate) fn len(&self) -> usize {
        self.white.len()
    }

    /// Addition of one unit of an error of the model in common; `None` where no other recording has
    /// it, or this one has not.
    pub(crate) fn addition(&self, to: CommonTo, error: usize) -> Option<DVector<f64>> {
        let additions = self.in_common[to as usize].as_ref()?;
        (error < additions.ncols()).then(|| additions.column(error).into_owned())
    }

    /// White residual at what a signal shows, without the errors in common.
    pub(crate) fn residual(&self, shown: &[f64]) -> DVector<f64> {
        let moved = shown.iter().zip(&self.at).map(|(now, at)| now - at);
        &self.white - &self.upper * DVector::from_iterator(self.at.len(), moved)
    }

    /// White slope of a change of what the signal shows.
    pub(crate) fn slope(&self, shown: &[f64]) -> DVector<f64> {
        &self.upper * DVector::from_column_slice(shown)
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    /// Evidence of white samples with slopes `J`, a share of whose variance is the model's error.
    fn evidence(slopes: &DMatrix<f64>, residual: &DVector<f64>, share: f64) -> Evidence {
        let information = slopes.tr_mul(slopes);
        Evidence {
            at: vec![0.0; slopes.ncols()],
            descent: slopes.tr_mul(residual).data.into(),
            error: share * &information,
            information,
            in_common: InCommon::default(),
            embedded: None,
            temperature: None,
            voltage: None,
            unmodelled: Vec::new(),
        }
    }

    #[test]
    fn an_embedded_error_is_left_out_of_the_form() {
        let slopes = DMatrix::from_fn(5, 3, |row, column| ((row + 1) as f64).powi(column as i32));
        let residual = DVector::from_fn(5, |row, _| (row as f64).cos());
        let of_quantities = DMatrix::from_row_slice(2, 2, &[0.4, 0.1, 0.1, 0.2]);
        let in_common = InCommon::nested(0.1, 0.2, 0.3);
        let found = evidence(&slopes, &residual, 0.3);
        let found = found.with_embedded_error(&of_quantities, in_common).unwrap();
        // as white samples whose covariance has J·D·Jᵀ besides
        let shown = slopes.columns(0, 2).into_owned();
        let covariance = DMatrix::identity(5, 5) + &shown * &of_quantities * shown.transpose();
        let inverse = covariance.clone().try_inverse().unwrap();
        let expected = slopes.transpose() * &inverse * &slopes;
        assert_relative_eq!(found.information, expected, max_relative = 1e-9);
        let descent = slopes.transpose() * &inverse * &residual;
        assert_relative_eq!(DVector::from_vec(found.descent), descent, max_relative = 1e-9);
        let of = |error: DMatrix<f64>| slopes.transpose() * &inverse * error * &inverse * &slopes;
        assert_relative_eq!(found.error, of(0.3 * DMatrix::identity(5, 5)), max_relative = 1e-8);
        let embedded = of(covariance - DMatrix::identity(5, 5));
        assert_relative_eq!(found.embedded.unwrap().error, embedded, max_relative = 1e-8);
    }
}
