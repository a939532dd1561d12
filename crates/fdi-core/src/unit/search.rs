//! Damage and numbers of a unit that explain a recording.

use ema_sim::{EffectId, SimulationError};
use inference::{
    BandedMatrix, MostProbable, NotPositiveDefinite, SymmetricMatrix, Unknown, Whitened, dot,
    most_probable,
};
use nalgebra::DMatrix;

use crate::{
    offline::factor::joined,
    simulation::experiment::Experiment,
    unit::{
        error::UnitError,
        evidence::{Evidence, TemperatureReading},
        layout::Layout,
        modelled::Modelled,
        monitor::NominalSlopes,
        quantities::Quantities,
        sensors::SensorShares,
        unmodelled::{EffectSlopes, Explanation, unmodelled},
        voltage::VoltageReading,
        weight::Weight,
    },
};

/// Most that one step may move a coordinate of damage: the machine bends within that.
pub(crate) const DAMAGE_REACH: [f64; 7] = [0.15, 0.03, 0.05, 0.05, 0.05, 0.05, 0.05];
/// Standard deviations that one step may move a number.
const NUMBER_REACH: f64 = 4.0;
/// Covariances of the model's error that are tried before the one that the search ends with.
const COVARIANCES: usize = 2;
/// Difference of the share of a wide play that changes no answer.
pub(crate) const SAME_WIDENESS: f64 = 0.1;

/// Why a unit's recording cannot be explained.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum UnitSearchError {
    /// The machine at a trial value cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The covariance has no factor.
    #[error(transparent)]
    Covariance(#[from] NotPositiveDefinite),
    /// Neither recording nor tolerances determine the damage.
    #[error("neither the recording nor the tolerances determine the damage")]
    Undetermined,
}

/// A recording as it is explained.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Observed<'a> {
    /// Filtered envelope, A.
    pub(crate) signal_a: &'a [f64],
    /// Rotor angle at the first sample.
    pub(crate) start_angle_rad: f64,
    /// Shares of the signal that errors of the sensors have, where phases were recorded; else those
    /// of the simulation are taken.
    pub(crate) shares: Option<&'a SensorShares>,
    /// Covariance of the filtered envelope's noise, A².
    pub(crate) noise: &'a BandedMatrix,
    /// Temperature of the winding, where it was read.
    pub(crate) temperature: Option<TemperatureReading>,
    /// Standard deviation of the time at which the command begins, s; zero where it is known.
    pub(crate) start_std_s: f64,
    /// Damage looked for from which the search sets out; of a machine as new none.
    pub(crate) damage: &'a [f64],
    /// Slopes where a search from a machine as new begins, where they are known already.
    pub(crate) nominal_slopes: Option<&'a NominalSlopes>,
}

/// Explanation of a recording.
#[derive(Clone, Debug)]
pub(crate) struct UnitFit {
    /// Damage looked for, then numbers.
    pub(crate) point: Vec<f64>,
    /// Covariance of the damage, the numbers marginal.
    pub(crate) covariance: DMatrix<f64>,
    pub(crate) evidence: Evidence,
    /// Covariance of the damage, were every number known.
    pub(crate) known_numbers: DMatrix<f64>,
    pub(crate) residual_a: Vec<f64>,
    /// Mean square of the white residual.
    pub(crate) misfit: f64,
    /// Part of the residual that noise and learnt error explain, A.
    pub(crate) floor_a: f64,
    /// Share of the covariance of a wide play that it was weighed with.
    pub(crate) wideness: f64,
    pub(crate) converged: bool,
    /// True where the evaluations were spent before it converged.
    pub(crate) cut_short: bool,
    /// Time by which the command begins later than it was taken to, and its standard deviation, s;
    /// `None` where it was known.
    pub(crate) late_s: Option<(f64, f64)>,
    /// Simulations of the low-fidelity model.
    pub(crate) evaluations: u64,
}

/// Remains of an explanation for an answer to several recordings.
#[derive(Clone, Debug)]
pub(crate) struct Explained {
    pub(crate) evidence: Evidence,
    /// Damage looked for, then numbers.
    pub(crate) point: Vec<f64>,
    /// Covariance of the damage, were every number known.
    pub(crate) known_numbers: DMatrix<f64>,
    /// True where damage is beyond that of the machines whose error was learnt, so that the answer
    /// is wider than the evidence.
    pub(crate) is_widened: bool,
    /// Reading that the motor's voltage would give beside it; `None` where it was not learnt.
    pub(crate) voltage_to_come: Option<VoltageReading>,
}

