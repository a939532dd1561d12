//! A Gaussian process as serialised data.

use serde::{Deserialize, Serialize};

use super::{
    data::{Data, check_finite},
    fit::{Effort, GaussianProcess, GpOptions},
};
use crate::{
    bounds::Bounds,
    error::{FitError, SettingError},
    features::Features,
};

/// Version of the layout; another one is refused.
const VERSION: u32 = 1;

/// Observations and hyperparameters, of which the rest follows bit for bit on one machine. The
/// bits of the kernels depend on the width of its vector units, as those of a fit do.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Layout {
    version: u32,
    bounds: Bounds,
    options: GpOptions,
    /// Points as fractions of the intervals.
    unit_points: Vec<Vec<f64>>,
    /// Observations × outputs.
    outputs: Vec<Vec<f64>>,
    /// Natural logarithms of the length scales, and of the noise ratio where it is fitted.
    hyperparameters: Vec<f64>,
    /// How many observations, from the back, were appended after the fit.
    appended: usize,
    /// Likelihood evaluations of the fit.
    evaluations: usize,
    /// Points of the fit.
    fitted_on: usize,
}

/// Reasons to refuse serialised data.
#[derive(Debug, thiserror::Error)]
pub(super) enum LayoutError {
    #[error("layout of version {found}, {VERSION} is read")]
    Version { found: u32 },
    #[error("{appended} of {observations} observations appended")]
    Appended { appended: usize, observations: usize },
    #[error("hyperparameter {index} is {value}")]
    Hyperparameter { index: usize, value: f64 },
    #[error(transparent)]
    Fit(#[from] FitError),
}

impl From<GaussianProcess> for Layout {
    fn from(gp: GaussianProcess) -> Self {
        Self {
            version: VERSION,
            bounds: gp.bounds,
            options: gp.options,
            unit_points: gp.data.unit,
            outputs: gp.data.raw,
            hyperparameters: gp.theta,
            appended: gp.appended,
            evaluations: gp.report.evaluations,
            fitted_on: gp.report.fitted_on,
        }
    }
}

impl TryFrom<Layout> for GaussianProcess {
    type Error = LayoutError;

    fn try_from(layout: Layout) -> Result<Self, LayoutError> {
        layout.check()?;
        let Layout { bounds, options, hyperparameters, appended, .. } = layout;
        let (mut unit, mut outputs) = (layout.unit_points, layout.outputs);
        let fitted = unit.len() - appended;
        let later = unit.split_off(fitted).into_iter().zip(outputs.split_off(fitted));
        let data = Data::from_unit(&Features::new(&bounds), unit, outputs);
        let effort = Effort { evaluations: layout.evaluations, points: layout.fitted_on };
        let mut gp = Self::assemble(&bounds, data, &options, hyperparameters, effort)?;
        for (point, outputs) in later {
            gp.append_unit(point, &outputs)?;
        }
        Ok(gp)
    }
}

impl Layout {
    /// The checks of the constructors.
    fn check(&self) -> Result<(), LayoutError> {
        if self.version != VERSION {
            return Err(LayoutError::Version { found: self.version });
        }
        self.options.check().map_err(FitError::from)?;
        let (points, observations) = (self.unit_points.len(), self.outputs.len());
        if points != observations {
            return Err(FitError::CountMismatch { points, observations }.into());
        }
        if points == 0 {
            return Err(FitError::NoObservations.into());
        }
        if self.appended >= points {
            return Err(LayoutError::Appended { appended: self.appended, observations });
        }
        for (point, unit) in self.unit_points.iter().enumerate() {
            self.bounds.check(unit).map_err(|source| FitError::Point { point, source })?;
        }
        let expected = self.outputs[0].len();
        for (observation, outputs) in self.outputs.iter().enumerate() {
            let found = outputs.len();
            if found != expected || found == 0 {
                return Err(FitError::OutputMismatch { observation, expected, found }.into());
            }
            check_finite(observation, outputs)?;
        }
        self.check_hyperparameters()
    }

    fn check_hyperparameters(&self) -> Result<(), LayoutError> {
        let expected = self.options.limits(Features::new(&self.bounds).scales()).lower.len();
        let found = self.hyperparameters.len();
        if found != expected {
            let name = "hyperparameters";
            return Err(FitError::from(SettingError::Length { name, expected, found }).into());
        }
        match self.hyperparameters.iter().position(|value| !libm::exp(*value).is_normal()) {
            Some(index) => {
                Err(LayoutError::Hyperparameter { index, value: self.hyperparameters[index] })
            }
            None => Ok(()),
        }
    }
}
