#![doc = include_str!("../README.md")]

mod acquisition;
mod baseline;
mod bounds;
mod covariance;
mod derivative_free;
mod design;
mod dual;
mod error;
mod features;
mod gp;
mod kernel;
mod levenberg;
mod linalg;
mod matrix;
mod maximise;
mod minimise;
mod normal;
mod random;
mod sobol;
mod stop;
mod study;
mod transformation;

pub use acquisition::{Acquisition, Confidence, Fantasies, NormImprovement, Scored, TwoStep};
pub use baseline::{Population, PopulationOptions, PopulationSolution};
pub use bounds::{Bounds, InputKind};
pub use covariance::{condition_number, covariance};
pub use derivative_free::DerivativeFreeGaussNewton;
pub use design::Design;
pub use error::{
    AcquisitionError, BoundsError, CovarianceError, DesignError, FitError, MatrixError,
    SettingError, SolveError, StudyError,
};
pub use gp::{
    ChosenSurrogate, FitReport, GaussianProcess, GpOptions, Hyperparameters, LeaveOneOut, Noise,
    Prediction, PredictionSlope, SurrogateChoice,
};
pub use kernel::Kernel;
pub use levenberg::{FinalJacobian, LevenbergMarquardt, Solution};
pub use matrix::Matrix;
pub use maximise::{Maximiser, Proposal};
pub use stop::StopReason;
pub use study::{
    Ask, Best, Criterion, Objective, Outcome, Reach, RunError, Stall, Study, StudyOptions,
    StudyState, SurrogateRule, Told,
};
pub use transformation::{OutputForm, Transformation};
