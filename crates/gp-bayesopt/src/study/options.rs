//! Settings of a study.

use crate::{
    acquisition::{Confidence, Fantasies},
    bounds::Bounds,
    design::Design,
    error::SettingError,
    gp::{GpOptions, Noise},
    maximise::Maximiser,
};

/// The criterion of a study on a scalar.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Criterion {
    /// Expected improvement (FREEDOM paper, eq. 12), maximised through its logarithm.
    ExpectedImprovement,
    /// Lower confidence bound (FREEDOM paper, eq. 13).
    LowerConfidence(Confidence),
    /// Two-step lookahead expected improvement (FREEDOM paper, eq. 14).
    TwoStep(Fantasies),
}

/// Kind of outcome that is told after each evaluation.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Objective {
    /// A number to be minimised (the paper's Algorithm 1 on `δ`).
    Scalar(Criterion),
    /// A vector whose norm is to be minimised; every entry is modelled.
    Residual,
}

/// The surrogate of a study on a scalar.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum SurrogateRule {
    /// The outcomes themselves, with the kernel of [`StudyOptions::gp`].
    #[default]
    Given,
    /// Kernel and output transformation that predict best ([`crate::ChosenSurrogate`]), chosen
    /// anew whenever the hyperparameters are fitted.
    Chosen,
}

/// The part of the box in which a criterion is maximised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Reach {
    /// The whole box.
    #[default]
    Box,
    /// A region around the best observation, which grows with success and shrinks without.
    TrustRegion,
    /// The box and the region in turns for three fifths of the budget beyond the first points,
    /// then the region alone. The last tenth goes to the least predicted mean in the region in
    /// place of the criterion, which would explore for evaluations that never come.
    InTurns,
}

/// When a run counts as stalled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stall {
    /// Evaluations without progress that end the run.
    pub evaluations: usize,
    /// Decrease of the best value, relative to it, that counts as progress.
    pub relative_gain: f64,
}

/// Settings of a [`Study`](crate::Study).
#[derive(Clone, Debug, PartialEq)]
pub struct StudyOptions {
    /// The box.
    pub bounds: Bounds,
    /// Kind of outcome, and for a scalar the criterion.
    pub objective: Objective,
    /// How the first points are spread.
    pub design: Design,
    /// How many first points.
    pub design_points: usize,
    /// Evaluations allowed, the first points included, earlier data not.
    pub budget: usize,
    /// Value (or norm) that ends the run.
    pub target: f64,
    /// When to give up, if ever.
    pub stall: Option<Stall>,
    /// The surrogate.
    pub gp: GpOptions,
    /// Rule of the surrogate, for a scalar.
    pub surrogate: SurrogateRule,
    /// Part of the box that is searched; for expected improvement alone.
    pub reach: Reach,
    /// Hyperparameters are fitted at every observation up to this number of
    /// observations beyond the first points, then at every fifth.
    pub always_fit: usize,
    /// The inner search.
    pub maximiser: Maximiser,
    /// Seed of everything random.
    pub seed: u64,
}

impl StudyOptions {
    /// Algorithm 1 of the FREEDOM paper on a scalar, with a Sobol' design of
    /// `2·d + 6` points.
    pub fn scalar(bounds: Bounds, criterion: Criterion, budget: usize) -> Self {
        Self {
            design: Design::Sobol,
            design_points: 2 * bounds.dimension() + 6,
            bounds,
            objective: Objective::Scalar(criterion),
            budget,
            target: f64::NEG_INFINITY,
            stall: None,
            gp: GpOptions {
                noise: Noise::Fitted { lower: 1e-8, upper: 1e-1 },
                ..GpOptions::default()
            },
            surrogate: SurrogateRule::Given,
            reach: Reach::Box,
            always_fit: 15,
            maximiser: Maximiser::default(),
            seed: 0,
        }
    }

    /// A scalar of which nothing is known: expected improvement on a surrogate whose kernel and
    /// output transformation are chosen, in the box and a trust region in turns.
    ///
    /// Weak normal priors keep length scales determined, and noise is taken for possible down to
    /// 1e-13 of the variance, so that last digits are not lost in it. The Sobol' design has
    /// `4·d + 6` points, or three tenths of the budget where that is less: more than that of
    /// [`Self::scalar`] as a rule, to see more of the box before a region is entered.
    pub fn adaptive(bounds: Bounds, budget: usize) -> Self {
        let scalar = Self::scalar(bounds, Criterion::ExpectedImprovement, budget);
        let noise = Noise::Fitted { lower: 1e-13, upper: 1e-1 };
        Self {
            design_points: (4 * scalar.bounds.dimension() + 6).min(budget.div_ceil(10) * 3),
            gp: GpOptions { noise, prior_weight: 1e-2, ..scalar.gp },
            surrogate: SurrogateRule::Chosen,
            reach: Reach::InTurns,
            ..scalar
        }
    }

    /// A residual whose norm is minimised, every entry modelled with one
    /// shared kernel. The Sobol' design has `d + 1` points: enough for a first
    /// linear model, the rest is left to the criterion.
    pub fn residual(bounds: Bounds, budget: usize) -> Self {
        Self {
            design_points: bounds.dimension() + 1,
            objective: Objective::Residual,
            target: 0.0,
            gp: GpOptions {
                noise: Noise::Ratio(1e-10),
                starts: 1,
                evaluations_per_start: 40,
                prior_weight: 1e-4,
                length_scales: (0.03, 20.0),
                ..GpOptions::default()
            },
            maximiser: Maximiser { candidates: 400, restarts: 0, ..Maximiser::default() },
            ..Self::scalar(bounds, Criterion::ExpectedImprovement, budget)
        }
    }

    pub(super) fn check(&self) -> Result<(), SettingError> {
        let bad = |name, value, needs| Err(SettingError::OutOfRange { name, value, needs });
        if self.budget == 0 {
            return bad("budget", 0.0, "at least 1");
        }
        if self.target.is_nan() {
            return bad("target", self.target, "a number");
        }
        if self.maximiser.candidates == 0 {
            return bad("candidates", 0.0, "at least 1");
        }
        if let Some(stall) = self.stall
            && (stall.evaluations == 0 || stall.relative_gain.is_nan())
        {
            return bad("stall", stall.evaluations as f64, "at least 1");
        }
        if let Objective::Scalar(Criterion::LowerConfidence(Confidence::Srinivas { delta })) =
            &self.objective
            && !(*delta > 0.0 && *delta < 1.0)
        {
            return bad("delta", *delta, "between 0 and 1");
        }
        Ok(())
    }
}