impl Explained {
    pub(crate) fn of(fit: &UnitFit, error: &UnitError, quantities: &Quantities) -> Self {
        Self {
            evidence: fit.evidence.clone(),
            point: fit.point.clone(),
            known_numbers: fit.known_numbers.clone(),
            is_widened: false,
            voltage_to_come: error.expected_voltage(quantities, &fit.point),
        }
    }
}

/// Explains a recording of a unit. A step that has begun is finished, so that the search takes more
/// evaluations than the most asked for by less than one step's.
pub(crate) fn explain(
    experiment: &Experiment,
    quantities: &Quantities,
    error: &UnitError,
    observed: &Observed<'_>,
    effects: &[EffectSlopes],
    most_evaluations: u64,
) -> Result<UnitFit, UnitSearchError> {
    let layout = quantities.layout();
    let mut compared = Compared::new(experiment, quantities, error, observed, effects)?;
    compared.most_evaluations = most_evaluations;
    let mut start = vec![0.0; layout.len()];
    start[..observed.damage.len()].copy_from_slice(observed.damage);
    if observed.start_std_s > 0.0 {
        compared.use_covariance(0.0, &start)?;
    }
    for _ in 0..COVARIANCES {
        let found = most_probable(&mut compared, &unknowns(layout), &start)?;
        let found = found.ok_or(UnitSearchError::Undetermined)?;
        let wideness = error.wideness(&quantities.at(&found.numbers));
        if (wideness - compared.wideness).abs() < SAME_WIDENESS || compared.is_spent() {
            return compared.fit(found);
        }
        start = found.numbers;
        compared.use_covariance(wideness, &start)?;
    }
    let found = most_probable(&mut compared, &unknowns(layout), &start)?;
    compared.fit(found.ok_or(UnitSearchError::Undetermined)?)
}

/// Evidence that a recording of the model file's machine will be on it: its signal is taken to be the
/// one that the model expects.
pub(crate) fn expected_evidence(
    experiment: &Experiment,
    quantities: &Quantities,
    error: &UnitError,
    observed: &Observed<'_>,
) -> Result<Evidence, UnitSearchError> {
    let origin = vec![0.0; quantities.layout().len()];
    let mut compared = Compared::new(experiment, quantities, error, observed, &[])?;
    compared.residual(&origin)?;
    compared.slopes(&origin)?;
    let as_expected = vec![0.0; observed.signal_a.len()];
    Ok(compared.evidence(&origin, &as_expected, Vec::new()))
}

/// The unknowns with their priors: none for damage.
pub(crate) fn unknowns(layout: &Layout) -> Vec<Unknown> {
    let damage = layout
        .sought
        .iter()
        .map(|&coordinate| Unknown { prior_std: None, reach: DAMAGE_REACH[coordinate] });
    let numbers = layout.numbers.iter().map(|number| number_unknown(number.scatter.together()));
    damage.chain(numbers).collect()
}

/// A number of the machine with its prior.
pub(crate) fn number_unknown(std: f64) -> Unknown {
    Unknown { prior_std: Some(std), reach: NUMBER_REACH * std }
}

/// A recording beside the low-fidelity model.
struct Compared<'a> {
    modelled: Modelled<'a>,
    /// Slopes in effects that the model file does not have.
    effects: &'a [EffectSlopes],
    weight: Weight,
    /// Rate of the signal.
    rate_hz: f64,
    /// Share of the covariance of a wide play.
    wideness: f64,
    floor_a: f64,
    /// White slopes of the signal in all that it shows, at the last point asked for.
    white_slopes: Vec<Vec<f64>>,
    /// Evaluations after which no further step is taken.
    most_evaluations: u64,
}

