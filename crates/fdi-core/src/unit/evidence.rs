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
    /// Temperature of the winding, where it was read.
    pub(crate) temperature: Option<TemperatureReading>,
    /// Numbers that the motor's voltage shows, where it was recorded.
    pub(crate) voltage: Option<VoltageReading>,
    /// Effects that the model file does not have and that the residual has the form of; none where
    /// damage is beyond that of the machines whose error was learnt.
    pub(crate) unmodelled: Vec<EffectId>,
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
    /// The form as a sum of squares, with the error of the model set apart that others of its unit
    /// have too:
    ///
    /// ```text
    /// K = L⁻¹·(Jᵀ·Σ⁻¹·S·Σ⁻¹·J)·L⁻ᵀ
    /// z = (1 − ρ_d·K)^(−½)·(L⁻¹·g − Lᵀ·(q − q₀) − (ρ_u·K)^½·β_u − ((ρ_s − ρ_u)·K)^½·β_s
    ///                       − ((ρ_d − ρ_s)·K)^½·β_d)
    /// ```
    ///
    /// with `β` normal: one for all recordings of the unit, one for those of a state of health, one
    /// for those of a session. The numbers of the voltage, whose error is all learnt (`K = 1`), follow
    /// those of the current. `None` where the form is not finite.
    pub(crate) fn white(&self, with: With) -> Option<WhiteEvidence> {
        let mut white = self.white_current(self.in_common.with(with))?;
        if let Some(voltage) = &self.voltage {
            white.append(voltage.white(voltage.in_common.with(with))?);
        }
        Some(white)
    }

    fn white_current(&self, in_common: InCommon) -> Option<WhiteEvidence> {
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
        if in_common.session == 0.0 {
            let (upper, in_common) = (lower.transpose(), [None, None, None]);
            let voltage_by = None;
            return Some(WhiteEvidence { at, voltage_by, upper, white, in_common, temperature });
        }
        let half = lower.solve_lower_triangular(&self.error)?;
        let share = lower.solve_lower_triangular(&half.transpose())?;
        let share = SymmetricEigen::new(0.5 * (&share + share.transpose()));
        let most = MOST_SHARED / in_common.session;
        let values = share.eigenvalues.map(|value| value.clamp(0.0, most.min(1.0)));
        let function = |of: &dyn Fn(f64) -> f64| {
            &share.eigenvectors
                * DMatrix::from_diagonal(&values.map(of))
                * share.eigenvectors.transpose()
        };
        let apart = function(&|value| 1.0 / (1.0 - in_common.session * value).sqrt());
        let InCommon { unit, state, session } = in_common;
        let additions = [unit, state - unit, session - state]
            .map(|share| (share > 0.0).then(|| &apart * function(&|value| (share * value).sqrt())));
        Some(WhiteEvidence {
            upper: &apart * lower.transpose(),
            white: &apart * white,
            in_common: additions,
            voltage_by: None,
            at,
            temperature,
        })
    }
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
