//! The numbers of a model, fitted together.

use crate::{
    explain::{Estimate, SignalFit, estimates, signal_fits},
    fit::{Fitted, fit},
    model::{ModelError, Number, OwnModel, Ports, Recordings, Test},
    ports::PortsInUse,
    problem::Problem,
};

/// The numbers of a model as recordings of a machine without causes show them.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnCalibration {
    /// All numbers that have a tolerance or a scale.
    pub numbers: Vec<Estimate>,
    /// Share of the standard deviation known beforehand that is left, of each number.
    pub left_of_prior: Vec<f64>,
    /// Correlation of each pair of numbers.
    pub correlations: Vec<Vec<f64>>,
    /// Each signal, before with the numbers as they are.
    pub signals: Vec<SignalFit>,
    /// Runs of the model, one for each recording.
    pub runs: usize,
}

/// A model all of whose numbers are known only roughly.
struct Rough<'a> {
    model: &'a dyn OwnModel,
    numbers: Vec<Number>,
}

impl OwnModel for Rough<'_> {
    fn numbers(&self) -> &[Number] {
        &self.numbers
    }

    fn signals(&self) -> &[String] {
        self.model.signals()
    }

    fn ports(&self) -> Ports {
        self.model.ports()
    }

    fn run(
        &self,
        numbers: &[f64],
        test: &Test,
        ports: &mut PortsInUse,
    ) -> Result<Vec<Vec<f64>>, ModelError> {
        self.model.run(numbers, test, ports)
    }
}

/// Fits all numbers of a model together, no cause beside them.
///
/// # Errors
///
/// Those of [`explain`](crate::explain).
pub fn calibrate(
    model: &dyn OwnModel,
    recordings: Recordings<'_>,
) -> Result<OwnCalibration, ModelError> {
    let mut numbers = model.numbers().to_vec();
    for number in &mut numbers {
        if number.tolerance.is_none() {
            number.tolerance = Some(number.suspected_std()?);
        }
    }
    let rough = Rough { model, numbers };
    let problem = Problem::new(&rough, recordings)?;
    if problem.rough.is_empty() {
        return Err(ModelError::Nothing);
    }
    let fitted = fit(&problem, &[], &vec![0.0; problem.rough.len()])?;
    let base: Vec<f64> = problem.rough.iter().map(|(_, size)| size.base).collect();
    let residuals = problem.residuals(problem.train, &[], &base)?;
    let before = Fitted { values: base, residuals, ..fitted.clone() };
    let left_of_prior =
        problem.rough.iter().zip(&fitted.stds).map(|((_, size), std)| std / size.std).collect();
    Ok(OwnCalibration {
        numbers: estimates(&problem, &fitted, 0, problem.rough.len()),
        left_of_prior,
        correlations: fitted.correlations.clone(),
        signals: signal_fits(&problem, &before, &fitted)?,
        runs: problem.runs(),
    })
}