impl<'a> Compared<'a> {
    fn new(
        experiment: &'a Experiment,
        quantities: &'a Quantities,
        error: &'a UnitError,
        observed: &'a Observed<'a>,
        effects: &'a [EffectSlopes],
    ) -> Result<Self, UnitSearchError> {
        let whole = joined(&error.covariance, observed.noise);
        Ok(Self {
            modelled: Modelled::new(experiment, quantities, error, observed),
            effects,
            floor_a: whole.mean_diagonal().sqrt(),
            weight: Weight::new(whole)?,
            rate_hz: experiment.filter.output_hz,
            wideness: 0.0,
            white_slopes: Vec::new(),
            most_evaluations: u64::MAX,
        })
    }
}

impl Compared<'_> {
    /// Weighs with the covariance of the model's error for a share of a wide play, and with a start
    /// of the command that is not known where it is not, at some numbers.
    fn use_covariance(&mut self, wideness: f64, point: &[f64]) -> Result<(), UnitSearchError> {
        let observed = self.modelled.observed;
        let whole = joined(&self.modelled.error.covariance_of(wideness), observed.noise);
        (self.wideness, self.floor_a) = (wideness, whole.mean_diagonal().sqrt());
        let weight = Weight::new(whole)?;
        if observed.start_std_s == 0.0 {
            self.weight = weight;
            return Ok(());
        }
        let mut signal_a = self.modelled.residual_a(point)?;
        for (value, measured) in signal_a.iter_mut().zip(observed.signal_a) {
            *value = measured - *value;
        }
        self.weight = weight.with_shift(&signal_a, self.rate_hz, observed.start_std_s);
        Ok(())
    }

    /// Time by which the command begins later than it was taken to, and its standard deviation, s.
    fn late_s(&self, found: &MostProbable) -> Option<(f64, f64)> {
        let late_s = self.weight.shift_s(&found.white)?;
        let known_s = self.weight.known_shift_std_s()?;
        let slopes = self.unknown_slopes(&found.numbers);
        let by: Vec<f64> =
            slopes.iter().map(|row| self.weight.shift_s(row)).collect::<Option<_>>()?;
        let entry = |i: usize, j: usize| by[i] * found.covariance.at(i, j) * by[j];
        let pairs = (0..by.len()).flat_map(|i| (0..by.len()).map(move |j| (i, j)));
        let open_s2: f64 = pairs.map(|(i, j)| entry(i, j)).sum();
        Some((late_s, open_s2.max(0.0).sqrt().hypot(known_s)))
    }

    fn fit(&mut self, found: MostProbable) -> Result<UnitFit, UnitSearchError> {
        let residual_a = self.modelled.residual_a(&found.numbers)?;
        let unmodelled = self.unmodelled(&found);
        let late_s = self.late_s(&found);
        let samples = self.modelled.observed.signal_a.len();
        let white = &found.white[..samples];
        let plain = self.evidence(&found.numbers, white, unmodelled);
        let of_signal = plain.information.clone();
        let error = self.modelled.error;
        let evidence = plain
            .with_embedded_error(&error.embedded_of(self.wideness), error.embedded.in_common)
            .ok_or(UnitSearchError::Undetermined)?;
        let lost = of_signal - &evidence.information;
        let [covariance, known_numbers] =
            self.open(&found, &lost).ok_or(UnitSearchError::Undetermined)?;
        Ok(UnitFit {
            misfit: dot(white, white) / samples as f64,
            point: found.numbers,
            evidence,
            covariance,
            known_numbers,
            residual_a,
            floor_a: self.floor_a,
            wideness: self.wideness,
            cut_short: !found.converged && self.is_spent(),
            converged: found.converged,
            late_s,
            evaluations: self.modelled.evaluations,
        })
    }
}

