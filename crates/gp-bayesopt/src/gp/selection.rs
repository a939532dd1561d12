//! The choice of kernel and output transformation by what they predict.

use super::fit::{GaussianProcess, GpOptions};
use crate::{
    bounds::Bounds,
    error::FitError,
    kernel::Kernel,
    transformation::{OutputForm, Transformation},
};

/// Kernels that a choice is made from.
const KERNELS: [Kernel; 2] = [Kernel::SquaredExponential, Kernel::Matern52];

/// A kernel and the form of the outputs that it describes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct SurrogateChoice {
    /// The covariance function.
    pub kernel: Kernel,
    /// The form of the outputs.
    pub form: OutputForm,
}

impl SurrogateChoice {
    /// All that a choice is made from, the plain one first.
    fn candidates() -> impl Iterator<Item = Self> {
        let forms = OutputForm::CANDIDATES.into_iter();
        forms.flat_map(|form| KERNELS.into_iter().map(move |kernel| Self { kernel, form }))
    }
}

/// A process of transformed outputs.
#[derive(Clone, Debug)]
pub struct ChosenSurrogate {
    /// The process; its outputs are transformed ones.
    pub process: GaussianProcess,
    /// Kernel and form that were chosen.
    pub choice: SurrogateChoice,
    /// The transformation that the form is for these outputs.
    pub transformation: Transformation,
    /// Leave-one-out log predictive density of the outputs themselves.
    pub ln_density: f64,
}

impl ChosenSurrogate {
    /// Fits one output with every kernel and every form, and keeps the one that predicts best.
    ///
    /// ```text
    /// Σ_i [ln p(z_i | z_{−i}) + ln dz/dy(y_i)],   z = T(y)
    /// ```
    ///
    /// The slope of the transformation makes densities of different transformations those of
    /// the same outputs.
    ///
    /// # Errors
    /// Those of [`GaussianProcess::fit`], when no candidate can be fitted.
    pub fn fit(
        bounds: &Bounds,
        points: &[Vec<f64>],
        values: &[f64],
        options: &GpOptions,
    ) -> Result<Self, FitError> {
        Self::fit_from(bounds, points, values, options, None)
    }

    /// Fits from the hyperparameters of an earlier fit beside the usual starts.
    pub(crate) fn fit_from(
        bounds: &Bounds,
        points: &[Vec<f64>],
        values: &[f64],
        options: &GpOptions,
        warm: Option<&[f64]>,
    ) -> Result<Self, FitError> {
        let mut best: Option<Self> = None;
        let mut failure = FitError::NoObservations;
        for choice in SurrogateChoice::candidates() {
            let data = Described { bounds, points, values };
            match data.fitted(choice, options, warm) {
                Some(Ok(found))
                    if best.as_ref().is_none_or(|best| found.ln_density > best.ln_density) =>
                {
                    best = Some(found);
                }
                Some(Err(error)) => failure = error,
                Some(Ok(_)) | None => {}
            }
        }
        best.ok_or(failure)
    }

    /// A given choice with given hyperparameters; `None` where the form has no transformation
    /// for these outputs.
    pub(crate) fn at(
        bounds: &Bounds,
        points: &[Vec<f64>],
        values: &[f64],
        (options, theta): (&GpOptions, &[f64]),
        choice: SurrogateChoice,
    ) -> Option<Result<Self, FitError>> {
        let data = Described { bounds, points, values };
        data.described(choice, |outputs| {
            let options = GpOptions { kernel: choice.kernel, ..options.clone() };
            GaussianProcess::at(bounds, points, outputs, &options, theta)
        })
    }
}

/// One output at some points.
#[derive(Clone, Copy)]
struct Described<'a> {
    bounds: &'a Bounds,
    points: &'a [Vec<f64>],
    values: &'a [f64],
}

impl Described<'_> {
    fn fitted(
        self,
        choice: SurrogateChoice,
        options: &GpOptions,
        warm: Option<&[f64]>,
    ) -> Option<Result<ChosenSurrogate, FitError>> {
        self.described(choice, |outputs| {
            let options = GpOptions { kernel: choice.kernel, ..options.clone() };
            GaussianProcess::fit_from(self.bounds, self.points, outputs, &options, warm)
        })
    }

    fn described(
        self,
        choice: SurrogateChoice,
        process: impl FnOnce(&crate::matrix::Matrix) -> Result<GaussianProcess, FitError>,
    ) -> Option<Result<ChosenSurrogate, FitError>> {
        let transformation = choice.form.for_outputs(self.values)?;
        let transformed: Vec<f64> = self.values.iter().map(|y| transformation.of(*y)).collect();
        let process = match process(&super::fit::column(&transformed)) {
            Ok(process) => process,
            Err(error) => return Some(Err(error)),
        };
        let slopes: f64 = self.values.iter().map(|y| transformation.ln_slope(*y)).sum();
        let ln_density = process.leave_one_out(0).ln_density() + slopes;
        Some(Ok(ChosenSurrogate { process, choice, transformation, ln_density }))
    }
}
