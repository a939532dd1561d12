//! Recordings beside the model: residuals, and what the noise of each signal cannot go below.

use core::cell::Cell;

use inference::rms;

use crate::{
    cause::{Cause, Size, rough},
    model::{ModelError, OwnModel, Record, Recordings},
    ports::{Law, PortsInUse},
    scales::Scales,
};

/// Fewest training samples.
const LEAST_SAMPLES: usize = 100;
/// Share of a signal that no simulation is trusted below.
const FLOOR_OVER_SIGNAL: f64 = 1e-4;

/// Residuals: for each signal those of each recording.
pub(crate) type Residuals = Vec<Vec<Vec<f64>>>;

/// Least noise of any signal; its square is a number.
const LEAST_FLOOR: f64 = 1e-100;

/// A model and the recordings that it is compared with.
pub(crate) struct Problem<'a> {
    model: &'a dyn OwnModel,
    pub(crate) train: &'a [Record],
    pub(crate) holdout: &'a [Record],
    pub(crate) scales: Scales,
    /// Numbers that are fitted with every set of causes, with their places.
    pub(crate) rough: Vec<(usize, Size)>,
    /// Least noise of each signal.
    pub(crate) floors: Vec<f64>,
    runs: Cell<usize>,
}

impl<'a> Problem<'a> {
    /// Checks the recordings and runs the model as it is.
    pub(crate) fn new(
        model: &'a dyn OwnModel,
        recordings: Recordings<'a>,
    ) -> Result<Self, ModelError> {
        let Recordings { train, holdout } = recordings;
        for record in train.iter().chain(holdout) {
            check(record, model.signals())?;
        }
        let samples: usize = train.iter().map(|record| record.test.command.len()).sum();
        if samples < LEAST_SAMPLES {
            return Err(ModelError::TooShort { given: samples, least: LEAST_SAMPLES });
        }
        for number in model.numbers() {
            number.check()?;
        }
        let scales = Scales::of_most_moving(model, train)?;
        let numbers = model.numbers().iter().enumerate();
        let rough = numbers.filter_map(|(n, number)| Some((n, rough(number)?))).collect();
        let floors = (0..model.signals().len()).map(|signal| floor(train, signal)).collect();
        let runs = Cell::new(0);
        let problem = Self { model, train, holdout, scales, rough, floors, runs };
        problem.check_nominal()?;
        Ok(problem)
    }

    /// Signals that are compared.
    pub(crate) fn signals(&self) -> &[String] {
        self.model.signals()
    }

    /// Runs of the model so far, one for each recording.
    pub(crate) fn runs(&self) -> usize {
        self.runs.get()
    }

    /// Samples of a signal in the training recordings.
    pub(crate) fn samples(&self) -> usize {
        self.train.iter().map(|record| record.test.command.len()).sum()
    }

    /// The numbers that are fitted with a set of causes: rough ones, then sizes of the causes.
    pub(crate) fn sizes(&self, causes: &[Cause]) -> Vec<Size> {
        let rough = self.rough.iter().map(|(_, size)| size.clone());
        rough.chain(causes.iter().flat_map(|cause| cause.sizes.clone())).collect()
    }

    /// Measured less predicted signals of recordings, with these values of the sizes.
    pub(crate) fn residuals(
        &self,
        records: &[Record],
        causes: &[Cause],
        values: &[f64],
    ) -> Result<Residuals, ModelError> {
        let mut residuals = vec![Vec::new(); self.signals().len()];
        for record in records {
            let predicted = self.try_predict(record, causes, values)?;
            for ((residuals, predicted), measured) in
                residuals.iter_mut().zip(predicted).zip(&record.signals)
            {
                residuals.push(measured.iter().zip(predicted).map(|(y, m)| y - m).collect());
            }
        }
        Ok(residuals)
    }

