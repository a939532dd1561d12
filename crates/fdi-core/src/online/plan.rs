//! Options of a diagnosis, resolved once into what a run needs.

use std::sync::Arc;

use gp_bayesopt::Criterion;

use crate::{
    online::{
        beginning::{Freedom, is_free},
        error::DiagnoseError,
        options::DiagnoseOptions,
        scalar_search,
    },
    report::{Fidelity, Method, ToleranceUse},
    simulation::experiment::Experiment,
    unit::learnt_unit::LearntUnit,
};

/// Longest delay that is looked for, s: a search finds it from delays in even steps.
const MOST_DELAY_S: f64 = 0.05;
/// Most evaluations of a search with the response surface's slopes; three are usual.
const SURFACE_EVALUATIONS: usize = 10;
/// Most evaluations of one search by Levenberg and Marquardt.
const LEAST_SQUARES_EVALUATIONS: usize = 200;
/// Most evaluations of a search with the start.
const FREE_START_EVALUATIONS: usize = 400;

/// Most evaluations of one Bayesian optimisation of the residual.
const COMPOSITE_EVALUATIONS: usize = 80;

/// Search for the fault levels.
#[derive(Clone, Debug)]
pub(crate) enum Search {
    /// Generalised least squares.
    LeastSquares,
    /// The emulator, else generalised least squares.
    Emulator,
    /// Bayesian optimisation of the residual.
    Composite,
    /// Bayesian optimisation of the scalar discrepancy.
    Scalar(Criterion),
}

/// Most evaluations of the low-fidelity model in each kind of search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    pub(crate) surface: u64,
    pub(crate) least_squares: usize,
    pub(crate) free_start: usize,
    pub(crate) scalar: usize,
    pub(crate) composite: usize,
    /// Budget of a machine within its tolerances.
    pub(crate) unit: u64,
}

/// Resolved options.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) search: Search,
    /// Published name of the method asked for.
    pub(crate) method: Method,
    pub(crate) fidelity: Fidelity,
    pub(crate) budget: Budget,
    /// Noise on each phase sample, where the user knows it, A.
    pub(crate) noise_a: Option<f64>,
    /// True where the numbers of the machine scatter; else why they do not, where that was asked.
    pub(crate) tolerance: Result<(), Option<&'static str>>,
    /// Parts of the start that are estimated; `None`: the test begins as the bundle has it.
    pub(crate) freedom: Option<Freedom>,
    /// True where the start of the command may be moved, and the recording diagnosed again.
    pub(crate) moves_start: bool,
    /// The unit that the recording is of, where it was learnt.
    pub(crate) unit: Option<Arc<LearntUnit>>,
    /// True where the answer says how well each fault can be told.
    pub(crate) identifiability: bool,
    pub(crate) seed: u64,
}

impl Plan {
    /// Plan of options for an experiment.
    ///
    /// # Errors
    ///
    /// [`DiagnoseError`] for options that do not go together.
    pub(crate) fn of(
        options: &DiagnoseOptions,
        experiment: &Experiment,
    ) -> Result<Self, DiagnoseError> {
        let &DiagnoseOptions { method, fidelity, noise_a, seed, .. } = options;
        check_start(options)?;
        let search = match (scalar_search::criterion(method, seed), method) {
            (Some(_), _) if fidelity == Fidelity::High => {
                return Err(DiagnoseError::HighFidelityMethod { method });
            }
            (Some(criterion), _) => Search::Scalar(criterion),
            (None, Method::Emulator) => Search::Emulator,
            (None, Method::Composite) => Search::Composite,
            (None, _) => Search::LeastSquares,
        };
        let most = |usual: usize| options.max_evaluations.unwrap_or(usual);
        let budget = Budget {
            surface: most(SURFACE_EVALUATIONS).min(SURFACE_EVALUATIONS) as u64,
            least_squares: most(LEAST_SQUARES_EVALUATIONS),
            free_start: most(FREE_START_EVALUATIONS),
            scalar: most(scalar_search::default_budget(experiment.sought_indices().len())),
            composite: most(COMPOSITE_EVALUATIONS),
            unit: options.max_evaluations.map_or(u64::MAX, |most| most as u64),
        };
        let freedom = Freedom::of(options, experiment);
        let tolerance = tolerance(options, freedom.is_some());
        let unit = options.unit.clone();
        let moves_start = false;
        Ok(Self {
            search,
            method,
            fidelity,
            budget,
            noise_a,
            tolerance,
            freedom,
            moves_start,
            unit,
            identifiability: options.identifiability,
            seed,
        })
    }

    /// The plan for a recording whose command begins at a time that is known to a standard deviation, s:
    /// where the machine is exactly its model file, it is looked for with the faults.
    ///
    /// # Errors
    ///
    /// [`DiagnoseError::StartMethod`] for a method that cannot look for it.
    pub(crate) fn with_start(
        self,
        std_s: f64,
        moves_start: bool,
        experiment: &Experiment,
    ) -> Result<Self, DiagnoseError> {
        if std_s == 0.0 || self.freedom.is_some() {
            return Ok(self);
        }
        if self.method != Method::Gls || self.fidelity != Fidelity::Low {
            return Err(DiagnoseError::StartMethod);
        }
        let options = DiagnoseOptions { max_delay_s: 2.0 * std_s, ..DiagnoseOptions::default() };
        Ok(Self { freedom: Freedom::of(&options, experiment), moves_start, ..self })
    }

    /// True where the answer may be the emulator's.
    pub(crate) fn emulates(&self) -> bool {
        matches!(self.search, Search::Emulator)
    }
}

/// Tells whether tolerances are used, or why not where they were asked for.
fn tolerance(options: &DiagnoseOptions, is_free: bool) -> Result<(), Option<&'static str>> {
    match options {
        DiagnoseOptions { tolerance: ToleranceUse::None, .. } => Err(None),
        DiagnoseOptions { fidelity: Fidelity::High, .. } => {
            Err(Some("the high-fidelity model was asked for"))
        }
        DiagnoseOptions { method, .. } if *method != Method::Gls => {
            Err(Some("another method than `gls` was asked for"))
        }
        _ if is_free => Err(Some("the start of the test is estimated with the faults")),
        _ => Ok(()),
    }
}

/// Refuses a start that a method cannot look for.
fn check_start(options: &DiagnoseOptions) -> Result<(), DiagnoseError> {
    let found_s = options.max_delay_s;
    if !(0.0..=MOST_DELAY_S).contains(&found_s) {
        return Err(DiagnoseError::MostDelay { found_s, most_s: MOST_DELAY_S });
    }
    let plain = options.method == Method::Gls && options.fidelity == Fidelity::Low;
    if is_free(options) && !plain {
        return Err(DiagnoseError::StartMethod);
    }
    Ok(())
}