impl Compared<'_> {
    /// Covariance of the damage, with the numbers marginal and with every number known, where some of
    /// the information on what the signal shows is lost to the model's error.
    fn open(&self, found: &MostProbable, lost: &DMatrix<f64>) -> Option<[DMatrix<f64>; 2]> {
        let damage = self.modelled.quantities.layout().sought.len();
        let of_damage = |matrix: &DMatrix<f64>| matrix.view((0, 0), (damage, damage)).into_owned();
        if lost.iter().all(|value| *value == 0.0) {
            let known_numbers = block(&found.information, damage).try_inverse()?;
            return Some([block(&found.covariance, damage), known_numbers]);
        }
        let by = self.modelled.quantities.shown_slopes(&found.numbers);
        let by = DMatrix::from_fn(by.len(), lost.nrows(), |unknown, shown| by[unknown][shown]);
        let information = block(&found.information, by.nrows()) - &by * lost * by.transpose();
        let known_numbers = of_damage(&information).cholesky()?.inverse();
        Some([of_damage(&information.cholesky()?.inverse()), known_numbers])
    }

    /// Evidence at a point of the unknowns with a white residual, by the slopes of the last point.
    fn evidence(&self, point: &[f64], white: &[f64], unmodelled: Vec<EffectId>) -> Evidence {
        let rows = &self.white_slopes;
        let product = |i: usize, j: usize| dot(&rows[i], &rows[j]);
        Evidence {
            at: self.modelled.quantities.shown_at(point),
            information: DMatrix::from_fn(rows.len(), rows.len(), product),
            descent: rows.iter().map(|row| dot(row, white)).collect(),
            error: self.error(),
            in_common: self.modelled.error.in_common,
            embedded: None,
            temperature: self.modelled.observed.temperature,
            voltage: None,
            unmodelled,
        }
    }

    /// `Jᵀ·Σ⁻¹·S·Σ⁻¹·J` with `S` the covariance of the learnt error.
    fn error(&self) -> DMatrix<f64> {
        let mut through = self.white_slopes.clone();
        self.weight.whiten_transposed_each(&mut through);
        let covariance = self.modelled.error.covariance_of(self.wideness);
        let spread: Vec<Vec<f64>> = through.iter().map(|row| covariance.times(row)).collect();
        // one order of each product, so that the matrix is its own transpose to the last bit
        let entry = |i: usize, j: usize| dot(&through[i.max(j)], &spread[i.min(j)]);
        DMatrix::from_fn(through.len(), through.len(), entry)
    }

    /// White slopes in the unknowns, by white slopes in all that the signal shows.
    fn unknown_slopes(&self, point: &[f64]) -> Vec<Vec<f64>> {
        let mut slopes = self.modelled.unknown_slopes(point, &self.white_slopes);
        if let Some((place, reading)) = self.modelled.temperature() {
            for (unknown, row) in slopes.iter_mut().enumerate() {
                row.push(if unknown == place { 1.0 / reading.std_k } else { 0.0 });
            }
        }
        slopes
    }

    /// Effects that the model file does not have and that the residual has the form of.
    fn unmodelled(&self, found: &MostProbable) -> Vec<EffectId> {
        let slopes = self.unknown_slopes(&found.numbers);
        let unknowns = unknowns(self.modelled.quantities.layout());
        let explanation = Explanation::at(found, &slopes, &unknowns);
        let white = |effect: &EffectSlopes| {
            let mut rows = effect.rows.clone();
            self.weight.whiten_each(&mut rows);
            for row in &mut rows {
                // an effect moves no thermometer
                row.resize(found.white.len(), 0.0);
            }
            EffectSlopes { effect: effect.effect, rows }
        };
        let effects: Vec<EffectSlopes> = self.effects.iter().map(white).collect();
        let own_error = |effect| self.modelled.error.effect_error(effect, self.wideness);
        unmodelled(&explanation, &effects, own_error)
    }
}

/// The first rows and columns of a matrix.
pub(crate) fn block(matrix: &SymmetricMatrix, size: usize) -> DMatrix<f64> {
    DMatrix::from_fn(size, size, |row, column| matrix.at(row, column))
}

impl Whitened for Compared<'_> {
    type Error = SimulationError;

    fn residual(&mut self, point: &[f64]) -> Result<Vec<f64>, SimulationError> {
        let mut residual = self.modelled.residual_a(point)?;
        self.weight.whiten(&mut residual);
        residual.extend(
            self.modelled
                .temperature()
                .map(|(place, reading)| (reading.away_k - point[place]) / reading.std_k),
        );
        Ok(residual)
    }

    fn slopes(&mut self, point: &[f64]) -> Result<Vec<Vec<f64>>, SimulationError> {
        self.white_slopes = self.modelled.shown_slopes(point)?;
        self.weight.whiten_each(&mut self.white_slopes);
        Ok(self.unknown_slopes(point))
    }

    fn is_spent(&self) -> bool {
        self.modelled.evaluations >= self.most_evaluations
    }
}