    /// Signals that the model gives in the test of a recording.
    pub(crate) fn predict(
        &self,
        record: &Record,
        causes: &[Cause],
        values: &[f64],
    ) -> Result<Vec<Vec<f64>>, ModelError> {
        let mut numbers: Vec<f64> = self.model.numbers().iter().map(|n| n.value).collect();
        let (rough, mut sizes) = values.split_at(self.rough.len());
        for ((place, _), value) in self.rough.iter().zip(rough) {
            numbers[*place] = *value;
        }
        let mut laws: Vec<Law> = Vec::new();
        for cause in causes {
            let (own, rest) = sizes.split_at(cause.sizes.len());
            sizes = rest;
            match cause.number() {
                Some(place) => numbers[place] = own[0],
                None => laws.extend(cause.law(own)),
            }
        }
        let mut ports = PortsInUse::with(&record.test, laws, self.scales.inertia);
        self.runs.set(self.runs.get() + 1);
        let signals = self.model.run(&numbers, &record.test, &mut ports)?;
        self.check_lengths(record, &signals)?;
        Ok(signals)
    }

    /// Signals at values that a search tries: not finite where the model cannot be run with them.
    fn try_predict(
        &self,
        record: &Record,
        causes: &[Cause],
        values: &[f64],
    ) -> Result<Vec<Vec<f64>>, ModelError> {
        match self.predict(record, causes, values) {
            // the model ran as its owner wrote it: it is the trial that it cannot bear
            Err(ModelError::Run(_)) => {
                Ok(vec![vec![f64::NAN; record.test.command.len()]; self.signals().len()])
            }
            other => other,
        }
    }

    fn check_nominal(&self) -> Result<(), ModelError> {
        let values: Vec<f64> = self.rough.iter().map(|(_, size)| size.base).collect();
        for record in self.train.iter().chain(self.holdout) {
            let signals = self.predict(record, &[], &values)?;
            let bad = signals.iter().position(|signal| signal.iter().any(|x| !x.is_finite()));
            if let Some(bad) = bad {
                let (record, signal) = (record.name.clone(), self.signals()[bad].clone());
                return Err(ModelError::Diverged { record, signal });
            }
        }
        Ok(())
    }

    fn check_lengths(&self, record: &Record, signals: &[Vec<f64>]) -> Result<(), ModelError> {
        let expected = record.test.command.len();
        for (place, name) in self.signals().iter().enumerate() {
            let given = signals.get(place).map_or(0, Vec::len);
            if given != expected {
                let (record, signal) = (format!("the model in {}", record.name), name.clone());
                return Err(ModelError::Length { record, signal, given, expected });
            }
        }
        Ok(())
    }
}

/// Refuses a recording whose signals are incomplete.
pub(crate) fn check(record: &Record, signals: &[String]) -> Result<(), ModelError> {
    let expected = record.test.command.len();
    if expected == 0 {
        return Err(ModelError::TooShort { given: 0, least: 1 });
    }
    let command = ("command".to_owned(), &record.test.command);
    let load = &record.test.load;
    if !load.is_empty() && load.len() != expected {
        let (record, signal, given) = (record.name.clone(), "load".to_owned(), load.len());
        return Err(ModelError::Length { record, signal, given, expected });
    }
    if let Some(sample) = load.iter().position(|x| !x.is_finite()) {
        let (record, signal) = (record.name.clone(), "load".to_owned());
        return Err(ModelError::NotFinite { record, signal, sample });
    }
    let none = Vec::new();
    let measured = signals
        .iter()
        .enumerate()
        .map(|(place, name)| (name.clone(), record.signals.get(place).unwrap_or(&none)));
    for (signal, values) in core::iter::once(command).chain(measured) {
        let (record, given) = (record.name.clone(), values.len());
        if given != expected {
            return Err(ModelError::Length { record, signal, given, expected });
        }
        if let Some(sample) = values.iter().position(|x| !x.is_finite()) {
            return Err(ModelError::NotFinite { record, signal, sample });
        }
    }
    Ok(())
}

/// Least noise of a signal: that of its steps, and a share of it that no simulation is trusted
/// below.
fn floor(train: &[Record], signal: usize) -> f64 {
    let mut values: Vec<f64> =
        train.iter().flat_map(|record| record.signals[signal].clone()).collect();
    let size = rms(&values);
    values.sort_by(f64::total_cmp);
    values.dedup();
    let step = values.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    // of a signal without steps it is the least distance by chance, far below its noise
    let of_steps = if step.is_finite() { step / libm::sqrt(12.0) } else { 0.0 };
    // a signal that is zero throughout: whatever the model makes of it is all there is to compare
    of_steps.max(FLOOR_OVER_SIGNAL * size).max(LEAST_FLOOR)
}
